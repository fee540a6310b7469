#![cfg_attr(feature = "simulation", doc = include_str!("../README.md"))]
#![cfg_attr(
    not(feature = "simulation"),
    doc = "Sonar, camera and base behind small traits. The README's example needs the feature `simulation`."
)]
#![cfg_attr(not(feature = "v4l2"), forbid(unsafe_code))]

#[cfg(feature = "mjpeg")]
mod camera_fault;
mod clock;
#[cfg_attr(
    not(feature = "simulation"),
    expect(dead_code, reason = "the simulation needs the rest")
)]
mod dice;
#[cfg(all(feature = "emulation", unix))]
pub mod emulate;
#[cfg(all(feature = "serial", unix))]
pub mod guard;
mod motion;
mod picture_watch;
#[cfg_attr(
    not(feature = "simulation"),
    expect(dead_code, reason = "the simulation needs the rest")
)]
mod real;
mod sense;
pub mod serial;
#[cfg(feature = "simulation")]
pub mod sim;
#[cfg(feature = "mjpeg")]
pub mod stream;
mod traits;
mod turret;
#[cfg(all(feature = "v4l2", target_os = "linux"))]
pub mod v4l2;
pub mod wrap;

#[cfg(feature = "mjpeg")]
pub use camera_fault::{CameraError, FrameCounts, FrameFault};
pub use clock::SystemClock;
pub use motion::{Odometry, Twist2, WheelTravel};
pub use picture_watch::{PictureFault, PictureWatch};
pub use sense::{BaseStatus, Bearings, CameraFrame, Ping};
pub use traits::{
    Camera, Clock, DeviceError, DifferentialDrive, FaultKind, PanActuator, RangeFinder,
};
pub use turret::{Turret, TurretError};
