//! Integration tests: one binary for the crate.
mod floor_plan;

mod camera;
mod homography;
mod pinhole;
