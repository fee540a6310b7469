//! Integration tests: one binary for the crate.

mod camera;
mod homography;
mod pinhole;
