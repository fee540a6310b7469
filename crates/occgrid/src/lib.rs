#![doc = include_str!("../README.md")]

mod add;
mod evidence;
mod explain;
mod footprint;
mod frame;
mod gray;
mod grid;
mod log;
#[cfg(feature = "map-files")]
mod map_file_error;
#[cfg(feature = "map-files")]
mod map_image;
#[cfg(all(feature = "map-files", feature = "image"))]
mod map_png;
#[cfg(feature = "map-files")]
mod map_server;
#[cfg(feature = "map-files")]
mod map_values;
#[cfg(feature = "map-files")]
mod map_yaml;
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

pub use explain::{Contribution, Relation, explain};
pub use frame::{Cell, FrameError, GridPoint, MAX_SIDE_CELLS, MapFrame, Point2, Pose2};
pub use gray::{FREE_AT_MOST, OCCUPIED_AT_LEAST, gray_level};
pub use grid::{GridError, GridLimits, LOG_ODDS_LIMIT, OccupancyGrid};
pub use log::{LOG_HEADER, LogError, LogLimits, read_log, read_log_within, write_log};
#[cfg(feature = "map-files")]
pub use map_file_error::MapFileError;
#[cfg(feature = "map-files")]
pub use map_server::{LoadOptions, LoadedMap, load_map};
#[cfg(feature = "map-files")]
pub use map_values::{MapMode, ThresholdRule};
pub use occupancy_map::{CellState, OccupancyMap};
#[cfg(feature = "map-files")]
pub use pgm::{PgmEncoding, PgmError, PgmImage, PgmLimits, read_pgm};
pub use reading::{Reading, ReadingCounts, Shot};
pub use refine::{RefineError, RefineParams, Refinement, refine};
#[cfg(feature = "map-files")]
pub use save::{SaveOptions, SavedMap, save_map};
pub use sonar::{Profile, SonarModel, SonarModelError};
