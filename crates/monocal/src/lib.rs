#![doc = include_str!("../README.md")]

mod birdseye;
mod calibrate;
mod camera;
#[cfg(feature = "files")]
mod camera_file;
#[cfg(feature = "files")]
mod camera_file_error;
#[cfg(feature = "files")]
mod camera_info;
mod chart;
mod drift;
mod floor_plan;
mod geometry;
mod homography;
mod lens;
mod localize;
mod pairs_file;
pub mod paper;
mod point;
mod rectify;

pub use birdseye::{Birdseye, BirdseyeError, BirdseyeParams, MOST_BIRDSEYE_PIXELS, birdseye};
pub use calibrate::{
    CalibrateError, CalibrateParams, CalibrateWarning, Calibration, ErrorSummary, MOST_PAIRS,
    Noise, Pair, PairError, Side, calibrate,
};
pub use camera::{DEGREES_OF_FREEDOM, FloorCamera, FloorEstimate};
#[cfg(feature = "files")]
pub use camera_file_error::CameraFileError;
#[cfg(feature = "files")]
pub use camera_info::CameraInfo;
pub use drift::{Drift, DriftParams, DriftStatus, LineEvidence, LineObservation, check_drift};
pub use floor_plan::{DeriveParams, Doorway, FloorPlan};
#[cfg(feature = "files")]
pub use floor_plan::{FloorPlanError, PlanLimits};
pub use geometry::{CameraGeometry, Undetermined};
pub use homography::{FloorHomography, HomographyError, Resolution};
pub use lens::{CameraMatrix, Distortion, Lens, LensError};
pub use localize::{
    CornerObservation, EdgeObservation, FixStatus, LocateParams, Match, Observations, Observed,
    PoseFix, PositionAxis, Prior, locate,
};
pub use pairs_file::{PAIRS_HEADER, PairsError, read_pairs};
pub use point::{GroundPoint, PixelPoint};
pub use rectify::Rectifier;
