//! What can be written and read again.

use linefeat::{
    CannyParams, DetectorParams, DoorCorner, DoorEdge, EdgePixel, FloorEdge, FloorFeatures,
    FloorParams, FloorState, FloorView, HoughParams, Line, ModifiedCannyParams, MovedRegion,
    ObstacleParams, Region, Segment, SegmentParams, Track,
};
use serde::{Serialize, de::DeserializeOwned};

fn plain<T: Serialize + DeserializeOwned>() {}

/// Holds if it compiles.
#[test]
fn all_plain_data_is() {
    plain::<(
        CannyParams,
        ModifiedCannyParams,
        SegmentParams,
        DetectorParams,
    )>();
    plain::<(HoughParams, FloorParams, ObstacleParams, FloorView, Region)>();
    plain::<(EdgePixel, Line, Segment)>();
    plain::<(FloorEdge, DoorEdge, DoorCorner, FloorFeatures)>();
    plain::<(FloorState, MovedRegion, Track)>();
}
