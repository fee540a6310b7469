//! Recorded devices: the same answers to the same questions, in the same order.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use thiserror::Error;

use super::call::{Answer, Asked, Call, Device, Fault};
use crate::{
    BaseStatus, Bearings, Camera, CameraFrame, Clock, DeviceError, DifferentialDrive, FaultKind,
    PanActuator, Ping, RangeFinder, Twist2,
};

/// Why a replay gave no answer.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The device failed when it was recorded.
    #[error(transparent)]
    Recorded(Fault),
    /// The program asked for more than was recorded.
    #[error("the recording ends after {calls} calls; asked: {asked}")]
    End {
        /// How many calls there were.
        calls: u64,
        /// What the program asked next.
        asked: Asked,
    },
    /// The program asked for something else than when it was recorded: it decided otherwise.
    #[error("call {index} of the recording: expected {expected}, found {found}")]
    Different {
        /// Which call, counted from 0.
        index: u64,
        /// What was asked when it was recorded.
        expected: Asked,
        /// What the program asked now.
        found: Asked,
    },
    /// The recording cannot be read.
    #[error("call {index} of the recording: {message}")]
    Unreadable {
        /// Which call, counted from 0.
        index: u64,
        /// Why.
        message: String,
    },
}

impl DeviceError for ReplayError {
    fn kind(&self) -> FaultKind {
        match self {
            Self::Recorded(fault) => fault.kind,
            Self::End { .. } => FaultKind::Unplugged,
            Self::Different { .. } => FaultKind::Refused,
            Self::Unreadable { .. } => FaultKind::System,
        }
    }
}

/// Calls as they come from a recording, or why the next one cannot be read.
type Source = Box<dyn Iterator<Item = Result<Call, String>> + Send>;

struct Tape {
    source: Source,
    /// How many calls were answered.
    played: u64,
    /// Why it cannot go on.
    ended: Option<ReplayError>,
    now: f64,
}

impl Tape {
    fn answer(&mut self, asked: Asked) -> Result<Answer, ReplayError> {
        if let Some(why) = &self.ended {
            return Err(why.clone());
        }
        let index = self.played;
        let ended = match self.source.next() {
            None => ReplayError::End {
                calls: index,
                asked,
            },
            Some(Err(message)) => ReplayError::Unreadable { index, message },
            Some(Ok(call)) if call.asked.is_same(&asked) => {
                self.played += 1;
                return match call.answer {
                    Answer::Fault(fault) => Err(ReplayError::Recorded(fault)),
                    answer => Ok(answer),
                };
            }
            Some(Ok(call)) => ReplayError::Different {
                index,
                expected: call.asked,
                found: asked,
            },
        };
        self.ended = Some(ended.clone());
        Err(ended)
    }
}

/// Time that passes at every look at the clock of a recording that has ended [s]: a program that waits
/// for a time gets there.
const AFTERLIFE: f64 = 1e-3;

/// Every device of a recording. Clones share the recording: questions of all of them must come in the
/// order in which they were recorded; [`Replay::only`] keeps the calls of one device. A program that
/// asks for something else, or for more, gets one error, from then on always the same.
#[derive(Clone)]
pub struct Replay {
    tape: Arc<Mutex<Tape>>,
}

impl fmt::Debug for Replay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tape = self.tape();
        f.debug_struct("Replay")
            .field("played", &tape.played)
            .field("ended", &tape.ended)
            .finish_non_exhaustive()
    }
}

impl Replay {
    /// Of calls that are read while they are needed.
    #[must_use]
    pub fn new<I, E>(calls: I) -> Self
    where
        I: IntoIterator<Item = Result<Call, E>, IntoIter: Send + 'static>,
        E: fmt::Display,
    {
        let calls = calls.into_iter();
        Self {
            tape: Arc::new(Mutex::new(Tape {
                source: Box::new(calls.map(|call| call.map_err(|e| e.to_string()))),
                played: 0,
                ended: None,
                now: 0.0,
            })),
        }
    }

    /// Of calls at hand.
    #[must_use]
    pub fn of(calls: Vec<Call>) -> Self {
        Self::new(calls.into_iter().map(Ok::<_, std::convert::Infallible>))
    }

    /// Of the calls of one device alone; those of others are passed over.
    #[must_use]
    pub fn only<I, E>(device: Device, calls: I) -> Self
    where
        I: IntoIterator<Item = Result<Call, E>, IntoIter: Send + 'static>,
        E: fmt::Display + 'static,
    {
        let of_it = move |call: &Result<Call, E>| {
            call.as_ref()
                .map_or(true, |call| call.asked.device() == device)
        };
        Self::new(calls.into_iter().filter(of_it))
    }

    /// How many calls were answered as recorded.
    #[must_use]
    pub fn played(&self) -> u64 {
        self.tape().played
    }

    /// Why it cannot go on: the end of the recording, or the first question that was another.
    #[must_use]
    pub fn ended(&self) -> Option<ReplayError> {
        self.tape().ended.clone()
    }

    fn tape(&self) -> MutexGuard<'_, Tape> {
        self.tape.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The recorded answer, as what the question calls for.
    fn ask<T>(
        &self,
        asked: Asked,
        expected: impl FnOnce(Answer) -> Option<T>,
    ) -> Result<T, ReplayError> {
        let mut tape = self.tape();
        let answer = tape.answer(asked)?;
        expected(answer).ok_or_else(|| {
            let unreadable = ReplayError::Unreadable {
                index: tape.played - 1,
                message: format!("the answer to {asked} is of another kind"),
            };
            tape.ended = Some(unreadable.clone());
            unreadable
        })
    }
}

/// Turns an answer into what a variant holds.
macro_rules! held_by {
    ($variant:ident) => {
        |answer| match answer {
            Answer::$variant(held) => Some(held),
            _ => None,
        }
    };
}

fn done(answer: Answer) -> Option<()> {
    matches!(answer, Answer::Done).then_some(())
}

impl RangeFinder for Replay {
    type Error = ReplayError;

    /// Straight ahead alone once the recording has ended.
    fn bearings(&self) -> Bearings {
        self.ask(Asked::RangeBearings, held_by!(Bearings))
            .unwrap_or(Bearings::fixed(0.0))
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, ReplayError> {
        self.ask(Asked::Ping { bearing }, held_by!(Ping))
    }
}

impl PanActuator for Replay {
    type Error = ReplayError;

    /// Straight ahead alone once the recording has ended.
    fn bearings(&self) -> Bearings {
        self.ask(Asked::PanBearings, held_by!(Bearings))
            .unwrap_or(Bearings::fixed(0.0))
    }

    fn turn_to(&mut self, bearing: f64) -> Result<f64, ReplayError> {
        self.ask(Asked::TurnTo { bearing }, held_by!(Stands))
    }
}

impl Camera for Replay {
    type Error = ReplayError;

    fn frame(&mut self) -> Result<CameraFrame, ReplayError> {
        self.ask(Asked::Frame, held_by!(Frame))
    }
}

impl DifferentialDrive for Replay {
    type Error = ReplayError;

    /// 1 m once the recording has ended.
    fn track(&self) -> f64 {
        self.ask(Asked::Track, held_by!(Track)).unwrap_or(1.0)
    }

    fn drive(&mut self, command: Twist2) -> Result<(), ReplayError> {
        self.ask(Asked::Drive(command), done)
    }

    fn stop(&mut self) -> Result<(), ReplayError> {
        self.ask(Asked::Stop, done)
    }

    fn status(&mut self) -> Result<BaseStatus, ReplayError> {
        self.ask(Asked::Status, held_by!(Status))
    }
}

impl Clock for Replay {
    /// Goes on by a millisecond a call once the recording has ended.
    fn now(&self) -> f64 {
        let recorded = self.ask(Asked::Now, held_by!(Now));
        let mut tape = self.tape();
        tape.now = recorded.unwrap_or(tape.now + AFTERLIFE);
        tape.now
    }

    fn sleep(&mut self, seconds: f64) {
        if self.ask(Asked::Sleep { seconds }, done).is_err() && seconds > 0.0 {
            self.tape().now += seconds;
        }
    }
}
