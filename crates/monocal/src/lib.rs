#![doc = include_str!("../README.md")]

mod floor_plan;

pub use floor_plan::{DeriveParams, FloorPlan};
#[cfg(feature = "files")]
pub use floor_plan::{FloorPlanError, PlanLimits};
