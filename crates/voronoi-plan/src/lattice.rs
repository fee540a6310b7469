//! The lattice of a robot's radius: the cells where it may stand, and the straight links between
//! 8-neighbours that it may take. What the roadmap must connect, exactly.
//!
//! All in integers: clearances are compared as `(2 d)^2`. The clearance of a link between two cells
//! that share a side is the lesser of its ends' clearances, since every grid-aligned square is nearest
//! to an end. On a link between cells that share a corner the only other candidates are the squares
//! cut by the anti-diagonal through its midpoint: the j-th square beside the link is `sqrt(2) j` away.
//! With ends no nearer than `m` that is at least `sqrt(m^2 - 1/2)`, so at most one `j` has to be looked at.

use morpho::BitImage;
use occgrid::{Cell, GridPoint};

use crate::ClearanceField;
use crate::nearest::nearest;
use crate::samples::Samples;

/// The neighbours of a cell, clockwise from east in image coordinates.
pub(crate) const STEPS: [(i32, i32); 8] = [
    (1, 0),
    (1, 1),
    (0, 1),
    (-1, 1),
    (-1, 0),
    (-1, -1),
    (0, -1),
    (1, -1),
];

/// Where a robot of a given clearance may be on the grid of cell centres.
#[derive(Debug, Clone, Copy)]
pub struct Lattice<'a> {
    free: &'a BitImage,
    clearances: Clearances<'a>,
    need: u32,
    clear_beside: u32,
}

/// Where the clearances of cells come from.
#[derive(Debug, Clone, Copy)]
enum Clearances<'a> {
    /// All are at hand.
    Field(&'a [u32]),
    /// Which cells are admissible is at hand, and the clearances of some; others are searched for.
    Sampled {
        admissible: &'a BitImage,
        samples: Option<&'a Samples<'a>>,
    },
}

impl<'a> Lattice<'a> {
    /// The lattice for a clearance of `min` cells, ties included. Touching a not-free cell is never
    /// admissible, even for `min` = 0.
    ///
    /// # Panics
    /// If the field is not of the size of `free`.
    #[must_use]
    pub fn new(free: &'a BitImage, field: &'a ClearanceField, min: f64) -> Self {
        let squared_doubled = field.squared_doubled();
        assert_eq!(
            squared_doubled.len(),
            free.width() * free.height(),
            "field and free cells differ in size"
        );
        let need = ClearanceField::threshold(min);
        Self {
            free,
            clearances: Clearances::Field(squared_doubled),
            need,
            clear_beside: beside_at_least(need),
        }
    }

    /// The same lattice without a field. `admissible` are the free cells whose `(2 d)^2` is at least
    /// `need`; `samples` the clearances that will be asked for often, if they are at hand.
    pub(crate) fn sampled(
        free: &'a BitImage,
        admissible: &'a BitImage,
        need: u32,
        samples: Option<&'a Samples<'a>>,
    ) -> Self {
        Self {
            free,
            clearances: Clearances::Sampled {
                admissible,
                samples,
            },
            need,
            clear_beside: beside_at_least(need),
        }
    }

    /// The least `(2 d)^2` of an admissible cell.
    #[must_use]
    pub const fn need(&self) -> u32 {
        self.need
    }

    /// `(2 d)^2` at a cell's centre; 0 outside the map.
    #[must_use]
    pub fn squared_doubled(&self, cell: Cell) -> u32 {
        let (x, y) = (cell.col as usize, cell.row as usize);
        if x >= self.free.width() || y >= self.free.height() {
            return 0;
        }
        match self.clearances {
            Clearances::Field(field) => field[y * self.free.width() + x],
            Clearances::Sampled { samples, .. } => samples
                .and_then(|samples| samples.squared_doubled(cell))
                .unwrap_or_else(|| nearest(self.free, cell).squared_doubled),
        }
    }

    /// Whether the robot may stand at a cell's centre.
    #[must_use]
    pub fn has(&self, cell: Cell) -> bool {
        match self.clearances {
            Clearances::Field(_) => self.squared_doubled(cell) >= self.need,
            Clearances::Sampled { admissible, .. } => {
                admissible.get(cell.col as usize, cell.row as usize)
            }
        }
    }

    /// Whether the robot may go straight from one cell's centre to that of an 8-neighbour.
    #[must_use]
    pub fn links(&self, a: Cell, b: Cell) -> bool {
        self.has(a)
            && self.has(b)
            && (a.col == b.col
                || a.row == b.row
                || !self.blocked_beside(a, b, self.clear_beside - 1))
    }

    /// The exact `(2 d)^2` of the link between two 8-neighbours; 0 where it touches a not-free cell.
    #[must_use]
    pub fn link_squared_doubled(&self, a: Cell, b: Cell) -> u32 {
        let ends = self.squared_doubled(a).min(self.squared_doubled(b));
        self.corner_beside(a, b, ends)
            .map_or(ends, |(squared_doubled, _)| squared_doubled)
    }

    /// The free cells.
    pub(crate) const fn free_cells(&self) -> &'a BitImage {
        self.free
    }

    /// The set cells of an image, in raster order.
    pub(crate) fn cells_of(image: &BitImage) -> impl Iterator<Item = Cell> + '_ {
        let stride = image.stride().max(1);
        image
            .words()
            .iter()
            .enumerate()
            .flat_map(move |(k, &word)| {
                let (row, col) = ((k / stride) as u32, (k % stride) as u32 * 64);
                std::iter::successors(Some(word), |&rest| Some(rest & (rest.wrapping_sub(1))))
                    .take_while(|&rest| rest != 0)
                    .map(move |rest| Cell::new(col + rest.trailing_zeros(), row))
            })
    }

    /// The neighbours of a cell on the grid, clockwise from east; every second one is diagonal.
    pub(crate) fn neighbours(&self, cell: Cell) -> impl Iterator<Item = Cell> + use<> {
        let (width, height) = (self.free.width() as u32, self.free.height() as u32);
        STEPS.into_iter().filter_map(move |(dx, dy)| {
            let col = cell.col.checked_add_signed(dx).filter(|&col| col < width)?;
            let row = cell
                .row
                .checked_add_signed(dy)
                .filter(|&row| row < height)?;
            Some(Cell::new(col, row))
        })
    }

    /// The admissible way between two admissible 8-neighbours: straight, or round by a cell beside a
    /// diagonal link that is not admissible; `None` if there is neither.
    pub(crate) fn way(&self, a: Cell, b: Cell) -> Option<Option<Cell>> {
        if self.links(a, b) {
            return Some(None);
        }
        [Cell::new(b.col, a.row), Cell::new(a.col, b.row)]
            .into_iter()
            .find(|&cell| self.has(cell))
            .map(Some)
    }

    /// The not-free square beside a diagonal link that is nearer to the link than its ends, whose lesser
    /// `(2 d)^2` is `ends`: its own `(2 d)^2` and its corner nearest to the link.
    pub(crate) fn corner_beside(&self, a: Cell, b: Cell, ends: u32) -> Option<(u32, GridPoint)> {
        if ends == 0 || a.col == b.col || a.row == b.row {
            return None;
        }
        let j = beside_at_least(ends) - 1;
        if 8 * j * j + 2 < ends {
            return None;
        }
        let side = self
            .beside(a, b, j)
            .into_iter()
            .position(|cell| !self.is_free(cell))?;
        // along the anti-diagonal from the midpoint, which is a corner of the grid
        let (col, row) = (f64::from(a.col.max(b.col)), f64::from(a.row.max(b.row)));
        let falling = (a.col < b.col) == (a.row < b.row);
        let away = f64::from(j);
        let (right, down) = match (falling, side) {
            (true, 0) => (away, -away),
            (true, _) => (-away, away),
            (false, 0) => (-away, -away),
            (false, _) => (away, away),
        };
        let corner = GridPoint {
            col: col + right,
            row: row + down,
        };
        Some((8 * j * j, corner))
    }

    /// Whether one of the two `j`-th squares beside a diagonal link is not free.
    fn blocked_beside(&self, a: Cell, b: Cell, j: u32) -> bool {
        self.beside(a, b, j)
            .into_iter()
            .any(|cell| !self.is_free(cell))
    }

    fn is_free(&self, cell: Option<Cell>) -> bool {
        cell.is_some_and(|cell| self.free.get(cell.col as usize, cell.row as usize))
    }

    /// The two `j`-th squares beside a diagonal link; `None` outside the grid of `u32`.
    pub(crate) fn beside(&self, a: Cell, b: Cell, j: u32) -> [Option<Cell>; 2] {
        let (left, right) = (a.col.min(b.col), a.col.max(b.col));
        let (top, bottom) = (a.row.min(b.row), a.row.max(b.row));
        let falling = (a.col < b.col) == (a.row < b.row);
        let cell = |col: Option<u32>, row: Option<u32>| Some(Cell::new(col?, row?));
        if falling {
            [
                cell(right.checked_add(j), top.checked_sub(j)),
                cell(left.checked_sub(j), bottom.checked_add(j)),
            ]
        } else {
            [
                cell(left.checked_sub(j), top.checked_sub(j)),
                cell(right.checked_add(j), bottom.checked_add(j)),
            ]
        }
    }
}

/// The least `j >= 1` with `8 j^2 >= squared_doubled`.
fn beside_at_least(squared_doubled: u32) -> u32 {
    let mut j = (squared_doubled / 8).isqrt();
    if 8 * j * j < squared_doubled {
        j += 1;
    }
    j.max(1)
}
