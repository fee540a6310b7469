#![doc = include_str!("../README.md")]

mod bits;
mod canny;
mod edge_map;
mod gradient;
mod hysteresis;
mod lanes;
pub mod reference;
mod region;
mod ridge;
mod rows;
mod thresholds;

pub use canny::{Canny, CannyParams, ModifiedCannyParams, Norm, canny, canny_modified};
pub use edge_map::{EdgeMap, EdgePixel};
pub use gradient::Gradient;
pub use region::Region;
