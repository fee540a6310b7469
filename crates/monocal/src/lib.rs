#![doc = include_str!("../README.md")]

mod floor_plan;

pub use floor_plan::{DeriveParams, FloorPlan};
#[cfg(feature = "files")]
pub use floor_plan::{FloorPlanError, PlanLimits};
mod camera;
mod chart;
mod homography;
mod lens;
pub mod paper;
mod point;

pub use camera::{DEGREES_OF_FREEDOM, FloorCamera, FloorEstimate};
pub use homography::{FloorHomography, HomographyError, Resolution};
pub use lens::{Distortion, Lens};
pub use point::{GroundPoint, PixelPoint};
