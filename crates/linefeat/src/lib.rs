#![doc = include_str!("../README.md")]

mod accumulator;
mod bits;
mod canny;
mod detector;
mod direction;
mod edge_map;
mod floor;
mod floor_view;
mod follow;
mod gradient;
mod hough;
mod hysteresis;
mod lanes;
mod obstacle;
mod peaks;
mod profile;
pub mod reference;
mod region;
mod ridge;
mod rows;
mod segment;
mod thresholds;
mod vote_blocks;

pub use accumulator::Accumulator;
pub use canny::{Canny, CannyParams, ModifiedCannyParams, Norm, canny, canny_modified};
pub use detector::{Detector, DetectorParams};
pub use edge_map::{EdgeMap, EdgePixel};
pub use floor::{
    DoorCorner, DoorEdge, FloorEdge, FloorFeatures, FloorParams, floor_features,
    floor_features_into,
};
pub use floor_view::FloorView;
pub use gradient::Gradient;
pub use hough::{Hough, HoughError, HoughParams, Line, Voting, hough};
pub use obstacle::{FloorState, MovedRegion, ObstacleParams, ObstacleTracker, Track};
pub use region::Region;
pub use segment::{Segment, SegmentParams, Segments, segments};
