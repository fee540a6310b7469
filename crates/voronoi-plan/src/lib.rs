#![doc = include_str!("../README.md")]

mod access;
mod bridge;
mod build;
pub mod check;
mod clearance;
mod free_space;
#[cfg(feature = "geojson")]
pub mod geojson;
mod graph;
mod paper;
mod plan;
mod prune;
mod route;
mod skeleton;
mod square;

pub use clearance::{ClearanceField, SegmentClearance, TIE_CELLS};
pub use free_space::FreeSpace;
pub use graph::{Arc, Node, NodeKind, VoronoiGraph};
