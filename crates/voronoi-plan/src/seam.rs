//! Where two parts of the free space that nothing joins come nearest to each other.

use morpho::{BitImage, Border, Connectivity, Pixel, distance, seed_fill};
use occgrid::{Cell, GridPoint};

use crate::access::center;

/// The middle of the shortest stretch of cells that are not free between the part of `free` around `from`
/// and the part around `to`; between the two cells themselves where one of them is not free. Linear in
/// the cells of the map, with 4 bytes a cell.
pub(crate) fn seam(free: &BitImage, from: Cell, to: Cell) -> GridPoint {
    let part = |cell: Cell| seed_fill(free, pixel(cell), Connectivity::Four);
    let (near, far) = (part(from), part(to));
    let squared = distance::squared(&near.complement(), Border::Neutral);
    let width = near.width();
    let shore = (0..squared.len())
        .filter(|i| far.get(i % width, i / width))
        .min_by_key(|&i| squared[i]);
    let ends = shore.and_then(|i| {
        let there = Cell::new((i % width) as u32, (i / width) as u32);
        nearest(&near, there, squared[i]).map(|here| [here, there])
    });
    let [a, b] = ends.unwrap_or([from, to]).map(center);
    GridPoint {
        col: f64::midpoint(a.col, b.col),
        row: f64::midpoint(a.row, b.row),
    }
}

/// The first foreground cell at exactly this squared distance.
fn nearest(image: &BitImage, cell: Cell, squared: u32) -> Option<Cell> {
    let reach = squared.isqrt();
    let span = |at: u32, side: usize| {
        at.saturating_sub(reach)..=at.saturating_add(reach).min(side as u32 - 1)
    };
    span(cell.row, image.height())
        .flat_map(|row| span(cell.col, image.width()).map(move |col| Cell::new(col, row)))
        .find(|c| {
            let (dx, dy) = (c.col.abs_diff(cell.col), c.row.abs_diff(cell.row));
            dx * dx + dy * dy == squared && image.get(c.col as usize, c.row as usize)
        })
}

fn pixel(cell: Cell) -> Pixel {
    Pixel {
        x: cell.col as usize,
        y: cell.row as usize,
    }
}
