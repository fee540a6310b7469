//! Integration tests: one binary for the crate.

#[cfg(feature = "simulation")]
mod base;
#[cfg(feature = "simulation")]
mod camera;
#[cfg(feature = "simulation")]
mod determinism;
#[cfg(feature = "simulation")]
mod files;
mod motion;
#[cfg(feature = "simulation")]
mod sonar;
mod traits;
#[cfg(feature = "simulation")]
mod world;
