//! Which cells a beam touches: those whose centre lies in the cone, and all that its axis crosses.
//!
//! A row's cells follow from where its lines meet the cone. Where rounding could decide, that is next to an
//! end, the definition ([`Beam`]) is asked instead.

use std::ops::Range;

use crate::Pose2;
use crate::reference::{Beam, to_place_step};

/// How exactly the directions of edges are known [rad], with a large reserve.
const ANGLE_ERROR: f64 = 1e-12;

/// How exactly squares of lengths are known (relative), with a large reserve.
const SQUARE_ERROR: f64 = 1e-13;

/// How near to a grid line the axis is left to the definition [cells].
const NEAR: f64 = 1e-6;

/// The sector of one beam on the lattice of cells [cells]: cell (i, j) covers `[i, i+1) x [j, j+1)`, i to the
/// right, j up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Footprint {
    apex: [f64; 2],
    beam: Beam,
    /// The cone's clockwise and counter-clockwise edges.
    edges: [Edge; 2],
    /// x per y along the axis.
    axis_slope: f64,
    /// How exactly that gives x.
    axis_error: f64,
}

/// An edge of the cone: a bound of each row's x.
#[derive(Debug, Clone, Copy)]
struct Edge {
    direction: [f64; 2],
    /// x per y.
    slope: f64,
    /// How exactly that gives x.
    error: f64,
    /// Whether it bounds a row from above.
    upper: bool,
}

/// Cells of one row, as columns of the lattice.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RowSpans {
    /// Centres inside the cone.
    pub(crate) cone: Range<i64>,
    /// Crossed by the axis to the left of the cone's cells, and to the right of them.
    pub(crate) axis: [Range<i64>; 2],
}

/// A rectangle of cells of the lattice.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Bounds {
    pub(crate) cols: Range<i64>,
    pub(crate) rows: Range<i64>,
}

impl Footprint {
    /// The footprint of a cone of full angle `width` (at most pi) and length `reach` [m] on a lattice whose
    /// corner is at `anchor`.
    pub(crate) fn new(anchor: Pose2, resolution: f64, beam: Pose2, width: f64, reach: f64) -> Self {
        let (sin, cos) = anchor.theta.sin_cos();
        let (dx, dy) = (beam.x - anchor.x, beam.y - anchor.y);
        let (x, y) = (cos * dx + sin * dy, cos * dy - sin * dx);
        let beam = Beam::new(beam.theta - anchor.theta, width, reach / resolution);
        let ([axis_cos, axis_sin], (half_sin, half_cos)) =
            (beam.direction, beam.half_angle.sin_cos());
        let edge = |turn: f64| {
            // the axis turned clockwise, or the other way
            let cos = axis_cos * half_cos + turn * axis_sin * half_sin;
            let sin = axis_sin * half_cos - turn * axis_cos * half_sin;
            Edge {
                direction: [cos, sin],
                slope: if sin == 0.0 { 0.0 } else { cos / sin },
                error: beam.radius * ANGLE_ERROR / sin.abs(),
                // a point (x, y) is left of direction d where d.x y - d.y x >= 0, and right of it where <= 0
                upper: turn * sin > 0.0,
            }
        };
        let [dx, dy] = beam.tip;
        Self {
            apex: [to_place_step(x / resolution), to_place_step(y / resolution)],
            beam,
            edges: [edge(1.0), edge(-1.0)],
            axis_slope: if dy == 0.0 { 0.0 } else { dx / dy },
            // rows are taken larger by NEAR, too
            axis_error: NEAR
                + (NEAR * dx.abs() + beam.radius * beam.radius * ANGLE_ERROR) / dy.abs(),
        }
    }

    pub(crate) const fn apex(&self) -> [f64; 2] {
        self.apex
    }

    /// A rectangle that holds the whole sector; `None` where that is too far away to count cells.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        /// [cells]; leaves centres exact in `f64` and sums of bounds exact in `i64`
        const FAR: f64 = (1_u64 << 31) as f64;
        let mut low = [self.beam.tip[0].min(0.0), self.beam.tip[1].min(0.0)];
        let mut high = [self.beam.tip[0].max(0.0), self.beam.tip[1].max(0.0)];
        let cardinals = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        let ends = self.edges.map(|e| e.direction);
        for (k, d) in ends.into_iter().chain(cardinals).enumerate() {
            if k >= ends.len() && !self.points_into(d) {
                continue;
            }
            for k in 0..2 {
                low[k] = low[k].min(d[k] * self.beam.radius);
                high[k] = high[k].max(d[k] * self.beam.radius);
            }
        }
        let range = |k: usize| {
            let (from, to) = (
                (self.apex[k] + low[k] - NEAR).floor(),
                (self.apex[k] + high[k] + NEAR).floor(),
            );
            (from.abs() < FAR && to.abs() < FAR).then(|| from as i64..to as i64 + 1)
        };
        Some(Bounds {
            cols: range(0)?,
            rows: range(1)?,
        })
    }

    /// Whether a direction is inside the cone.
    fn points_into(&self, d: [f64; 2]) -> bool {
        let [right, left] = self.edges.map(|e| e.direction);
        cross(right, d) >= 0.0 && cross(d, left) >= 0.0
    }

    /// The cells of row `j` that the beam touches.
    #[inline(always)]
    pub(crate) fn row(&self, j: i64) -> RowSpans {
        let bottom = j as f64 - self.apex[1];
        let (cone, chord) = self.cone_cells(bottom + 0.5);
        let mut axis = [0..0, 0..0];
        if let Some((from, to)) = self.axis_chord(bottom) {
            // Where the axis is half a cell or more inside the cone, its cells are the cone's.
            let reserve = 0.5 + self.axis_error;
            if !(chord.0 + reserve < from && to < chord.1 - reserve) {
                axis = self.axis_cells(bottom, from, to, &cone);
            }
        }
        RowSpans { cone, axis }
    }

    /// The cells whose centres, `y` above the apex, are in the cone, and between which x from the apex on all
    /// surely are.
    #[inline(always)]
    fn cone_cells(&self, y: f64) -> (Range<i64>, (f64, f64)) {
        let squared = self.beam.radius_squared - y * y;
        if squared < 0.0 {
            return (0..0, (1.0, -1.0));
        }
        let error = self.beam.radius_squared * SQUARE_ERROR;
        let inner = squared - error;
        let inner = if inner > 0.0 { inner.sqrt() } else { -1.0 };
        let outer = (squared + error).sqrt();
        // Each end lies between an outer and an inner place.
        let (mut from, mut to) = ((-outer, -inner), (inner, outer));
        for k in 0..2 {
            let Edge {
                slope,
                error,
                upper,
                ..
            } = self.edges[k];
            let (low, high) = (y * slope - error, y * slope + error);
            if upper {
                to = (least(to.0, low), least(to.1, high));
            } else {
                from = (most(from.0, low), most(from.1, high));
            }
        }
        let base = self.apex[0] - 0.5;
        let mut first = (from.0 + base).ceil() as i64;
        let mut last = (to.1 + base).floor() as i64;
        let sure = first == (from.1 + base).ceil() as i64 && last == (to.0 + base).floor() as i64;
        if !sure {
            (first, last) = self.settle(first, last, y);
        }
        (first..(last + 1).max(first), (from.1, to.0))
    }

    /// Takes from both ends of a row what the definition says is outside the cone.
    #[cold]
    #[inline(never)]
    fn settle(&self, mut first: i64, mut last: i64, y: f64) -> (i64, i64) {
        let inside = |i: i64| self.beam.contains(i as f64 - self.apex[0] + 0.5, y);
        while first <= last && !inside(first) {
            first += 1;
        }
        while first <= last && !inside(last) {
            last -= 1;
        }
        (first, last)
    }

    /// Where the axis is in the row that starts `bottom` above the apex, from the apex on, up to
    /// `axis_error`.
    #[inline(always)]
    fn axis_chord(&self, bottom: f64) -> Option<(f64, f64)> {
        let [dx, dy] = self.beam.tip;
        let low = most(bottom - NEAR, least(dy, 0.0));
        let high = least(bottom + 1.0 + NEAR, most(dy, 0.0));
        if low > high {
            return None;
        }
        let (left, right) = (least(dx, 0.0), most(dx, 0.0));
        if dy == 0.0 {
            return Some((left, right));
        }
        let (a, b) = (low * self.axis_slope, high * self.axis_slope);
        let (from, to) = (least(a, b) - self.axis_error, most(a, b) + self.axis_error);
        // rounding must not carry the ends past the tip of a nearly horizontal axis
        Some((most(from, left - NEAR), least(to, right + NEAR)))
    }

    /// The cells that the axis crosses between two columns and that are not the cone's.
    #[inline(always)]
    fn axis_cells(&self, bottom: f64, from: f64, to: f64, cone: &Range<i64>) -> [Range<i64>; 2] {
        let (from, to) = (from + self.apex[0] - NEAR, to + self.apex[0] + NEAR);
        let (mut first, mut last) = (from.floor() as i64, to.floor() as i64);
        let error = 2.0 * self.axis_error + 4.0 * NEAR;
        let sure = first == (from + error).floor() as i64
            && last == (to - error).floor() as i64
            && self.axis_is_inside(bottom);
        if !sure {
            (first, last) = self.settle_axis(first, last, bottom);
        }
        let end = last + 1;
        if cone.is_empty() {
            [first..end, end..end]
        } else {
            [first..end.min(cone.start), first.max(cone.end)..end]
        }
    }

    /// Whether part of the axis is well inside the row that starts `bottom` above the apex.
    #[inline(always)]
    fn axis_is_inside(&self, bottom: f64) -> bool {
        let dy = self.beam.tip[1];
        most(bottom, least(dy, 0.0)) + 4.0 * NEAR < least(bottom + 1.0, most(dy, 0.0))
    }

    /// Takes from both ends of a row what the definition says the axis does not cross.
    #[cold]
    #[inline(never)]
    fn settle_axis(&self, mut first: i64, mut last: i64, bottom: f64) -> (i64, i64) {
        let crossed = |i: i64| self.beam.crosses(i as f64 - self.apex[0], bottom);
        while first <= last && !crossed(first) {
            first += 1;
        }
        while first <= last && !crossed(last) {
            last -= 1;
        }
        (first, last)
    }
}

/// The smaller of two numbers; one instruction, as neither is NaN.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger of two numbers.
#[inline(always)]
fn most(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
