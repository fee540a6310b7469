#![doc = include_str!("../README.md")]

mod canny;
mod edge_map;
mod gradient;
mod hysteresis;
mod lanes;
pub mod reference;
mod ridge;

pub use canny::{Canny, CannyParams, Norm, canny};
pub use edge_map::{EdgeMap, EdgePixel};
pub use gradient::Gradient;
