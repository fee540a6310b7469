//! The robot at work: behaviours that decide, one filter that keeps it safe, and the loop that alone touches
//! devices.
//!
//! A [`Behaviour`] maps an [`Observation`] to an [`Action`]; it has no devices, no clock and no randomness of
//! its own. [`Runner`] asks the devices, estimates the pose, lets the behaviour decide, has [`Safety`] cut
//! down what was wished, and drives. All that is decided follows from what the devices answered: the same
//! answers give the same commands, bit for bit, so a log can be run again.

mod angle;
mod estimate;
mod events;
mod observation;
mod runner;
mod safety;
mod swath;

pub use estimate::{Confidence, FilterParams, PoseEstimate, PoseFilter};
pub use events::{Device, Entry, Event, NoLog, Outcome, RunLog, StopCause, Trouble};
pub use observation::{Action, Behaviour, Motion, Mover, Observation, Sounding};
pub use runner::{Devices, Runner, RunnerParams};
pub use safety::{Admitted, Halt, Safety, SafetyInput, SafetyParams};
pub use swath::{Swath, SwathMap, swath};
