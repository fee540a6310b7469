//! Clearances of a skeleton's cells only: what a roadmap is made from.

use morpho::{BitImage, Border, distance::sampled_to_squares};
use occgrid::Cell;

/// An image whose set pixels are numbered in raster order.
#[derive(Debug)]
pub(crate) struct Ranked<'a> {
    image: &'a BitImage,
    /// Number of the first pixel of each word.
    first: Vec<u32>,
    count: usize,
}

impl<'a> Ranked<'a> {
    pub(crate) fn new(image: &'a BitImage) -> Self {
        let mut count = 0;
        let first = image.words().iter().map(|word| {
            let before = count;
            if *word != 0 {
                count += word.count_ones();
            }
            before
        });
        Self {
            image,
            first: first.collect(),
            count: count as usize,
        }
    }

    pub(crate) const fn image(&self) -> &'a BitImage {
        self.image
    }

    /// How many pixels are set.
    pub(crate) const fn count(&self) -> usize {
        self.count
    }

    /// The number of a pixel, which must be inside the image; `None` if it is not set.
    pub(crate) fn rank(&self, cell: Cell) -> Option<usize> {
        let (x, y) = (cell.col as usize, cell.row as usize);
        let k = y * self.image.stride() + x / 64;
        let word = self.image.words()[k];
        let before = word & ((1 << (x % 64)) - 1);
        (word >> (x % 64) & 1 == 1).then(|| self.first[k] as usize + before.count_ones() as usize)
    }
}

/// The clearances of an image's set cells.
#[derive(Debug)]
pub(crate) struct Samples<'a> {
    cells: &'a Ranked<'a>,
    squared_doubled: Vec<u32>,
}

impl<'a> Samples<'a> {
    pub(crate) fn new(free: &BitImage, cells: &'a Ranked<'a>) -> Self {
        Self {
            cells,
            squared_doubled: sampled_to_squares(free, cells.image, Border::Background),
        }
    }

    /// `(2 d)^2` of a cell of the map, if it is among the samples.
    pub(crate) fn squared_doubled(&self, cell: Cell) -> Option<u32> {
        self.cells.rank(cell).map(|rank| self.squared_doubled[rank])
    }
}
