#![doc = include_str!("../README.md")]

mod canny;
mod edge_map;
mod gradient;
pub mod reference;

pub use canny::{Canny, CannyParams, Norm, canny};
pub use edge_map::{EdgeMap, EdgePixel};
pub use gradient::Gradient;
