#![doc = include_str!("../README.md")]

mod canny;
mod edge_map;
mod floor_view;
mod gradient;
mod hysteresis;
mod lanes;
mod obstacle;
pub mod reference;
mod region;
mod ridge;
mod rows;
mod thresholds;

pub use canny::{Canny, CannyParams, ModifiedCannyParams, Norm, canny, canny_modified};
pub use edge_map::{EdgeMap, EdgePixel};
pub use floor_view::FloorView;
pub use gradient::Gradient;
pub use obstacle::{FloorState, MovedRegion, ObstacleParams, ObstacleTracker, Track};
pub use region::Region;
