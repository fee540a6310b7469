//! Wall time for records. Nothing that decides ever sees it.

use std::time::{SystemTime, UNIX_EPOCH};

/// Where a log's stamps come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stamps {
    /// The machine's clock, read at every step.
    #[default]
    Wall,
    /// The run's own clock from this time on [ns since 1970]: for virtual time, and for logs that are the
    /// same every time.
    From(u64),
}

/// Nanoseconds of a time of the run [s].
#[derive(Debug)]
pub(super) struct WallTime {
    stamps: Stamps,
    /// A time of the run [s], and the wall's [ns].
    anchor: (f64, u64),
}

impl WallTime {
    pub(super) fn new(stamps: Stamps) -> Self {
        let anchor = match stamps {
            Stamps::Wall => (0.0, wall()),
            Stamps::From(start) => (0.0, start),
        };
        Self { stamps, anchor }
    }

    /// The run's clock says `now` [s].
    pub(super) fn tick(&mut self, now: f64) {
        if !now.is_finite() {
            return;
        }
        match self.stamps {
            Stamps::Wall => self.anchor = (now, wall()),
            Stamps::From(start) => self.anchor = (now, later(start, now)),
        }
    }

    /// When the last step began.
    pub(super) const fn now(&self) -> u64 {
        self.anchor.1
    }

    /// A time of the run; that of the last step where it is none.
    pub(super) fn of(&self, time: f64) -> u64 {
        let (then, nanoseconds) = self.anchor;
        if time.is_finite() {
            later(nanoseconds, time - then)
        } else {
            nanoseconds
        }
    }
}

/// So many seconds later, or earlier.
fn later(nanoseconds: u64, seconds: f64) -> u64 {
    nanoseconds.saturating_add_signed((seconds * 1e9).round() as i64)
}

fn wall() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| {
        u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
    })
}
