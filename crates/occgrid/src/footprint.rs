//! Which cells a beam touches: those whose centre lies in the cone, and all that its axis crosses.

use std::ops::Range;

use crate::{Point2, Pose2};

/// Cone and length are taken this much larger (relative, and in radians), so that centres exactly on the edge are
/// inside, however their place is rounded.
const EDGE: f64 = 1e-9;

/// The sector of one beam on the lattice of cells [cells]: cell (i, j) covers `[i, i+1) x [j, j+1)`, i to the
/// right, j up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Footprint {
    apex: [f64; 2],
    axis: [f64; 2],
    /// Directions of the cone's clockwise and counter-clockwise edges.
    right: [f64; 2],
    left: [f64; 2],
    reach: f64,
    /// x per y along the axis and along the two edges.
    axis_slope: f64,
    right_slope: f64,
    left_slope: f64,
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
        let Point2 { x, y } = anchor.inverse().transform_from(beam.position());
        let heading = beam.theta - anchor.theta;
        let direction = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            [cos, sin]
        };
        let axis = direction(heading);
        let right = direction(heading - 0.5 * width - EDGE);
        let left = direction(heading + 0.5 * width + EDGE);
        Self {
            apex: [x / resolution, y / resolution],
            axis,
            right,
            left,
            reach: reach * (1.0 + EDGE) / resolution,
            axis_slope: axis[0] / axis[1],
            right_slope: right[0] / right[1],
            left_slope: left[0] / left[1],
        }
    }

    pub(crate) const fn apex(&self) -> [f64; 2] {
        self.apex
    }

    /// A rectangle that holds the whole sector; `None` where that is too far away to count cells.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        /// [cells]; leaves centres exact in `f64` and sums of bounds exact in `i64`
        const FAR: f64 = (1_u64 << 40) as f64;
        let mut low = [0.0_f64; 2];
        let mut high = [0.0_f64; 2];
        let cardinals = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        let inside = cardinals.into_iter().filter(|&d| self.in_cone(d));
        for d in [self.axis, self.right, self.left].into_iter().chain(inside) {
            for k in 0..2 {
                low[k] = low[k].min(d[k] * self.reach);
                high[k] = high[k].max(d[k] * self.reach);
            }
        }
        let range = |k: usize| {
            let (from, to) = (
                (self.apex[k] + low[k]).floor(),
                (self.apex[k] + high[k]).floor(),
            );
            (from.abs() < FAR && to.abs() < FAR).then(|| from as i64..to as i64 + 1)
        };
        Some(Bounds {
            cols: range(0)?,
            rows: range(1)?,
        })
    }

    fn in_cone(&self, d: [f64; 2]) -> bool {
        cross(self.right, d) >= 0.0 && cross(d, self.left) >= 0.0
    }

    /// The cells of row `j` that the beam touches.
    #[inline(always)]
    pub(crate) fn row(&self, j: i64) -> RowSpans {
        let bottom = j as f64 - self.apex[1];
        let (from, to) = self.cone_chord(bottom + 0.5);
        let (axis_from, axis_to) = self.axis_chord(bottom);
        let (mut cone, mut axis) = (0..0, [0..0, 0..0]);
        if from <= to {
            let first = (from + self.apex[0] - 0.5).ceil() as i64;
            let last = (to + self.apex[0] - 0.5).floor() as i64;
            cone = first..(last + 1).max(first);
        }
        // Where the axis is half a cell or more inside the cone, its cells are the cone's.
        let covered = from + 0.5 < axis_from && axis_to < to - 0.5;
        if axis_from <= axis_to && !covered {
            let first = (axis_from + self.apex[0]).floor() as i64;
            let end = (axis_to + self.apex[0]).floor() as i64 + 1;
            axis = if cone.is_empty() {
                [first..end, end..end]
            } else {
                [first..end.min(cone.start), first.max(cone.end)..end]
            };
        }
        RowSpans { cone, axis }
    }

    /// Where the cone is on the horizontal line `y` above the apex, from the apex on; empty where from > to.
    #[inline(always)]
    fn cone_chord(&self, y: f64) -> (f64, f64) {
        const EMPTY: (f64, f64) = (1.0, -1.0);
        let squared = self.reach * self.reach - y * y;
        if squared < 0.0 {
            return EMPTY;
        }
        let to = squared.sqrt();
        let mut chord = (-to, to);
        // A point (x, y) is left of direction e where e.x y - e.y x >= 0, and right of it where <= 0.
        for (e, slope, turn) in [
            (self.right, self.right_slope, 1.0),
            (self.left, self.left_slope, -1.0),
        ] {
            if turn * e[1] > 0.0 {
                chord.1 = chord.1.min(y * slope);
            } else if e[1] != 0.0 {
                chord.0 = chord.0.max(y * slope);
            } else if turn * e[0] * y < 0.0 {
                return EMPTY;
            }
        }
        chord
    }

    /// Where the axis is in the row that starts `bottom` above the apex, from the apex on; empty where
    /// from > to.
    #[inline(always)]
    fn axis_chord(&self, bottom: f64) -> (f64, f64) {
        const EMPTY: (f64, f64) = (1.0, -1.0);
        let [dx, dy] = self.axis;
        let tip = (dx * self.reach, dy * self.reach);
        let (low, high) = (
            bottom.max(tip.1.min(0.0)),
            (bottom + 1.0).min(tip.1.max(0.0)),
        );
        if low > high {
            return EMPTY;
        }
        if dy == 0.0 {
            return if bottom + 1.0 > 0.0 {
                (tip.0.min(0.0), tip.0.max(0.0))
            } else {
                EMPTY
            };
        }
        let (a, b) = (low * self.axis_slope, high * self.axis_slope);
        // rounding must not carry the ends past the tip of a nearly horizontal axis
        let clip = |x: f64| x.clamp(tip.0.min(0.0), tip.0.max(0.0));
        (clip(a.min(b)), clip(a.max(b)))
    }
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
