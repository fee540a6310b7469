//! The world in plan: the outlines of its solids.

use occgrid::Point2;

use super::solid::Solid;

#[derive(Debug, Clone, Default)]
pub(crate) struct Outline {}

impl Outline {
    pub(crate) fn of(_solids: &[Solid]) -> Self {
        Self {}
    }
    pub(crate) fn floor_segments(&self) -> Vec<[Point2; 2]> {
        Vec::new()
    }
}
