//! Wrappers around any device: one that records, one that gives back what was recorded, one that fails
//! on a schedule. (The habit is smoltcp's `phy` wrappers and embedded-hal-mock's scripts.)
//!
//! ```
//! use std::sync::{Arc, Mutex};
//! use mobot_hw::wrap::{Call, Recorded, Replay};
//! # #[derive(Clone)] struct Beeper;
//! # impl mobot_hw::RangeFinder for Beeper {
//! #     type Error = std::convert::Infallible;
//! #     fn bearings(&self) -> mobot_hw::Bearings { mobot_hw::Bearings::fixed(0.0) }
//! #     fn ping(&mut self, bearing: f64) -> Result<mobot_hw::Ping, Self::Error> {
//! #         let reading = occgrid::Reading::Echo { range: 1.5 };
//! #         Ok(mobot_hw::Ping { stamp: 0.0, bearing, settled: true, reading })
//! #     }
//! # }
//! # let sonar = Beeper;
//! use mobot_hw::RangeFinder;
//!
//! let calls: Arc<Mutex<Vec<Call>>> = Arc::default();
//! let first = Recorded::new(sonar, calls.clone()).ping(0.0)?;
//!
//! let calls = calls.lock().expect("no panic").clone();
//! let mut replay = Replay::of(calls);
//! assert_eq!(replay.ping(0.0)?, first);
//! assert!(replay.ping(0.0).is_err()); // the recording ends here
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod call;
mod faulty;
mod record;
mod replay;
mod trouble;

pub use call::{Answer, Asked, Call, Device, Fault};
pub use faulty::{Faulty, FaultyError};
pub use record::{Recorded, Sink};
pub use replay::{Replay, ReplayError};
pub use trouble::{Failure, FaultyParams, Trouble};
