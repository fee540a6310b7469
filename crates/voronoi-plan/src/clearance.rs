//! Exact clearance: the distance to the nearest point of any not-free cell, cells as squares.
//!
//! All lengths here are in cells and all points in grid coordinates ([`GridPoint`]). The clearance is
//! 1-Lipschitz, so the exact values at the cell centres bound it everywhere else; squares are looked
//! at one by one only where those bounds do not decide (sphere tracing: Hart, The Visual Computer
//! 12(10), 1996).

use morpho::distance::squared_to_squares;
use morpho::{BitImage, Border};
use occgrid::{Cell, GridPoint};

use crate::FreeSpace;
use crate::square::{Nearest, between, nearest_on_segment, nearest_to_square, squared_distance};

/// Two clearances that differ by less than this count as equal [cells].
pub const TIE_CELLS: f64 = 1e-9;

/// How far a claimed clearance stays below the computed one [m], so that rounding never lifts it above
/// the truth.
const CLAIM_MARGIN: f64 = 1e-9;

/// What the conversion of points between frames may lose [m].
const ROUNDING: f64 = 1e-11;

/// No point of a cell is farther than this from its centre, and a hair more [cells].
const HALF_DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2 + 1e-6;

/// Step along a segment where the bounds do not decide [cells].
const STEP: f64 = 4.0;

/// The exact clearance of every cell centre of a free space, and of any point or segment.
///
/// 4 bytes and 1 bit a cell.
#[derive(Debug, Clone)]
pub struct ClearanceField {
    cells: BitImage,
    squared_doubled: Vec<u32>,
}

/// Where a segment is nearest to a not-free cell, and how near.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentClearance {
    /// Distance from the segment to the nearest not-free square [cells]; 0 where it touches or
    /// crosses one, or leaves the map.
    pub clearance: f64,
    /// The point of the segment where that is.
    pub at: GridPoint,
    /// The nearest point of a not-free square (or of the map's border) to it.
    pub obstacle: GridPoint,
}

/// A segment with its length.
struct Line {
    a: GridPoint,
    b: GridPoint,
    length: f64,
}

impl Line {
    fn new(a: GridPoint, b: GridPoint) -> Self {
        let length = (b.col - a.col).hypot(b.row - a.row);
        Self { a, b, length }
    }

    /// The point at distance `t` from `a`.
    fn at(&self, t: f64) -> GridPoint {
        if self.length > 0.0 {
            between(self.a, self.b, t / self.length)
        } else {
            self.a
        }
    }
}

impl ClearanceField {
    /// The field of a free space. Linear in the number of cells.
    #[must_use]
    pub fn new(free: &FreeSpace) -> Self {
        let cells = free.cells().clone();
        Self {
            squared_doubled: squared_to_squares(&cells, Border::Background),
            cells,
        }
    }

    /// `(2 d)^2` of every cell centre in row-major order, d its clearance [cells]; 0 in a cell that is
    /// not free, at least 1 in a free one.
    #[must_use]
    pub fn squared_doubled(&self) -> &[u32] {
        &self.squared_doubled
    }

    /// Clearance of a cell's centre [cells]; 0 outside the map.
    #[must_use]
    pub fn at(&self, cell: Cell) -> f64 {
        let (col, row) = (cell.col as usize, cell.row as usize);
        if col >= self.cells.width() || row >= self.cells.height() {
            return 0.0;
        }
        self.of_center(col, row)
    }

    /// The least `(2 d)^2` of a cell centre that keeps `min` cells of clearance, ties included; at
    /// least 1, so never that of a cell that is not free.
    #[must_use]
    pub fn threshold(min: f64) -> u32 {
        let doubled = 2.0 * (min - TIE_CELLS).max(0.0);
        ((doubled * doubled).ceil() as u32).max(1)
    }

    /// Clearance of a point [cells]; 0 outside the map. As [`Self::of_segment`].
    #[must_use]
    pub fn of_point(&self, point: GridPoint) -> f64 {
        self.of_segment(point, point).clearance
    }

    /// The exact minimum over a segment of the distance to the nearest not-free square. End points may
    /// be anywhere; one with a coordinate that is not finite gives 0.
    ///
    /// Time: at most proportional to the length times (1 + clearance / 64), both in cells.
    #[must_use]
    pub fn of_segment(&self, a: GridPoint, b: GridPoint) -> SegmentClearance {
        let mut best = self.to_border(a);
        best.keep_nearer(self.to_border(b));
        if best.squared > 0.0 {
            let line = Line::new(a, b);
            let reach = self.upper_bound(&line).min(best.squared.sqrt()) + TIE_CELLS;
            self.search(&line, reach, &mut best, false);
        }
        SegmentClearance {
            clearance: best.squared.sqrt(),
            at: best.at,
            obstacle: best.obstacle,
        }
    }

    /// Whether a segment keeps `min` cells of clearance everywhere, ties within [`TIE_CELLS`] kept.
    /// A segment that touches a not-free cell or the map's border is never clear, even for `min` = 0.
    ///
    /// Time: as few steps as the clear space allows; squares are looked at only along obstacles.
    #[must_use]
    pub fn segment_is_clear(&self, a: GridPoint, b: GridPoint, min: f64) -> bool {
        let need = (min - TIE_CELLS).max(TIE_CELLS);
        let mut best = self.to_border(a);
        best.keep_nearer(self.to_border(b));
        if best.squared < need * need {
            return false;
        }
        let line = Line::new(a, b);
        !self.is_blocked(&line, need) && !self.search(&line, need, &mut best, true)
    }

    /// The cells that are free.
    pub(crate) const fn free_cells(&self) -> &BitImage {
        &self.cells
    }

    fn of_center(&self, col: usize, row: usize) -> f64 {
        let squared = self.squared_doubled[row * self.cells.width() + col];
        f64::from(squared).sqrt() / 2.0
    }

    /// The nearest point of the outside; at distance 0 for a point that is not inside.
    fn to_border(&self, p: GridPoint) -> Nearest {
        let (width, height) = (self.cells.width() as f64, self.cells.height() as f64);
        let mut best = Nearest {
            squared: f64::INFINITY,
            at: p,
            obstacle: p,
        };
        for (distance, col, row) in [
            (p.col, 0.0, p.row),
            (width - p.col, width, p.row),
            (p.row, p.col, 0.0),
            (height - p.row, p.col, height),
        ] {
            let inside = distance > 0.0;
            let obstacle = if inside { GridPoint { col, row } } else { p };
            best.keep_nearer(Nearest {
                squared: if inside { distance * distance } else { 0.0 },
                at: p,
                obstacle,
            });
        }
        best
    }

    /// Bounds of the clearance at a point inside the map, from that of its cell's centre.
    fn bounds(&self, p: GridPoint) -> (f64, f64) {
        let col = (p.col as usize).min(self.cells.width() - 1);
        let row = (p.row as usize).min(self.cells.height() - 1);
        let (dc, dr) = (p.col - col as f64 - 0.5, p.row - row as f64 - 0.5);
        let offset = (dc * dc + dr * dr).sqrt();
        let center = self.of_center(col, row);
        if center > 0.0 {
            ((center - offset).max(0.0), center + offset)
        } else {
            (0.0, 0.0)
        }
    }

    /// Whether the cell centres' bounds alone show that a segment comes nearer than `need`.
    fn is_blocked(&self, line: &Line, need: f64) -> bool {
        let mut t = 0.0;
        loop {
            let (lower, upper) = self.bounds(line.at(t));
            if upper < need {
                return true;
            }
            if t >= line.length {
                return false;
            }
            t = (t + (lower - need).max(STEP)).min(line.length);
        }
    }

    /// An upper bound of a segment's clearance, within a cell of it.
    fn upper_bound(&self, line: &Line) -> f64 {
        let (mut t, mut upper) = (0.0, f64::INFINITY);
        loop {
            let (lower, above) = self.bounds(line.at(t));
            upper = upper.min(above);
            if t >= line.length {
                return upper;
            }
            t = (t + (lower - upper).max(STEP)).min(line.length);
        }
    }

    /// Looks for squares nearer than `reach` to the segment, which is inside the map, and keeps the
    /// nearest in `best`. With `any`, stops at the first. Returns whether there is one.
    fn search(&self, line: &Line, mut reach: f64, best: &mut Nearest, any: bool) -> bool {
        let mut found = false;
        let mut undecided = None;
        let mut t = 0.0;
        loop {
            let (lower, _) = self.bounds(line.at(t));
            let decided = lower - reach;
            let last = t >= line.length;
            if decided <= STEP {
                undecided.get_or_insert(t);
            }
            if (last || decided > STEP)
                && let Some(start) = undecided.take()
                && self.scan([line.at(start), line.at(t)], reach, best, any)
            {
                found = true;
                if any {
                    return true;
                }
                reach = reach.min(best.squared.sqrt());
            }
            if last {
                return found;
            }
            t = (t + decided.max(STEP)).min(line.length);
        }
    }

    /// Looks at every not-free cell that may be nearer than `reach` to the segment `p`-`q`. With `any`,
    /// stops at the first that is.
    fn scan(&self, [p, q]: [GridPoint; 2], reach: f64, best: &mut Nearest, any: bool) -> bool {
        let limit = reach * reach;
        let beyond = (reach + HALF_DIAGONAL) * (reach + HALF_DIAGONAL);
        let mut found = false;
        let first_row = (p.row.min(q.row) - reach).max(0.0) as usize;
        let last_row = ((p.row.max(q.row) + reach) as usize).min(self.cells.height() - 1);
        for row in first_row..=last_row {
            let (from, to) = columns_within(p, q, row as f64, reach);
            let first_col = from.max(0.0) as usize;
            let last_col = (to.max(0.0) as usize).min(self.cells.width() - 1);
            if first_col > last_col {
                continue;
            }
            let words = &self.cells.row(row)[first_col / 64..=last_col / 64];
            for (i, word) in words.iter().enumerate() {
                let base = (first_col / 64 + i) * 64;
                let mut blocked = !word;
                if base < first_col {
                    blocked &= u64::MAX << (first_col - base);
                }
                if base + 63 > last_col {
                    blocked &= u64::MAX >> (base + 63 - last_col);
                }
                while blocked != 0 {
                    let col = base + blocked.trailing_zeros() as usize;
                    blocked &= blocked - 1;
                    if squared_to_center(p, q, col, row) >= beyond {
                        continue;
                    }
                    let nearest = nearest_to_square(p, q, col, row);
                    if nearest.squared < limit {
                        found = true;
                        if any {
                            return true;
                        }
                        best.keep_nearer(nearest);
                    }
                }
            }
        }
        found
    }
}

/// Squared distance from a segment to the centre of a cell [cells^2].
fn squared_to_center(p: GridPoint, q: GridPoint, col: usize, row: usize) -> f64 {
    let center = GridPoint {
        col: col as f64 + 0.5,
        row: row as f64 + 0.5,
    };
    squared_distance(nearest_on_segment(p, q, center), center)
}

/// The columns in which a square of the given row can be nearer than `reach` to the segment `p`-`q`.
fn columns_within(p: GridPoint, q: GridPoint, row: f64, reach: f64) -> (f64, f64) {
    let (low, high) = (row - reach, row + 1.0 + reach);
    let rise = q.row - p.row;
    let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
    if rise.abs() > TIE_CELLS {
        let (a, b) = ((low - p.row) / rise, (high - p.row) / rise);
        t0 = t0.max(a.min(b)).min(1.0);
        t1 = t1.min(a.max(b)).max(0.0);
    }
    let (a, b) = (between(p, q, t0).col, between(p, q, t1).col);
    // a hair more, so that rounding in the clipping loses no square
    (a.min(b) - reach - TIE_CELLS, a.max(b) + reach + TIE_CELLS)
}

/// The clearance [m] to claim for an exact one: a nanometre less, but not less than `radius` where the
/// exact value reaches it to within rounding.
pub(crate) fn claim(exact: f64, radius: f64) -> f64 {
    let claimed = (exact - CLAIM_MARGIN).max(0.0);
    if exact >= radius - ROUNDING {
        claimed.max(radius)
    } else {
        claimed
    }
}
