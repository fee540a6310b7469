//! The free space of a map as a bit image in the map's frame: unknown is never free.

use morpho::BitImage;
use occgrid::{CellState, MapFrame, OccupancyMap};

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
        let values = map.values();
        let cells = BitImage::from_fn(width, height, |x, y| {
            map.classify(values[y * width + x]) == CellState::Free
        });
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
