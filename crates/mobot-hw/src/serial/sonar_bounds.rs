//! The ends of a sonar's range, where a number no longer is a distance.

use occgrid::Reading;

/// The least and the largest distance that a sonar measures [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SonarBounds {
    pub(crate) nearest: f64,
    pub(crate) farthest: f64,
}

impl SonarBounds {
    /// What a distance means [m]: at the near end it may be nearer, at the far end nothing was heard.
    pub(crate) fn reading(&self, range: f64) -> Reading {
        if range >= self.farthest {
            Reading::NoEcho {
                listened: self.farthest,
            }
        } else if range <= self.nearest {
            Reading::TooClose
        } else {
            Reading::Echo { range }
        }
    }
}
