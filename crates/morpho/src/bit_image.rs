//! A binary image, 64 pixels a word: 1 = foreground = free.

use crate::aligned::AlignedWords;

/// The place of a pixel: column `x` from the left, row `y` from the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Pixel {
    /// Column, 0 = left.
    pub x: usize,
    /// Row, 0 = top.
    pub y: usize,
}

impl Pixel {
    /// The pixel in column `x` of row `y`.
    #[must_use]
    pub const fn new(x: usize, y: usize) -> Self {
        Self { x, y }
    }
}

/// A binary image. Bit `x % 64` of word `x / 64` of a row is pixel `x`; row 0 is the top.
///
/// Invariant: the bits past the width in each row's last word are 0.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct BitImage {
    width: usize,
    height: usize,
    stride: usize,
    words: AlignedWords,
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
            words: AlignedWords::zeros(stride * height),
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

    /// An image from its words, row after row, `width.div_ceil(64)` a row, as [`Self::words`] gives them.
    /// Bits past the width are cleared.
    ///
    /// # Panics
    /// If the number of words is not `width.div_ceil(64) * height`.
    #[must_use]
    pub fn from_words(width: usize, height: usize, words: Vec<u64>) -> Self {
        let mut image = Self::new(width, height);
        let stride = image.stride;
        assert_eq!(words.len(), stride * height, "words of {width} x {height}");
        image.words.copy_from_slice(&words);
        let tail = image.tail_mask();
        if stride > 0 {
            for row in image.words.chunks_exact_mut(stride) {
                row[stride - 1] &= tail;
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

    /// Makes this an image of the given size with no foreground, in the memory it already has
    /// where that suffices.
    pub fn reset(&mut self, width: usize, height: usize) {
        self.reshape(width, height);
        self.words.fill(0);
    }

    /// Takes the given size and leaves the words as they come: the caller writes every one.
    pub(crate) fn reshape(&mut self, width: usize, height: usize) {
        self.width = width;
        self.height = height;
        self.stride = width.div_ceil(64);
        self.words.resize(self.stride * height);
    }

    /// Becomes equal to `other` in the memory it already has where that suffices.
    pub fn copy_from(&mut self, other: &Self) {
        self.reshape(other.width, other.height);
        self.words.copy_from_slice(&other.words);
    }

    /// Exchanges foreground and background.
    pub fn invert(&mut self) {
        let tail = self.tail_mask();
        if self.stride == 0 {
            return;
        }
        for row in self.words.chunks_exact_mut(self.stride) {
            for word in row.iter_mut() {
                *word = !*word;
            }
            row[row.len() - 1] &= tail;
        }
    }

    /// The image with foreground and background exchanged.
    #[must_use]
    pub fn complement(&self) -> Self {
        let mut image = self.clone();
        image.invert();
        image
    }

    /// Keeps the foreground pixels that are foreground in `other` too.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn intersect(&mut self, other: &Self) {
        self.combine(other, |a, b| a & b);
    }

    /// Adds the foreground pixels of `other`.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn unite(&mut self, other: &Self) {
        self.combine(other, |a, b| a | b);
    }

    /// Drops the foreground pixels of `other`.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn subtract(&mut self, other: &Self) {
        self.combine(other, |a, b| a & !b);
    }

    fn combine(&mut self, other: &Self, f: impl Fn(u64, u64) -> u64) {
        assert_eq!(
            (self.width, self.height),
            (other.width, other.height),
            "images of different sizes"
        );
        for (a, &b) in self.words.iter_mut().zip(&*other.words) {
            *a = f(*a, b);
        }
    }

    /// Whether every foreground pixel is foreground in `other` too; false for another size.
    #[must_use]
    pub fn is_subset_of(&self, other: &Self) -> bool {
        (self.width, self.height) == (other.width, other.height)
            && self
                .words
                .iter()
                .zip(&*other.words)
                .all(|(a, b)| a & !b == 0)
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

/// The maximal runs `start..end` of ones in the words of a row.
pub(crate) fn runs(words: &[u64]) -> Runs<'_> {
    Runs {
        words,
        index: 0,
        rest: words.first().copied().unwrap_or(0),
    }
}

/// See [`runs`].
#[derive(Clone, Debug)]
pub(crate) struct Runs<'a> {
    words: &'a [u64],
    index: usize,
    /// What is left of the word at `index`.
    rest: u64,
}

impl Iterator for Runs<'_> {
    type Item = std::ops::Range<usize>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        while self.rest == 0 {
            self.index += 1;
            self.rest = *self.words.get(self.index)?;
        }
        let first = self.rest.trailing_zeros();
        let start = self.index * 64 + first as usize;
        // filling the zeros below the run makes the carry of + 1 stop at the run's end
        let filled = self.rest | (self.rest - 1);
        if filled != u64::MAX {
            self.rest &= filled.wrapping_add(1);
            return Some(start..self.index * 64 + filled.trailing_ones() as usize);
        }
        loop {
            self.index += 1;
            let Some(&word) = self.words.get(self.index) else {
                self.rest = 0;
                return Some(start..self.index * 64);
            };
            if word != u64::MAX {
                let ones = word.trailing_ones();
                self.rest = word & (word.wrapping_add(1));
                return Some(start..self.index * 64 + ones as usize);
            }
        }
    }
}
