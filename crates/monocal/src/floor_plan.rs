//! Floor plans: the walls and door corners that a camera can see on the floor, in the map frame.
//!
//! A plan is drawn by hand (GeoJSON), or derived from an occupancy map.

mod derive;
mod doors;
#[cfg(feature = "files")]
mod geojson;
mod outline;
mod passage;
mod wall_fit;

use occgrid::Point2;

pub use derive::DeriveParams;
pub use doors::Doorway;
#[cfg(feature = "files")]
pub use geojson::{FloorPlanError, PlanLimits};

/// What stands on the floor, in the map frame [m].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FloorPlan {
    /// Where walls meet the floor: straight lines from end to end. A thick wall has one a face.
    pub walls: Vec<[Point2; 2]>,
    /// Where the vertical edges of doors meet the floor.
    pub door_corners: Vec<Point2>,
}

impl FloorPlan {
    /// Whether there is nothing to see.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.walls.is_empty() && self.door_corners.is_empty()
    }
}
