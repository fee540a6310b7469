#![doc = include_str!("../README.md")]

mod accumulator;
mod canny;
mod direction;
mod edge_map;
mod floor;
mod follow;
mod gradient;
mod hough;
mod hysteresis;
mod lanes;
mod peaks;
mod profile;
pub mod reference;
mod ridge;
mod segment;
mod vote_blocks;

pub use accumulator::Accumulator;
pub use canny::{Canny, CannyParams, Norm, canny};
pub use edge_map::{EdgeMap, EdgePixel};
pub use floor::{
    DoorCorner, DoorEdge, FloorEdge, FloorFeatures, FloorParams, FloorView, floor_features,
    floor_features_into,
};
pub use gradient::Gradient;
pub use hough::{Hough, HoughError, HoughParams, Line, Voting, hough};
pub use segment::{Segment, SegmentParams, Segments, segments};
