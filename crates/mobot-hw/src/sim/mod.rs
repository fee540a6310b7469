//! A simulated building, and a robot in it.

mod buckets;
mod building;
mod camera;
mod fan;
mod landmarks;
mod lens;
mod light;
mod map_walls;
mod outline;
mod person;
mod raise;
mod real;
mod sensor;
mod shade;
mod solid;
mod texture;
mod world;

pub use building::{
    Block, Building, Cylinder, Door, Floor, Hinge, Lamp, Patch, Poster, Side, Texture, Walker, Wall,
};
pub use camera::{Look, Renderer};
pub use landmarks::{FloorEdge, VisibleCorner};
pub use lens::{CameraModel, CameraModelError, Distortion};
pub use world::{CornerKind, DoorCorner, MAX_SOLIDS, Person, World, WorldError};
