//! A building made ready for simulated devices: solids, light, doors, people.

use occgrid::{OccupancyMap, Point2, Pose2};
use thiserror::Error;

use super::building::{Building, Floor, Walker};
use super::light::Light;
use super::map_walls;
use super::outline::Outline;
use super::person;
use super::raise;
use super::solid::Solid;
use crate::real::{Placed, distance};

/// Most solids that a world may have.
pub const MAX_SOLIDS: usize = 1_000_000;

/// Why a world was refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WorldError {
    /// The text is no world file.
    #[error("no world file: {message}")]
    Toml {
        /// With the place in the text.
        message: String,
    },
    /// A value makes no sense.
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        /// Which one, as `walls[3].doors[0].width`.
        what: String,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        found: f64,
    },
    /// More solids than [`MAX_SOLIDS`].
    #[error("a world has at most {MAX_SOLIDS} solids, found {found}")]
    Size {
        /// Walls, pieces of walls, leaves and furniture.
        found: usize,
    },
}

/// Which vertical edge of a doorway a corner belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CornerKind {
    /// The edge of the opening: the jamb's arris.
    Opening,
    /// The outer edge of the frame on the wall.
    Frame,
}

/// A place where a vertical edge of a doorway meets the floor at the foot of the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DoorCorner {
    /// Map frame [m].
    pub position: Point2,
    /// Which edge.
    pub kind: CornerKind,
    /// The doorway's number, in the order of the building.
    pub door: usize,
    /// The wall face it lies on: its outward normal, unit length, map frame.
    pub facing: Point2,
}

/// Where a walker is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Person {
    /// Map frame [m].
    pub position: Point2,
    /// Map frame [m/s].
    pub velocity: Point2,
    /// Of the body [m].
    pub radius: f64,
}

/// A simulated building.
#[derive(Debug, Clone)]
pub struct World {
    pub(crate) name: String,
    pub(crate) start: Pose2,
    pub(crate) ceiling: f64,
    pub(crate) floor: Floor,
    pub(crate) light: Light,
    pub(crate) solids: Vec<Solid>,
    pub(crate) outline: Outline,
    pub(crate) walkers: Vec<Walker>,
    corners: Vec<DoorCorner>,
}

impl World {
    /// A world from the text of a world file, the TOML form of [`Building`].
    ///
    /// # Errors
    /// [`WorldError`] with the place that is wrong.
    pub fn from_toml(text: &str) -> Result<Self, WorldError> {
        Self::new(&Building::from_toml(text)?)
    }

    /// A world from a building.
    ///
    /// # Errors
    /// [`WorldError`] with the value that makes no sense.
    pub fn new(building: &Building) -> Result<Self, WorldError> {
        let raised = raise::raise(building)?;
        Self::assembled(building, raised.solids, raised.corners)
    }

    /// A world whose walls stand where a map is occupied, up to the ceiling; unknown cells are empty.
    /// Start, floor, light and people are the building's, its walls and furniture are added.
    ///
    /// # Errors
    /// [`WorldError`] where the building makes no sense or the map's outline is too long.
    pub fn from_map(map: &OccupancyMap, building: &Building) -> Result<Self, WorldError> {
        let mut raised = raise::raise(building)?;
        map_walls::add(map, building.ceiling, &mut raised.solids);
        Self::assembled(building, raised.solids, raised.corners)
    }

    fn assembled(
        building: &Building,
        solids: Vec<Solid>,
        corners: Vec<DoorCorner>,
    ) -> Result<Self, WorldError> {
        if solids.len() > MAX_SOLIDS {
            return Err(WorldError::Size {
                found: solids.len(),
            });
        }
        let [x, y, theta] = building.start;
        Ok(Self {
            name: building.name.clone(),
            start: Pose2::new(x, y, theta),
            ceiling: building.ceiling,
            floor: building.floor.clone(),
            light: Light::new(building.ambient, &building.lamps),
            outline: Outline::of(&solids),
            solids,
            walkers: building.people.clone(),
            corners,
        })
    }

    /// The building's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where the robot starts.
    #[must_use]
    pub const fn start(&self) -> Pose2 {
        self.start
    }

    /// Every corner of every doorway on the floor: four of the opening, four of the frame where there
    /// is one.
    #[must_use]
    pub fn door_corners(&self) -> &[DoorCorner] {
        &self.corners
    }

    /// Where the walkers are at a time [s].
    #[must_use]
    pub fn people(&self, time: f64) -> Vec<Person> {
        self.walkers
            .iter()
            .map(|w| person::whereabouts(w, time))
            .collect()
    }

    /// Way from a pose along its heading to the first outline that stands at this height [m], people
    /// apart; `None` past `far`.
    #[must_use]
    pub fn range_along(&self, from: Pose2, far: f64, height: f64) -> Option<f64> {
        let direction = Placed::at(from).turned(Point2::new(1.0, 0.0));
        let strike = self.outline.cast(from.position(), direction, far, height)?;
        Some(strike.range)
    }

    /// Room around a place [m], up to `reach`, for a body of this height; 0 inside something.
    #[must_use]
    pub fn room_at(&self, place: Point2, reach: f64, height: f64) -> f64 {
        let inside = self
            .solids
            .iter()
            .any(|s| s.bottom < height && s.footprint.contains(place));
        if inside {
            return 0.0;
        }
        let nearest = self.outline.nearest(place, reach, height);
        nearest.map_or(reach, |p| distance(p, place))
    }

    /// The outline of everything that stands on the floor, people apart: line segments, free space on
    /// their left (round things as polygons of 24 sides). Map frame [m].
    #[must_use]
    pub fn floor_outline(&self) -> Vec<[Point2; 2]> {
        self.outline.floor_segments()
    }
}
