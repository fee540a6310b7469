//! A simulated building, and a robot in it.

mod base;
mod bends;
mod buckets;
mod building;
mod camera;
mod check;
mod devices;
mod fan;
mod landmarks;
mod lens;
mod light;
mod map_walls;
mod outline;
mod person;
mod raise;
#[cfg(test)]
mod reference;
mod robot;
mod sensor;
mod shade;
mod solid;
mod sonar;
mod texture;
mod world;

pub use base::BaseParams;
pub use building::{
    Block, Building, Cylinder, Door, Floor, Hinge, Lamp, Patch, Poster, Side, Texture, Walker, Wall,
};
pub use camera::{Look, Renderer};
pub use devices::{SimBase, SimCamera, SimClock, SimFault, SimPan, SimSonar};
pub use landmarks::{FloorEdge, VisibleCorner};
pub use lens::{CameraModel, CameraModelError, Distortion};
pub use robot::{RobotParams, Simulation, SimulationError, Truth};
pub use sonar::{Sonar, SonarParams};
pub use world::{CornerKind, DoorCorner, MAX_SOLIDS, Person, World, WorldError};
