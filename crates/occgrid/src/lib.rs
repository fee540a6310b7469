#![doc = include_str!("../README.md")]

mod explain;
mod frame;
mod gray;
mod grid;
mod log;
#[cfg(feature = "map-files")]
mod map_server;
#[cfg(feature = "map-files")]
mod npy;
mod occupancy_map;
#[cfg(feature = "map-files")]
mod pgm;
mod reading;
pub mod reference;
mod refine;
#[cfg(feature = "map-files")]
mod save;
mod sonar;

pub use frame::{Cell, FrameError, GridPoint, MapFrame, Point2, Pose2};
pub use occupancy_map::{CellState, OccupancyMap};
