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

/// Rows whose runs are found together, by vector arithmetic.
pub(crate) const BLOCK_ROWS: usize = 8;

/// The sector of one beam on the lattice of cells [cells]: cell (i, j) covers `[i, i+1) x [j, j+1)`, i to the
/// right, j up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Footprint {
    apex: [f64; 2],
    beam: Beam,
    /// Directions of the cone's clockwise and counter-clockwise edges.
    edges: [[f64; 2]; 2],
    /// What they say about the least x of a row.
    lower: [Bound; 2],
    /// What they say about the largest.
    upper: [Bound; 2],
    /// x per y along the axis.
    axis_slope: f64,
    /// How exactly that gives x.
    axis_error: f64,
}

/// A bound of x in the row at y, somewhere in `y * slope + low ..= y * slope + high`.
#[derive(Debug, Clone, Copy)]
struct Bound {
    slope: f64,
    low: f64,
    high: f64,
}

/// One run of touched cells for each row of a block, as columns of the lattice.
#[derive(Debug)]
pub(crate) struct Runs {
    pub(crate) first: [i64; BLOCK_ROWS],
    pub(crate) end: [i64; BLOCK_ROWS],
    /// 0 where the run is not surely all that [`Footprint::row`] gives, 1 where it is. (As wide as the others,
    /// for the vectors' sake.)
    pub(crate) sure: [i64; BLOCK_ROWS],
}

/// First and last cell of a row in the cone.
#[derive(Debug, Clone, Copy)]
struct ConeEnds {
    cells: [f64; 2],
    /// Whether rounding cannot matter; else they are within these.
    sure: bool,
    /// From the apex; all x between them are in the cone.
    inner: [f64; 2],
}

/// First and last cell of a row on the axis.
#[derive(Debug, Clone, Copy)]
struct AxisEnds {
    cells: [f64; 2],
    /// Whether rounding cannot matter; else they are within these.
    sure: bool,
    /// Whether there may be some, and some that are not the cone's.
    counts: bool,
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

impl Bound {
    /// What an edge of a cone says about one side of a row. `turn` is 1 for the clockwise edge, -1 for the other;
    /// `side` is 1 for the upper end, -1 for the lower.
    fn new([cos, sin]: [f64; 2], turn: f64, side: f64, radius: f64) -> Self {
        /// Farther than any cell.
        const NOWHERE: f64 = 1e300;
        // a point (x, y) is left of direction d where d.x y - d.y x >= 0, and right of it where <= 0
        if turn * sin * side > 0.0 {
            let error = radius * ANGLE_ERROR / sin.abs();
            let slope = cos / sin;
            let (low, high) = (-error, error);
            Self { slope, low, high }
        } else {
            // a level edge leaves everything to the definition
            let level = sin == 0.0 && side < 0.0;
            let slope = 0.0;
            let low = side * NOWHERE;
            let high = if level { NOWHERE } else { low };
            Self { slope, low, high }
        }
    }
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
        // the axis turned clockwise, or the other way
        let edge = |turn: f64| {
            [
                axis_cos * half_cos + turn * axis_sin * half_sin,
                axis_sin * half_cos - turn * axis_cos * half_sin,
            ]
        };
        let edges = [edge(1.0), edge(-1.0)];
        let bound = |side| {
            [
                Bound::new(edges[0], 1.0, side, beam.radius),
                Bound::new(edges[1], -1.0, side, beam.radius),
            ]
        };
        let [dx, dy] = beam.tip;
        Self {
            apex: [to_place_step(x / resolution), to_place_step(y / resolution)],
            beam,
            edges,
            lower: bound(-1.0),
            upper: bound(1.0),
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
        let [right, left] = self.edges;
        for k in 0..2 {
            low[k] = low[k]
                .min(right[k] * self.beam.radius)
                .min(left[k] * self.beam.radius);
            high[k] = high[k]
                .max(right[k] * self.beam.radius)
                .max(left[k] * self.beam.radius);
        }
        // whether +x, +y, -x and -y point into the cone
        if right[1] <= 0.0 && left[1] >= 0.0 {
            high[0] = self.beam.radius;
        }
        if right[0] >= 0.0 && left[0] <= 0.0 {
            high[1] = self.beam.radius;
        }
        if right[1] >= 0.0 && left[1] <= 0.0 {
            low[0] = -self.beam.radius;
        }
        if right[0] <= 0.0 && left[0] >= 0.0 {
            low[1] = -self.beam.radius;
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

    /// The cells of row `j` that the beam touches.
    pub(crate) fn row(&self, j: i64) -> RowSpans {
        let bottom = j as f64 - self.apex[1];
        let ends = self.cone_ends(bottom);
        let axis_ends = self.axis_ends(bottom, ends.inner);
        let (mut first, mut last) = (ends.cells[0] as i64, ends.cells[1] as i64);
        if !ends.sure {
            (first, last) = self.settle(first, last, bottom + 0.5);
        }
        let cone = first..(last + 1).max(first);
        if !axis_ends.counts {
            let axis = [0..0, 0..0];
            return RowSpans { cone, axis };
        }
        let (mut first, mut last) = (axis_ends.cells[0] as i64, axis_ends.cells[1] as i64);
        if !axis_ends.sure {
            (first, last) = self.settle_axis(first, last, bottom);
        }
        let end = last + 1;
        let axis = if cone.is_empty() {
            [first..end, end..end]
        } else {
            [first..end.min(cone.start), first.max(cone.end)..end]
        };
        RowSpans { cone, axis }
    }

    /// The cells of the rows from `j` on, the cone's and the axis's together.
    #[inline(always)]
    pub(crate) fn runs(&self, j: i64) -> Runs {
        let mut runs = Runs {
            first: [0; BLOCK_ROWS],
            end: [0; BLOCK_ROWS],
            sure: [0; BLOCK_ROWS],
        };
        let bottom = j as f64 - self.apex[1];
        // without a branch, or else it does not vectorise
        for (k, step) in (0..BLOCK_ROWS).zip(0_i32..) {
            let bottom = bottom + f64::from(step);
            let cone = self.cone_ends(bottom);
            let axis = self.axis_ends(bottom, cone.inner);
            let ([from, to], [axis_from, axis_to]) = (cone.cells, axis.cells);
            let empty = to < from;
            let adjacent = (axis_from <= to + 1.0) & (axis_to >= from - 1.0);
            let sure = cone.sure & (!axis.counts | (axis.sure & (empty | adjacent)));
            let both = if empty {
                [axis_from, axis_to]
            } else {
                [least(from, axis_from), most(to, axis_to)]
            };
            let [first, last] = if axis.counts { both } else { [from, to] };
            runs.first[k] = to_integer(first);
            runs.end[k] = to_integer(last + 1.0);
            runs.sure[k] = i64::from(sure);
        }
        runs
    }

    /// The cells in the cone of the row that starts `bottom` above the apex: those whose centres are in it.
    #[inline(always)]
    fn cone_ends(&self, bottom: f64) -> ConeEnds {
        let y = bottom + 0.5;
        let squared = self.beam.radius_squared - y * y;
        let error = self.beam.radius_squared * SQUARE_ERROR;
        let inner = most(squared - error, 0.0).sqrt();
        let inner = if squared - error > 0.0 { inner } else { -1.0 };
        let outer = most(squared + error, 0.0).sqrt();
        let outer = if squared < 0.0 { -1.0 } else { outer };
        // Each end lies between an outer and an inner place.
        let (mut from, mut to) = ((-outer, -inner), (inner, outer));
        for Bound { slope, low, high } in self.lower {
            from = (
                most(from.0, y * slope + low),
                most(from.1, y * slope + high),
            );
        }
        for Bound { slope, low, high } in self.upper {
            to = (least(to.0, y * slope + low), least(to.1, y * slope + high));
        }
        let base = self.apex[0] - 0.5;
        let cells = [(from.0 + base).ceil(), (to.1 + base).floor()];
        ConeEnds {
            cells,
            sure: (cells[0] >= (from.1 + base).ceil()) & (cells[1] <= (to.0 + base).floor()),
            inner: [from.1, to.0],
        }
    }

    /// The cells that the axis crosses in the row that starts `bottom` above the apex. `cone` is a part of the
    /// cone in that row.
    #[inline(always)]
    fn axis_ends(&self, bottom: f64, cone: [f64; 2]) -> AxisEnds {
        let [dx, dy] = self.beam.tip;
        let (start, end) = (least(dy, 0.0), most(dy, 0.0));
        let low = most(bottom - NEAR, start);
        let high = least(bottom + 1.0 + NEAR, end);
        let (a, b) = (low * self.axis_slope, high * self.axis_slope);
        // rounding must not carry the ends past the tip of a nearly horizontal axis
        let from = most(least(a, b) - self.axis_error, least(dx, 0.0) - NEAR);
        let to = least(most(a, b) + self.axis_error, most(dx, 0.0) + NEAR);
        // Where the axis is half a cell or more inside the cone, its cells are the cone's.
        let reserve = 0.5 + self.axis_error;
        let inside = (cone[0] + reserve < from) & (to < cone[1] - reserve);
        let (from, to) = (from + self.apex[0] - NEAR, to + self.apex[0] + NEAR);
        let cells = [from.floor(), to.floor()];
        let error = 2.0 * self.axis_error + 4.0 * NEAR;
        let well_in_row = most(bottom, start) + 4.0 * NEAR < least(bottom + 1.0, end);
        AxisEnds {
            cells,
            sure: (cells[0] >= (from + error).floor())
                & (cells[1] <= (to - error).floor())
                & well_in_row,
            counts: (low <= high) & !inside,
        }
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

/// An integer from a number that is one, in a way that vectorises: adding 2^52 and a half of that leaves it in
/// the low bits.
#[inline(always)]
fn to_integer(x: f64) -> i64 {
    const OFFSET: f64 = 6_755_399_441_055_744.0;
    (x + OFFSET).to_bits() as i64 - OFFSET.to_bits() as i64
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
