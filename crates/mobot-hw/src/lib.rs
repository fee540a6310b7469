#![doc = include_str!("../README.md")]

mod clock;
#[cfg(feature = "simulation")]
mod dice;
mod motion;
#[cfg_attr(
    not(feature = "simulation"),
    expect(dead_code, reason = "the simulation needs the rest")
)]
mod real;
mod sense;
pub mod serial;
#[cfg(feature = "simulation")]
pub mod sim;
mod traits;
mod turret;

pub use clock::SystemClock;
pub use motion::{Odometry, Twist2, WheelTravel};
pub use sense::{BaseStatus, Bearings, CameraFrame, Ping};
pub use traits::{
    Camera, Clock, DeviceError, DifferentialDrive, FaultKind, PanActuator, RangeFinder,
};
pub use turret::{Turret, TurretError};
