//! Which cells a beam touches: those whose centre lies in the cone, and all that its axis crosses.

use std::ops::Range;

use crate::{Point2, Pose2};

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
        let direction = |angle: f64| [angle.cos(), angle.sin()];
        Self {
            apex: [x / resolution, y / resolution],
            axis: direction(heading),
            right: direction(heading - 0.5 * width),
            left: direction(heading + 0.5 * width),
            reach: reach / resolution,
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
    pub(crate) fn row(&self, j: i64) -> RowSpans {
        let cone = self.cone_columns(j as f64 + 0.5 - self.apex[1]);
        let crossed = self.axis_columns(j as f64 - self.apex[1]);
        if cone.is_empty() {
            return RowSpans {
                axis: [crossed, cone.end..cone.end],
                cone,
            };
        }
        RowSpans {
            axis: [
                crossed.start..crossed.end.min(cone.start),
                crossed.start.max(cone.end)..crossed.end,
            ],
            cone,
        }
    }

    /// Columns whose centres lie in the cone, in the row whose centres are `y` above the apex.
    fn cone_columns(&self, y: f64) -> Range<i64> {
        let chord = self.reach * self.reach - y * y;
        if chord < 0.0 {
            return 0..0;
        }
        let (mut from, mut to) = (-chord.sqrt(), chord.sqrt());
        // A point (x, y) is left of direction e where e.x y - e.y x >= 0.
        for e in [self.right, [-self.left[0], -self.left[1]]] {
            let bound = e[0] * y / e[1];
            if e[1] > 0.0 {
                to = to.min(bound);
            } else if e[1] < 0.0 {
                from = from.max(bound);
            } else if e[0] * y < 0.0 {
                return 0..0;
            }
        }
        let first = (from + self.apex[0] - 0.5).ceil() as i64;
        let last = (to + self.apex[0] - 0.5).floor() as i64;
        first..(last + 1).max(first)
    }

    /// Columns that the axis crosses in the row that starts `bottom` above the apex.
    fn axis_columns(&self, bottom: f64) -> Range<i64> {
        let [dx, dy] = self.axis;
        // the stretch of the axis inside the row, as distances from the apex
        let (mut from, mut to) = (0.0_f64, self.reach);
        if dy == 0.0 {
            if !(bottom <= 0.0 && bottom + 1.0 > 0.0) {
                return 0..0;
            }
        } else {
            let (a, b) = (bottom / dy, (bottom + 1.0) / dy);
            from = from.max(a.min(b));
            to = to.min(a.max(b));
            if from > to {
                return 0..0;
            }
        }
        let (a, b) = (self.apex[0] + from * dx, self.apex[0] + to * dx);
        a.min(b).floor() as i64..a.max(b).floor() as i64 + 1
    }
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
