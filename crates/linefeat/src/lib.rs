#![doc = include_str!("../README.md")]

mod canny;
mod edge_map;
mod floor_view;
mod gradient;
mod hysteresis;
mod obstacle;
mod pack;
pub mod reference;
mod ridge;

pub use canny::{Canny, CannyParams, Norm, canny};
pub use edge_map::{EdgeMap, EdgePixel};
pub use floor_view::FloorView;
pub use gradient::Gradient;
pub use obstacle::{FloorState, MovedRegion, ObstacleParams, ObstacleTracker, Track};
