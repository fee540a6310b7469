//! A run on disk: an MCAP file of ROS 2 messages that Foxglove and rosbags open, and beside them every call
//! of a device and every decision to the bit, so that the run can be run again.
//!
//! ```
//! use mobot_cli::run_log::{Level, LogParams, LogReader, LogWriter, Message};
//! use occgrid::Pose2;
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("run.mcap");
//! let log = LogWriter::create(&path, LogParams::default())?;
//! for step in 0..3 {
//!     let now = 0.05 * f64::from(step);
//!     log.tick(now); // once a control step
//!     log.pose(now, Pose2::new(now, 0.0, 0.1), &[[1e-4; 3]; 3]);
//! }
//! log.event(0.1, Level::Warn, "stop", "obstacle 0.3 m ahead");
//! log.finish()?;
//!
//! let mut poses = 0;
//! for entry in LogReader::open(&path)? {
//!     if let Message::Pose(pose) = entry?.message {
//!         assert!((pose.pose.pose.flat().theta - 0.1).abs() < 1e-12);
//!         poses += 1;
//!     }
//! }
//! assert_eq!(poses, 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | topic | type | when |
//! |---|---|---|
//! | `/pose` | geometry_msgs/PoseWithCovarianceStamped | every control step, wall time |
//! | `/odom` | nav_msgs/Odometry | every word of the base |
//! | `/sonar` | sensor_msgs/Range | every shot |
//! | `/camera/image_raw/compressed` | sensor_msgs/CompressedImage | every frame, PNG |
//! | `/map` | nav_msgs/OccupancyGrid | now and then |
//! | `/plan` | nav_msgs/Path | every new route |
//! | `/tf` | tf2_msgs/TFMessage | `map` to `base_link`, `base_link` to `sonar_link` |
//! | `/rosout` | rcl_interfaces/Log | every event and its cause |
//! | `/mobot/calls` | mobot_msgs/Call | every call of a device |
//! | `/mobot/decisions` | mobot_msgs/Decision | every decision |
//! | `/mobot/inputs` | mobot_msgs/Input | at the start |
//!
//! Records wait in memory for 0.2 s of the run at most, then go out in one piece. A program that is killed
//! leaves a file that is readable up to there.

mod call;
pub mod cdr;
mod decision;
mod journal;
pub mod mcap;
mod mission;
mod read;
mod recipe;
pub mod ros;
mod stamps;
mod tape;
mod write;

pub use call::CallRecord;
pub use decision::{Decision, DecisionCheck, Difference, Input, Verdict};
pub use mission::{Again, Logged, MissionLog};
pub use read::{Entry, LogError, LogReader, Message};
pub use recipe::{Recipe, RecipeError, RecipeOption};
pub use stamps::Stamps;
pub use tape::{Recordings, calls, replay, replay_all};
pub use write::{Level, LogParams, LogWriter, SonarFrame};
