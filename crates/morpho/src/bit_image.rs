//! A binary image, 64 pixels a word: 1 = foreground = free.

/// A binary image. Bit `x % 64` of word `x / 64` of a row is pixel `x`; row 0 is the top.
///
/// Invariant: the bits past the width in each row's last word are 0.
#[derive(Clone, PartialEq, Eq)]
pub struct BitImage {
    width: usize,
    height: usize,
    stride: usize,
    words: Vec<u64>,
}

impl BitImage {
    /// An image with no foreground pixel. Either side may be 0.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        let stride = width.div_ceil(64);
        Self {
            width,
            height,
            stride,
            words: vec![0; stride * height],
        }
    }

    /// An image whose pixel (x, y) is `f(x, y)`.
    #[must_use]
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> bool) -> Self {
        let mut image = Self::new(width, height);
        for y in 0..height {
            for x in 0..width {
                if f(x, y) {
                    image.words[y * image.stride + x / 64] |= 1 << (x % 64);
                }
            }
        }
        image
    }

    /// Columns [pixels].
    #[must_use]
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows [pixels].
    #[must_use]
    pub const fn height(&self) -> usize {
        self.height
    }

    /// Words a row.
    #[must_use]
    pub const fn stride(&self) -> usize {
        self.stride
    }

    /// All words, row after row.
    #[must_use]
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// The words of one row.
    ///
    /// # Panics
    /// If the row is outside the image.
    #[must_use]
    pub fn row(&self, y: usize) -> &[u64] {
        &self.words[y * self.stride..(y + 1) * self.stride]
    }

    /// The words of one row, to write. The caller keeps the bits past the width 0.
    pub(crate) fn row_mut(&mut self, y: usize) -> &mut [u64] {
        &mut self.words[y * self.stride..(y + 1) * self.stride]
    }

    /// All words, to write. The caller keeps the bits past the width 0.
    pub(crate) fn words_mut(&mut self) -> &mut [u64] {
        &mut self.words
    }

    /// The bits of a row's last word that lie inside the image (all ones for width 0).
    pub(crate) const fn tail_mask(&self) -> u64 {
        match self.width % 64 {
            0 => u64::MAX,
            n => (1 << n) - 1,
        }
    }

    /// Whether pixel (x, y) is foreground; outside the image nothing is.
    #[must_use]
    pub fn get(&self, x: usize, y: usize) -> bool {
        x < self.width
            && y < self.height
            && self.words[y * self.stride + x / 64] >> (x % 64) & 1 == 1
    }

    /// Sets pixel (x, y).
    ///
    /// # Panics
    /// If the pixel is outside the image.
    pub fn set(&mut self, x: usize, y: usize, value: bool) {
        assert!(
            x < self.width && y < self.height,
            "pixel ({x}, {y}) outside {} x {}",
            self.width,
            self.height
        );
        let word = &mut self.words[y * self.stride + x / 64];
        let bit = 1 << (x % 64);
        if value {
            *word |= bit;
        } else {
            *word &= !bit;
        }
    }

    /// Foreground pixels in the image.
    #[must_use]
    pub fn count_ones(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }
}

impl std::fmt::Debug for BitImage {
    /// The size, and for small images a picture of `#` (foreground) and `.`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "BitImage {} x {}", self.width, self.height)?;
        if self.width <= 160 && self.height <= 100 {
            for y in 0..self.height {
                let line: String = (0..self.width)
                    .map(|x| if self.get(x, y) { '#' } else { '.' })
                    .collect();
                write!(f, "\n{line}")?;
            }
        }
        Ok(())
    }
}
