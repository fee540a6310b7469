//! What the world is made of: upright prisms with a convex footprint, painted.

use occgrid::Point2;

use super::building::Texture;
use crate::real::{Placed, distance};

/// The outline of a solid on the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Footprint {
    /// A rectangle around `map_from_block`'s origin, `half` long and wide along its axes.
    Block { placed: Placed, half: [f64; 2] },
    /// A circle.
    Disc { center: Point2, radius: f64 },
}

impl Footprint {
    pub(crate) fn contains(&self, point: Point2) -> bool {
        match self {
            Self::Block { placed, half } => {
                let p = placed.inward(point);
                p.x.abs() < half[0] && p.y.abs() < half[1]
            }
            Self::Disc { center, radius } => distance(*center, point) < *radius,
        }
    }

    /// The corners; of a disc, of the square around it.
    pub(crate) fn corners(&self) -> [Point2; 4] {
        const SIGNS: [[f64; 2]; 4] = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        SIGNS.map(|[sx, sy]| match self {
            Self::Block { placed, half } => placed.outward(Point2::new(sx * half[0], sy * half[1])),
            Self::Disc { center, radius } => {
                Point2::new(center.x + sx * radius, center.y + sy * radius)
            }
        })
    }
}

/// The faces of a solid. Sides 0..=3 of a block: ends +x and -x, long sides +y and -y; a disc has side 0.
pub(crate) const TOP: u8 = 4;
pub(crate) const BOTTOM: u8 = 5;
pub(crate) const ALL_SIDES: u8 = 0b1111;

/// A rectangle of another brightness on some sides of a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Band {
    /// Bit set of the sides.
    pub(crate) sides: u8,
    /// Along the side, in the solid's own coordinate plus `Finish::along`.
    pub(crate) along: [f64; 2],
    /// Above the floor.
    pub(crate) up: [f64; 2],
    pub(crate) brightness: f64,
}

/// How a solid is painted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Finish {
    pub(crate) brightness: f64,
    pub(crate) texture: Texture,
    /// Added to the coordinate along the long sides, so that a wall in pieces has one texture.
    pub(crate) along: f64,
    /// Later ones lie on top.
    pub(crate) bands: Vec<Band>,
}

impl Finish {
    pub(crate) fn plain(brightness: f64, texture: Texture) -> Self {
        Self {
            brightness,
            texture,
            along: 0.0,
            bands: Vec::new(),
        }
    }
}

/// An upright prism.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solid {
    pub(crate) footprint: Footprint,
    pub(crate) bottom: f64,
    pub(crate) top: f64,
    pub(crate) finish: Finish,
    /// Only its left side (+y) is free: the outline of something without a known inside.
    pub(crate) backed: bool,
}
