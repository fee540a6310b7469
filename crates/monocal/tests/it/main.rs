//! Integration tests: one binary for the crate.

mod birdseye;
mod calibrate;
mod camera;
mod corridor;
mod csv;
mod degenerate;
mod drift;
#[cfg(feature = "files")]
mod files;
mod floor_plan;
mod geometry;
mod golden_homography;
mod homography;
mod lens;
mod localize;
mod outliers;
mod pinhole;
mod pixel_size;
#[cfg(feature = "files")]
mod real_pairs;
mod rectify;
mod rendered;
