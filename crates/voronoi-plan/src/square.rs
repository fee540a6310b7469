//! The exact distance between a segment and the square of a cell.

use occgrid::GridPoint;

/// The nearest square found so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    /// Squared distance [cells^2].
    pub(crate) squared: f64,
    /// On the segment.
    pub(crate) at: GridPoint,
    /// On the square.
    pub(crate) obstacle: GridPoint,
}

impl Nearest {
    /// Keeps the nearer of the two, this one on a tie.
    pub(crate) fn keep_nearer(&mut self, other: Self) {
        if other.squared < self.squared {
            *self = other;
        }
    }

    fn between(at: GridPoint, obstacle: GridPoint) -> Self {
        Self {
            squared: squared_distance(at, obstacle),
            at,
            obstacle,
        }
    }
}

/// Squared Euclidean distance [cells^2].
pub(crate) fn squared_distance(a: GridPoint, b: GridPoint) -> f64 {
    let (dc, dr) = (a.col - b.col, a.row - b.row);
    dc * dc + dr * dr
}

/// The nearest points of the segment `a`-`b` and of the closed square of cell (col, row).
///
/// Two convex shapes that do not meet are nearest at a vertex of one of them: an end of the segment,
/// or a corner of the square.
pub(crate) fn nearest_to_square(a: GridPoint, b: GridPoint, col: usize, row: usize) -> Nearest {
    let low = GridPoint {
        col: col as f64,
        row: row as f64,
    };
    if let Some(at) = first_inside(a, b, low) {
        return Nearest::between(at, at);
    }
    let clamp = |p: GridPoint| GridPoint {
        col: p.col.clamp(low.col, low.col + 1.0),
        row: p.row.clamp(low.row, low.row + 1.0),
    };
    let mut best = Nearest::between(a, clamp(a));
    best.keep_nearer(Nearest::between(b, clamp(b)));
    for (dc, dr) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let corner = GridPoint {
            col: low.col + dc,
            row: low.row + dr,
        };
        best.keep_nearer(Nearest::between(nearest_on_segment(a, b, corner), corner));
    }
    best
}

/// The point of the segment `a`-`b` nearest to `p`.
pub(crate) fn nearest_on_segment(a: GridPoint, b: GridPoint, p: GridPoint) -> GridPoint {
    let (dc, dr) = (b.col - a.col, b.row - a.row);
    let squared_length = dc * dc + dr * dr;
    if squared_length <= 0.0 {
        return a;
    }
    let t = ((p.col - a.col) * dc + (p.row - a.row) * dr) / squared_length;
    between(a, b, t.clamp(0.0, 1.0))
}

/// The point at parameter `t` of the segment `a`-`b`; exactly its ends at 0 and 1.
pub(crate) fn between(a: GridPoint, b: GridPoint, t: f64) -> GridPoint {
    if t >= 1.0 {
        return b;
    }
    GridPoint {
        col: a.col + (b.col - a.col) * t,
        row: a.row + (b.row - a.row) * t,
    }
}

/// The first point of the segment in the closed unit square whose least corner is `low`, if any
/// (clipping after Liang and Barsky, ACM Transactions on Graphics 3(1), 1984).
fn first_inside(a: GridPoint, b: GridPoint, low: GridPoint) -> Option<GridPoint> {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (from, to, low) in [(a.col, b.col, low.col), (a.row, b.row, low.row)] {
        let high = low + 1.0;
        let step = to - from;
        if step.abs() <= f64::MIN_POSITIVE {
            if from < low || from > high {
                return None;
            }
            continue;
        }
        let (t0, t1) = ((low - from) / step, (high - from) / step);
        enter = enter.max(t0.min(t1));
        leave = leave.min(t0.max(t1));
    }
    (enter <= leave).then(|| between(a, b, enter))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
        let p = |[col, row]: [f64; 2]| GridPoint { col, row };
        nearest_to_square(p(a), p(b), 2, 3).squared.sqrt()
    }

    #[test]
    fn distances_from_the_square_of_cell_2_3() {
        for (a, b, expected) in [
            ([0.0, 3.5], [1.5, 3.5], 0.5),            // an end, beside an edge
            ([0.0, 0.0], [1.0, 1.0], 5.0_f64.sqrt()), // an end, off a corner
            ([1.0, 3.0], [3.0, 1.0], 0.5_f64.sqrt()), // a corner, inside the segment
            ([0.0, 3.0], [9.0, 3.0], 0.0),            // along an edge
            ([0.0, 2.0], [2.0, 2.0], 1.0),            // ends over a corner
            ([2.5, 3.5], [2.5, 3.5], 0.0),            // a point inside
            ([2.5, 5.0], [2.5, 5.0], 1.0),            // a point outside
            ([1.0, 2.0], [2.0, 3.0], 0.0),            // touches a corner
            ([0.0, 0.0], [10.0, 12.0], 0.0),          // crosses
        ] {
            let (found, back) = (distance(a, b), distance(b, a));
            assert!((found - expected).abs() < 1e-12, "{a:?} {b:?}: {found}");
            assert!((back - expected).abs() < 1e-12, "{b:?} {a:?}: {back}");
        }
    }
}
