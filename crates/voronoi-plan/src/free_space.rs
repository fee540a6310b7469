//! The free space of a map as a bit image in the map's frame: unknown is never free.

use morpho::BitImage;
use occgrid::{MapFrame, OccupancyMap};

use crate::pack::pack;

/// Which cells of a map are free, and where they are. 1 bit = 1 free cell; everything outside is not free.
#[derive(Debug, Clone)]
pub struct FreeSpace {
    frame: MapFrame,
    cells: BitImage,
}

impl FreeSpace {
    /// Free cells in a frame.
    ///
    /// # Panics
    /// If the image is not of the frame's size.
    #[must_use]
    pub fn new(frame: MapFrame, cells: BitImage) -> Self {
        assert_eq!(
            (cells.width(), cells.height()),
            (frame.width() as usize, frame.height() as usize),
            "image and frame differ in size"
        );
        Self { frame, cells }
    }

    /// The cells of a map that are known to be free.
    #[must_use]
    pub fn from_map(map: &OccupancyMap) -> Self {
        let frame = *map.frame();
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        // free is 0 <= v <= free_at_most; as u8 the negative values are above every threshold
        let cells = match u8::try_from(map.free_at_most()) {
            Ok(most) => pack(map.values(), width, height, |value| {
                value.cast_unsigned() <= most
            }),
            Err(_) => BitImage::new(width, height),
        };
        Self { frame, cells }
    }

    /// Where the cells are.
    #[must_use]
    pub const fn frame(&self) -> &MapFrame {
        &self.frame
    }

    /// The free cells.
    #[must_use]
    pub const fn cells(&self) -> &BitImage {
        &self.cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use occgrid::{Cell, CellState, Pose2};

    #[test]
    fn the_free_cells_are_those_the_map_calls_free() {
        let frame = MapFrame::new(16, 16, 0.1, Pose2::default()).expect("a frame");
        let values: Vec<i8> = (0..=255_u8).map(u8::cast_signed).collect();
        for (free, occupied) in [(25, 65), (0, 1), (-1, 50), (-128, 127), (126, 127)] {
            let map = OccupancyMap::new(frame, values.clone(), free, occupied);
            let space = FreeSpace::from_map(&map);
            for row in 0..16 {
                for col in 0..16 {
                    assert_eq!(
                        space.cells().get(col as usize, row as usize),
                        map.state(Cell::new(col, row)) == CellState::Free,
                        "{free} {occupied} {col} {row}"
                    );
                }
            }
        }
    }
}
