//! Integration tests: one binary for the crate.

#[cfg(feature = "simulation")]
mod base;
#[cfg(feature = "simulation")]
mod camera;
#[cfg(feature = "simulation")]
mod determinism;
#[cfg(all(feature = "emulation", feature = "serial", unix))]
mod emulated;
#[cfg(feature = "simulation")]
mod files;
#[cfg(all(feature = "v4l2", target_os = "linux"))]
mod guest;
#[cfg(feature = "mjpeg")]
mod mjpeg;
mod motion;
mod picture_watch;
mod serial;
#[cfg(feature = "simulation")]
mod sonar;
mod traits;
#[cfg(feature = "simulation")]
mod world;
#[cfg(feature = "simulation")]
mod wrap;
