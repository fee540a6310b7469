//! Integration tests.

mod grid;
#[cfg(feature = "map-files")]
mod map_files;
