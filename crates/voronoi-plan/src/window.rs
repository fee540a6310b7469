//! The shortest way over the lattice itself, inside a window: A* on admissible links.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use occgrid::Cell;

use crate::lattice::{Lattice, STEPS};

/// Cost of a step to a cell that shares a side, and to one that shares a corner: sqrt(2) to 1e-7.
pub(crate) const STEP_COST: [u32; 2] = [985, 1393];

/// A rectangle of cells, all bounds inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Window {
    pub(crate) low: Cell,
    pub(crate) high: Cell,
}

impl Window {
    /// The whole of a grid.
    pub(crate) fn whole((width, height): (u32, u32)) -> Self {
        Self {
            low: Cell::new(0, 0),
            high: Cell::new(width.saturating_sub(1), height.saturating_sub(1)),
        }
    }

    /// The window that holds all the cells, with a margin, inside a grid of the given size.
    pub(crate) fn around(cells: impl Iterator<Item = Cell>, margin: u32, size: (u32, u32)) -> Self {
        let mut low = Cell::new(u32::MAX, u32::MAX);
        let mut high = Cell::new(0, 0);
        for cell in cells {
            low = Cell::new(low.col.min(cell.col), low.row.min(cell.row));
            high = Cell::new(high.col.max(cell.col), high.row.max(cell.row));
        }
        Self {
            low: Cell::new(
                low.col.saturating_sub(margin),
                low.row.saturating_sub(margin),
            ),
            high: Cell::new(
                (high.col.saturating_add(margin)).min(size.0.saturating_sub(1)),
                (high.row.saturating_add(margin)).min(size.1.saturating_sub(1)),
            ),
        }
    }

    fn width(&self) -> usize {
        (self.high.col - self.low.col) as usize + 1
    }

    /// Cells in the window.
    pub(crate) fn area(&self) -> usize {
        self.width() * ((self.high.row - self.low.row) as usize + 1)
    }

    fn holds(&self, cell: Cell) -> bool {
        (self.low.col..=self.high.col).contains(&cell.col)
            && (self.low.row..=self.high.row).contains(&cell.row)
    }

    pub(crate) fn index(&self, cell: Cell) -> usize {
        (cell.row - self.low.row) as usize * self.width() + (cell.col - self.low.col) as usize
    }

    pub(crate) fn cell(&self, index: usize) -> Cell {
        let (row, col) = (index / self.width(), index % self.width());
        Cell::new(self.low.col + col as u32, self.low.row + row as u32)
    }
}

/// The neighbours of a cell inside a window, each with its index in [`STEPS`].
pub(crate) fn steps_from(cell: Cell, window: Window) -> impl Iterator<Item = (u8, Cell)> {
    (0_u8..8).zip(STEPS).filter_map(move |(step, (dc, dr))| {
        let col = cell.col.checked_add_signed(dc)?;
        let row = cell.row.checked_add_signed(dr)?;
        let other = Cell::new(col, row);
        window.holds(other).then_some((step, other))
    })
}

/// Memory that searches reuse.
#[derive(Debug, Default)]
pub(crate) struct WindowScratch {
    cost: Vec<u32>,
    came: Vec<u8>,
    heap: BinaryHeap<Reverse<(u32, u32)>>,
}

/// The least octile cost between two cells of an open grid.
fn octile(a: Cell, b: Cell) -> u32 {
    let (dc, dr) = (a.col.abs_diff(b.col), a.row.abs_diff(b.row));
    let diagonal = dc.min(dr);
    diagonal * STEP_COST[1] + (dc.max(dr) - diagonal) * STEP_COST[0]
}

/// How far a search goes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Only ways that cost less than this are of interest.
    pub(crate) cost: u32,
    /// Cells to expand at most.
    pub(crate) cells: usize,
}

impl Limits {
    /// To the end.
    pub(crate) const NONE: Self = Self {
        cost: u32::MAX,
        cells: usize::MAX,
    };
}

/// The shortest way between two cells inside a window, if there is one within the limits. O(n log n) in
/// the cells of the window.
pub(crate) fn search(
    lattice: &Lattice<'_>,
    window: Window,
    (from, to): (Cell, Cell),
    limits: Limits,
    scratch: &mut WindowScratch,
) -> Option<Vec<Cell>> {
    if !(window.holds(from) && window.holds(to) && lattice.has(from) && lattice.has(to)) {
        return None;
    }
    let WindowScratch { cost, came, heap } = scratch;
    cost.clear();
    cost.resize(window.area(), u32::MAX);
    came.clear();
    came.resize(window.area(), 0);
    heap.clear();
    cost[window.index(from)] = 0;
    heap.push(Reverse((octile(from, to), window.index(from) as u32)));
    let mut left = limits.cells;
    while let Some(Reverse((key, index))) = heap.pop() {
        if key >= limits.cost {
            return None;
        }
        let cell = window.cell(index as usize);
        let here = cost[index as usize];
        if key > here + octile(cell, to) {
            continue;
        }
        if cell == to {
            return Some(walk_back(window, (from, to), came));
        }
        left = left.checked_sub(1)?;
        for (step, other) in steps_from(cell, window) {
            let there = window.index(other);
            let next = here + STEP_COST[usize::from(step % 2)];
            if next < cost[there] && lattice.links(cell, other) {
                cost[there] = next;
                came[there] = step;
                heap.push(Reverse((next + octile(other, to), there as u32)));
            }
        }
    }
    None
}

fn walk_back(window: Window, (from, to): (Cell, Cell), came: &[u8]) -> Vec<Cell> {
    let mut cells = vec![to];
    let mut at = to;
    while at != from {
        let (dc, dr) = STEPS[usize::from(came[window.index(at)])];
        at = Cell::new(
            at.col.wrapping_add_signed(-dc),
            at.row.wrapping_add_signed(-dr),
        );
        cells.push(at);
    }
    cells.reverse();
    cells
}
