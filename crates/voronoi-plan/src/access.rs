//! The last mile: from anywhere on the lattice to the roadmap, one byte a cell.

use occgrid::{Cell, GridPoint};

use crate::ClearanceField;
use crate::lattice::{Lattice, STEPS};
use crate::roadmap::{Roadmap, Spot};
use crate::window::{Window, steps_from};

/// On a vertex of the roadmap.
const HERE: u8 = 8;
/// Not on the lattice, or in a part of it that the roadmap does not reach.
const NOWHERE: u8 = 9;

/// For every cell of the lattice the step towards the roadmap: breadth-first trees over admissible
/// links, rooted in the vertices of the arcs.
#[derive(Debug, Clone)]
pub(crate) struct Access {
    towards: Vec<u8>,
    /// Cells that hold a vertex, with it; ascending.
    spots: Vec<(u32, Spot)>,
    width: u32,
}

impl Access {
    /// Linear in the number of cells.
    pub(crate) fn new(lattice: &Lattice<'_>, road: &Roadmap, grid: Window) -> Self {
        let width = grid.high.col + 1;
        let index = |cell: Cell| cell.row as usize * width as usize + cell.col as usize;
        let mut towards = vec![NOWHERE; grid.area()];
        let mut spots: Vec<(u32, Spot)> = road
            .spots()
            .filter_map(|(spot, point)| {
                let cell = centered(point).filter(|&cell| lattice.has(cell))?;
                Some((index(cell) as u32, spot))
            })
            .collect();
        spots.sort_unstable();
        spots.dedup_by_key(|&mut (cell, _)| cell);
        let mut ring: Vec<Cell> = spots
            .iter()
            .map(|&(cell, _)| Cell::new(cell % width, cell / width))
            .collect();
        for &cell in &ring {
            towards[index(cell)] = HERE;
        }
        let mut next = Vec::new();
        while !ring.is_empty() {
            for &cell in &ring {
                for (step, other) in steps_from(cell, grid) {
                    if towards[index(other)] == NOWHERE && lattice.links(cell, other) {
                        towards[index(other)] = (step + 4) % 8;
                        next.push(other);
                    }
                }
            }
            ring.clear();
            std::mem::swap(&mut ring, &mut next);
        }
        Self {
            towards,
            spots,
            width,
        }
    }

    /// Cells that hold a vertex of the roadmap, by index, with it.
    pub(crate) fn spots(&self) -> &[(u32, Spot)] {
        &self.spots
    }

    /// The cells from `cell` to the roadmap, both ends included, and where it is entered; `None` off the
    /// lattice and where the roadmap has no part in this part of the lattice.
    pub(crate) fn walk(&self, cell: Cell) -> Option<(Vec<Cell>, Spot)> {
        let mut walk = vec![cell];
        let mut at = cell;
        loop {
            let index = at.row * self.width + at.col;
            match self.towards[index as usize] {
                HERE => {
                    let i = self
                        .spots
                        .binary_search_by_key(&index, |&(cell, _)| cell)
                        .ok()?;
                    return Some((walk, self.spots[i].1));
                }
                NOWHERE => return None,
                step => {
                    let (dc, dr) = STEPS[usize::from(step)];
                    at = Cell::new(
                        at.col.checked_add_signed(dc)?,
                        at.row.checked_add_signed(dr)?,
                    );
                    walk.push(at);
                }
            }
        }
    }
}

/// The cells of the lattice that can be reached straight from a point, nearest first: those at most two
/// cells away whose centre the point sees with `min` clearance.
pub(crate) fn entries(
    lattice: &Lattice<'_>,
    field: &ClearanceField,
    point: GridPoint,
    min: f64,
) -> Vec<Cell> {
    let (col, row) = (point.col as i64, point.row as i64);
    let mut found = Vec::new();
    for r in row - 2..=row + 2 {
        for c in col - 2..=col + 2 {
            let (Ok(c), Ok(r)) = (u32::try_from(c), u32::try_from(r)) else {
                continue;
            };
            let cell = Cell::new(c, r);
            if lattice.has(cell) && field.segment_is_clear(point, center(cell), min) {
                found.push(cell);
            }
        }
    }
    let far = |cell: &Cell| crate::square::squared_distance(center(*cell), point);
    found.sort_by(|a, b| far(a).total_cmp(&far(b)));
    found
}

/// The centre of a cell.
pub(crate) fn center(cell: Cell) -> GridPoint {
    GridPoint {
        col: f64::from(cell.col) + 0.5,
        row: f64::from(cell.row) + 0.5,
    }
}

/// The cell of which a point is the centre.
fn centered(p: GridPoint) -> Option<Cell> {
    let is_center = |v: f64| v >= 0.0 && (v - v.floor() - 0.5).abs() < 1e-12;
    (is_center(p.col) && is_center(p.row)).then(|| Cell::new(p.col as u32, p.row as u32))
}
