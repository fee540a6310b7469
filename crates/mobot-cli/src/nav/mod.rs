//! The robot at work: behaviours that decide, one filter that keeps it safe, and the loop that alone touches
//! devices.
//!
//! A [`Behaviour`] maps an [`Observation`] to an [`Action`]; it has no devices, no clock and no randomness of
//! its own. [`Runner`] asks the devices, estimates the pose, lets the behaviour decide, has [`Safety`] cut
//! down what was wished, and drives. All that is decided follows from what the devices answered: the same
//! answers give the same commands, bit for bit, so a log can be run again.

mod angle;
mod avoid;
mod correct;
mod drive;
mod echo;
mod estimate;
mod events;
mod follow;
mod localizer;
mod observation;
mod runner;
mod safety;
mod sight;
mod sim_eye;
mod swath;

pub use avoid::{AvoidParams, Surprises, Thing};
pub use correct::{Correction, Cue};
pub use drive::{Drive, DriveParams, Goal};
pub use echo::{WallEcho, wall_echo};
pub use estimate::{Confidence, FilterParams, PoseEstimate, PoseFilter};
pub use events::{Device, Entry, Event, NoLog, Outcome, RunLog, StopCause, Trouble};
pub use follow::{FollowParams, Followed, Follower};
pub use localizer::{Localizer, LocalizerParams};
pub use observation::{Action, Behaviour, Motion, Mover, Observation, Sounding};
pub use runner::{Devices, Runner, RunnerParams};
pub use safety::{Admitted, Halt, Safety, SafetyInput, SafetyParams};
pub use sight::{Sight, observations};
pub use sim_eye::calibrated;
pub use swath::{Swath, SwathMap, swath};
