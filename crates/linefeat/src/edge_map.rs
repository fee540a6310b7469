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

    /// The list from the bits and the picture.
    pub(crate) fn collect(&mut self, image: &GrayImage) {
        self.pixels.clear();
        let width = self.width as usize;
        let stride = width.div_ceil(64);
        let raw = image.as_raw();
        let height = self.height as usize;
        for v in 0..height {
            let row = |v: usize| &raw[v * width..][..width];
            let rows = [
                row(v.saturating_sub(1)),
                row(v),
                row((v + 1).min(height - 1)),
            ];
            for (w, &word) in self.words[v * stride..][..stride].iter().enumerate() {
                let mut rest = word;
                while rest != 0 {
                    let u = w * 64 + rest.trailing_zeros() as usize;
                    rest &= rest - 1;
                    let (l, r) = (u.saturating_sub(1), (u + 1).min(width - 1));
                    let [a, h, b] = rows.map(|row| [l, u, r].map(|u| i16::from(row[u])));
                    let gx = (a[2] + 2 * h[2] + b[2]) - (a[0] + 2 * h[0] + b[0]);
                    let gy = (b[0] + 2 * b[1] + b[2]) - (a[0] + 2 * a[1] + a[2]);
                    self.pixels.push(EdgePixel {
                        u: u as u32,
                        v: v as u32,
                        gx,
                        gy,
                    });
                }
            }
        }
    }

    /// 255 at edge pixels, 0 elsewhere.
    #[must_use]
    pub fn to_gray(&self) -> GrayImage {
        GrayImage::from_fn(self.width, self.height, |u, v| {
            image::Luma([if self.contains(u, v) { 255 } else { 0 }])
        })
    }
}
