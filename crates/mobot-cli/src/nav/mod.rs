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
mod explore;
mod eye;
mod follow;
mod frontier;
mod hop;
mod itinerary;
mod localizer;
mod observation;
mod reach;
mod robot;
mod runner;
mod safety;
mod seen;
mod sight;
mod sim_eye;
mod survey;
mod swath;
mod sweep;
mod sweep_match;
mod wall_follow;

pub(crate) use angle::wrap;
pub use avoid::{AvoidParams, Surprises, Thing};
pub use correct::{Correction, Cue};
pub use drive::{Drive, DriveParams, Goal};
pub use echo::{WallEcho, wall_echo};
pub use estimate::{Confidence, FilterParams, PoseEstimate, PoseFilter};
pub use events::{Device, Entry, Event, NoLog, Outcome, RunLog, StopCause, Trouble};
pub use explore::{Explore, ExploreParams, Tally};
pub use eye::{Eye, Thresholds};
pub use follow::{FollowParams, Followed, Follower};
pub use frontier::{Frontier, FrontierParams, frontiers};
pub use hop::{Hop, HopParams, HopStep};
pub use itinerary::{Itinerary, ItineraryParams, Leg, Reason};
pub use localizer::{Localizer, LocalizerParams};
pub use observation::{Action, Behaviour, Motion, Mover, Observation, Sounding};
pub use reach::{Reach, ReachParams};
pub use robot::{Devices, RunnerParams};
pub use runner::Runner;
pub use safety::{Admitted, Halt, Safety, SafetyInput, SafetyParams};
pub use seen::{Seen, SeenParams};
pub use sight::Sight;
pub use sim_eye::calibrated;
pub use survey::{Survey, SurveyParams};
pub use swath::{Swath, SwathMap, swath};
pub use sweep_match::{SweepFix, SweepMatcher, SweepParams, SweepStatus};
pub use wall_follow::{Along, Hand, WallFollowParams, along_the_wall};
