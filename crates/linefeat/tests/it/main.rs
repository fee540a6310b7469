//! Integration tests: one binary for the crate.
mod canny;
mod obstacle;
mod pictures;
