//! What one firing of the sonar gave, typed: silence and failure are readings too.

use crate::Pose2;

/// The outcome of one firing.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(tag = "kind", rename_all = "snake_case"))]
pub enum Reading {
    /// The first echo came back from this distance.
    Echo {
        /// From the sonar to whatever reflected [m].
        range: f64,
    },
    /// Nothing came back while the sonar listened.
    NoEcho {
        /// The distance whose echo would still have been heard [m].
        listened: f64,
    },
    /// Something is nearer than the sonar can measure. Never mapped.
    TooClose,
    /// The sonar failed: a timeout, a checksum, a stale or impossible value. Never mapped.
    Fault,
}

/// One firing of the sonar: when, from where, in which direction, and what came of it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shot {
    /// Time of the firing [s], on any clock.
    pub stamp: f64,
    /// Pose of the base in the map frame at that time.
    pub map_from_base: Pose2,
    /// Direction of the shot in the base frame, counter-clockwise from straight ahead [rad].
    pub bearing: f64,
    /// What came of it.
    pub reading: Reading,
}

/// How many shots of each kind there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ReadingCounts {
    /// [`Reading::Echo`]
    pub echo: usize,
    /// [`Reading::NoEcho`]
    pub no_echo: usize,
    /// [`Reading::TooClose`]
    pub too_close: usize,
    /// [`Reading::Fault`]
    pub fault: usize,
}

impl ReadingCounts {
    /// Counts the kinds in a log.
    #[must_use]
    pub fn of(shots: &[Shot]) -> Self {
        let mut counts = Self::default();
        for shot in shots {
            *match shot.reading {
                Reading::Echo { .. } => &mut counts.echo,
                Reading::NoEcho { .. } => &mut counts.no_echo,
                Reading::TooClose => &mut counts.too_close,
                Reading::Fault => &mut counts.fault,
            } += 1;
        }
        counts
    }
}
