//! The lattice on which the refinement works: a map's own cells, or equal parts of them where they are large.
//!
//! A wall that crosses a cell of k x k parts fills about k of them. So the evidence of the cell is the mean of its k
//! largest: it is free only if no such line of parts may be wall, whatever its size.

use crate::{Cell, FrameError, GridLimits, MapFrame};

/// Size of the parts, where a map's cells are larger [m]: the scale of the blur of one echo.
const PART: f64 = 0.05;

#[derive(Debug, Clone)]
pub(super) struct Lattice {
    pub(super) fine: MapFrame,
    /// Parts along each side of a cell.
    parts: u32,
}

impl Lattice {
    /// Parts as near to [`PART`] as the limits allow.
    pub(super) fn new(frame: &MapFrame, limits: GridLimits) -> Result<Self, FrameError> {
        let room = (limits.max_cells as f64 / frame.cell_count() as f64).sqrt();
        let side = f64::from(crate::frame::MAX_SIDE_CELLS);
        let sides = side / f64::from(frame.width().max(frame.height()));
        let parts = (frame.resolution() / PART).round().min(room).min(sides);
        let parts = parts.max(1.0) as u32;
        let fine = MapFrame::new(
            frame.width() * parts,
            frame.height() * parts,
            frame.resolution() / f64::from(parts),
            frame.origin(),
        )?;
        Ok(Self { fine, parts })
    }

    /// The parts of a cell with the largest sums, as many as there are along its side.
    pub(super) fn strongest(&self, sums: &[f32], cell: Cell) -> Vec<u32> {
        let k = self.parts;
        let inside = (0..k).flat_map(|row| (0..k).map(move |col| (col, row)));
        let mut indices: Vec<u32> = inside
            .map(|(col, row)| {
                let part = Cell::new(cell.col * k + col, cell.row * k + row);
                self.fine.index(part) as u32
            })
            .collect();
        indices.sort_by(|&a, &b| sums[b as usize].total_cmp(&sums[a as usize]));
        indices.truncate(k as usize);
        indices
    }
}

/// Index of the cell of a frame at a column from the left and a row from the bottom.
pub(super) fn index_of(frame: &MapFrame, col: i64, row_up: i64) -> Option<u32> {
    let (width, height) = (i64::from(frame.width()), i64::from(frame.height()));
    let inside = col >= 0 && row_up >= 0 && col < width && row_up < height;
    inside.then(|| ((height - 1 - row_up) * width + col) as u32)
}
