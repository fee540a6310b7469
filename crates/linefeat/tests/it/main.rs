//! Integration tests: one binary for the crate.
mod canny;
mod hough;
mod pictures;
mod render;
mod segment;
