//! The widest way between two places whatever the radius: where, and how narrow, its narrowest part is.

use std::collections::BinaryHeap;

use occgrid::Cell;

use crate::lattice::Lattice;
use crate::window::{Window, steps_from};

/// The narrowest part of the widest way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Narrowest {
    /// `(2 d)^2` there.
    pub(crate) squared_doubled: u32,
    /// The link where that is; twice the same cell where it is a cell's centre.
    pub(crate) link: [Cell; 2],
}

/// The widest way from one of `from` to one of `to` over all free cells; `None` if there is none without
/// touching a cell that is not free. `lattice` is that of clearance 0. O(n log n) in the cells reached.
pub(crate) fn widest(
    lattice: &Lattice<'_>,
    grid: Window,
    from: &[Cell],
    to: &[Cell],
) -> Option<Narrowest> {
    let index = |cell: Cell| grid.index(cell) as u32;
    let mut seen = vec![false; grid.area()];
    let mut heap: BinaryHeap<(u32, u32, u32)> = from
        .iter()
        .filter(|&&cell| lattice.has(cell))
        .map(|&cell| (lattice.squared_doubled(cell), index(cell), index(cell)))
        .collect();
    let mut narrowest: Option<Narrowest> = None;
    while let Some((width, at, before)) = heap.pop() {
        if std::mem::replace(&mut seen[at as usize], true) {
            continue;
        }
        let cell = grid.cell(at as usize);
        if narrowest.is_none_or(|n| width <= n.squared_doubled) {
            narrowest = Some(Narrowest {
                squared_doubled: width,
                link: [grid.cell(before as usize), cell],
            });
        }
        if to.contains(&cell) {
            return narrowest;
        }
        for (_, other) in steps_from(cell, grid) {
            if !seen[grid.index(other)] && lattice.has(other) {
                let width = lattice.link_squared_doubled(cell, other);
                if width >= lattice.need() {
                    heap.push((width, index(other), at));
                }
            }
        }
    }
    None
}
