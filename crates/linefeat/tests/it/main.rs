//! Integration tests: one binary for the crate.
mod accuracy;
mod canny;
mod floor;
mod hough;
mod obstacle;
mod pictures;
mod render;
mod segment;
#[cfg(feature = "serde")]
mod serde;
