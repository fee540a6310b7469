#![doc = include_str!("../README.md")]

mod access;
mod answer;
mod bottleneck;
mod bridge;
mod build;
mod certify;
pub mod check;
mod clearance;
mod draft;
mod free_space;
#[cfg(feature = "geojson")]
pub mod geojson;
mod graph;
mod landmarks;
mod lattice;
mod nearest;
mod pack;
mod paper;
mod plan;
mod prune;
mod roadmap;
mod route;
mod samples;
mod seam;
mod skeleton;
mod square;
mod straight;
mod window;

pub use answer::{Bottleneck, GraphRoute, Plan, PlanStatus};
pub use build::{BuildError, GraphParams};
pub use clearance::{ClearanceField, SegmentClearance, TIE_CELLS};
pub use free_space::FreeSpace;
pub use graph::{Arc, Node, NodeKind, VoronoiGraph};
pub use lattice::Lattice;
pub use paper::PaperGraph;
pub use plan::{PlanParams, Planner};
pub use prune::Prune;
pub use route::Route;
