//! Edge pixels with their gradients.

use image::GrayImage;

/// An edge pixel and the gradient there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EdgePixel {
    /// Column.
    pub u: u32,
    /// Row.
    pub v: u32,
    /// Sobel response to brighter-to-the-right, -1020 to 1020.
    pub gx: i16,
    /// Sobel response to brighter-downwards, -1020 to 1020.
    pub gy: i16,
}

/// The edge pixels of a picture: as a list in row order with gradients, and as packed bits.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EdgeMap {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) words: Vec<u64>,
    pub(crate) pixels: Vec<EdgePixel>,
}

impl EdgeMap {
    /// No edges in a picture of no size: a place for results.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Columns of the picture.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows of the picture.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The edge pixels by rows, in a row by columns.
    #[must_use]
    pub fn pixels(&self) -> &[EdgePixel] {
        &self.pixels
    }

    /// Row `v` as bits: bit `u % 64` of word `u / 64` is pixel u; bits past the width are 0.
    ///
    /// # Panics
    /// If the picture has no row `v`.
    #[must_use]
    pub fn row(&self, v: u32) -> &[u64] {
        assert!(v < self.height, "no row {v} of {}", self.height);
        let words = self.width.div_ceil(64) as usize;
        &self.words[v as usize * words..][..words]
    }

    /// Whether (u, v) is an edge pixel; nothing outside the picture is.
    #[must_use]
    pub fn contains(&self, u: u32, v: u32) -> bool {
        u < self.width && v < self.height && self.row(v)[u as usize / 64] >> (u % 64) & 1 == 1
    }

    /// 255 at edge pixels, 0 elsewhere.
    #[must_use]
    pub fn to_gray(&self) -> GrayImage {
        GrayImage::from_fn(self.width, self.height, |u, v| {
            image::Luma([if self.contains(u, v) { 255 } else { 0 }])
        })
    }
}
