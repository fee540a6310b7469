//! Integration tests.

mod cell_size;
mod explain;
mod grid;
#[cfg(feature = "map-files")]
mod hostile_maps;
#[cfg(all(feature = "map-files", feature = "image"))]
mod map_files;
mod real_sonar;
mod refine;
#[cfg(feature = "map-files")]
mod save_faults;
mod sonar;
mod sonar_peers;
mod sonar_score;
mod sonar_world;
