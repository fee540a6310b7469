//! What a device can suffer, and when. The words are those of PX4's failure injection (docs.px4.io,
//! "System Failure Injection"): off, stuck, garbage, wrong, slow, delayed, intermittent.

/// A way to fail. What each does to each device is written at [`Faulty`](super::Faulty).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Trouble {
    /// Silent; commands are lost.
    Off,
    /// Answers in time, and always the same.
    Stuck,
    /// What comes is no answer.
    Garbage {
        /// Share of the calls that suffer, 0 to 1.
        share: f64,
    },
    /// Answers well-formed and wrong.
    Wrong {
        /// How far: share of the range, of the way of the left wheel, of the height of the picture; the
        /// pan stands by so much beside what it says [rad].
        by: f64,
    },
    /// Every call takes longer.
    Slow {
        /// How many times as long, 1 or more.
        factor: f64,
    },
    /// Answers are old, commands arrive late.
    Delayed {
        /// By how much [s].
        seconds: f64,
    },
    /// Off and on by turns, off first.
    Intermittent {
        /// Length of a turn [s], above 0.
        seconds: f64,
    },
    /// Single calls are lost.
    Drop {
        /// Share of the calls that are lost, 0 to 1.
        share: f64,
    },
    /// The last answer again and again, with its old stamp; commands are lost and acknowledged.
    Freeze,
    /// No longer there.
    Unplug,
}

/// A trouble and its time, on the clock that goes with the device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Failure {
    /// What happens.
    pub trouble: Trouble,
    /// When it begins [s].
    pub from: f64,
    /// When it is over [s]; infinite for never.
    pub until: f64,
}

impl Failure {
    /// From a time on, for good.
    #[must_use]
    pub const fn from(trouble: Trouble, from: f64) -> Self {
        Self {
            trouble,
            from,
            until: f64::INFINITY,
        }
    }

    /// The trouble that it is at a time, between its turns none.
    fn at(&self, now: f64) -> Option<Trouble> {
        if !(self.from <= now && now < self.until) {
            return None;
        }
        match self.trouble {
            Trouble::Intermittent { seconds } => {
                let turns = ((now - self.from) / seconds).floor();
                (turns % 2.0 < 0.5).then_some(Trouble::Off)
            }
            other => Some(other),
        }
    }

    /// How much of the time up to `now` a clock has lost [s].
    fn lost_by(&self, now: f64) -> f64 {
        let share = match self.trouble {
            Trouble::Stuck | Trouble::Freeze => 1.0,
            Trouble::Slow { factor } => 1.0 - 1.0 / factor.max(1.0),
            _ => 0.0,
        };
        share * (now.min(self.until) - self.from).max(0.0)
    }
}

/// How a device fails.
#[derive(Debug, Clone, PartialEq)]
pub struct FaultyParams {
    /// What happens when; of several at a time the first one counts.
    pub failures: Vec<Failure>,
    /// How long a call waits for a device that is silent [s], 0 or more.
    pub timeout: f64,
    /// Of all randomness.
    pub seed: u64,
}

impl Default for FaultyParams {
    /// Nothing happens; 0.1 s.
    fn default() -> Self {
        Self {
            failures: Vec::new(),
            timeout: 0.1,
            seed: 1,
        }
    }
}

impl FaultyParams {
    /// What is wrong at a time [s].
    #[must_use]
    pub fn at(&self, now: f64) -> Option<Trouble> {
        self.failures.iter().find_map(|failure| failure.at(now))
    }

    /// How old an answer can be wanted [s].
    pub(super) fn longest_delay(&self) -> f64 {
        let delays = self.failures.iter().map(|f| match f.trouble {
            Trouble::Delayed { seconds } => seconds,
            _ => 0.0,
        });
        delays.fold(0.0, f64::max)
    }

    /// How much of the time up to `now` a clock that stands or crawls has lost [s].
    pub(super) fn lost_by(&self, now: f64) -> f64 {
        self.failures.iter().map(|f| f.lost_by(now)).sum()
    }
}
