//! What a program decided, as records that can be compared byte for byte with those of another run.

use super::cdr::{ros_message, to_bytes};
use super::ros::topics;

ros_message!(
    /// One decision: what kind of one, when on the run's own clock [s], and all that makes it up.
    Decision = "mobot_msgs/Decision" {
        kind: String,
        time: f64,
        numbers: Vec<f64>,
        text: String,
    }
);

ros_message!(
    /// A file, or other bytes, that a run was given: with them it can be run again.
    Input = "mobot_msgs/Input" {
        name: String,
        data: Vec<u8>,
    }
);

topics!(
    Decision: "mobot_msgs/msg/Decision" on "/mobot/decisions",
    Input: "mobot_msgs/msg/Input" on "/mobot/inputs",
);

impl std::fmt::Display for Decision {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} at {} s", self.kind, self.time)?;
        for number in self.numbers.iter().take(6) {
            write!(f, " {number}")?;
        }
        if self.numbers.len() > 6 {
            write!(f, " .. ({} numbers)", self.numbers.len())?;
        }
        if !self.text.is_empty() {
            write!(f, " {:?}", self.text)?;
        }
        Ok(())
    }
}

/// Two runs part: what the log says, what was decided now.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Which decision, counted from 0.
    pub index: u64,
    /// `None` where the log has ended.
    pub logged: Option<Decision>,
    /// `None` where the run has ended.
    pub made: Option<Decision>,
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let word = |decision: &Option<Decision>| {
            let text = decision.as_ref().map(ToString::to_string);
            text.unwrap_or_else(|| "no more".into())
        };
        write!(
            f,
            "decision {}: expected {}, found {}",
            self.index,
            word(&self.logged),
            word(&self.made)
        )
    }
}

/// What a comparison came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Decisions that were the same, byte for byte.
    pub equal: u64,
    /// The first that was not.
    pub difference: Option<Difference>,
}

/// Compares a run's decisions with those of a log, one after another, as they are made.
#[derive(Debug)]
pub struct DecisionCheck<I> {
    logged: I,
    verdict: Verdict,
}

impl<I: Iterator<Item = Decision>> DecisionCheck<I> {
    /// Against these.
    pub const fn new(logged: I) -> Self {
        Self {
            logged,
            verdict: Verdict {
                equal: 0,
                difference: None,
            },
        }
    }

    /// The run decided this. Only the first difference counts.
    pub fn made(&mut self, decision: Decision) {
        if self.verdict.difference.is_some() {
            return;
        }
        let logged = self.logged.next();
        if logged.as_ref().map(to_bytes) == Some(to_bytes(&decision)) {
            self.verdict.equal += 1;
            return;
        }
        self.verdict.difference = Some(Difference {
            index: self.verdict.equal,
            logged,
            made: Some(decision),
        });
    }

    /// The run made no more; a log that goes on is a difference.
    pub fn finish(mut self) -> Verdict {
        if self.verdict.difference.is_none()
            && let Some(logged) = self.logged.next()
        {
            self.verdict.difference = Some(Difference {
                index: self.verdict.equal,
                logged: Some(logged),
                made: None,
            });
        }
        self.verdict
    }

    /// The run was cut short, as its log was: what the log still holds is no difference.
    pub fn finish_early(self) -> Verdict {
        self.verdict
    }
}
