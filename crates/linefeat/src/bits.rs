//! A picture of bits with room about it.

/// Words of a block, that vectors work on.
pub(crate) const BLOCK: usize = 8;

/// Rows of 64-bit words, pixel u in bit `u % 64`, with background about them: at least a word after each row,
/// a row before the first and one after the last, and a block at either end. A row's words fill blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bits {
    /// Words of a row that hold pixels.
    words_a_row: usize,
    height: usize,
    words: Vec<u64>,
}

impl Bits {
    /// Takes the size of a picture. The pixels are then those of before, or background if it had another size.
    pub(crate) fn resize(&mut self, width: usize, height: usize) {
        let words_a_row = width.div_ceil(64);
        if (words_a_row, height) != (self.words_a_row, self.height) {
            (self.words_a_row, self.height) = (words_a_row, height);
            self.words.clear();
            let size = 2 * BLOCK + (height + 2) * self.stride();
            self.words.resize(size, 0);
        }
    }

    pub(crate) fn height(&self) -> usize {
        self.height
    }

    /// From a word to the one below it.
    pub(crate) fn stride(&self) -> usize {
        (self.words_a_row + 1).next_multiple_of(BLOCK)
    }

    /// Place of the first word of row `v`.
    pub(crate) fn start(&self, v: usize) -> usize {
        BLOCK + (v + 1) * self.stride()
    }

    /// All words, those about the picture too; the latter stay 0.
    pub(crate) fn words(&self) -> &[u64] {
        &self.words
    }

    pub(crate) fn words_mut(&mut self) -> &mut [u64] {
        &mut self.words
    }

    /// The words of row `v` that hold pixels.
    pub(crate) fn row(&self, v: usize) -> &[u64] {
        &self.words[self.start(v)..][..self.words_a_row]
    }

    pub(crate) fn row_mut(&mut self, v: usize) -> &mut [u64] {
        let start = self.start(v);
        &mut self.words[start..][..self.words_a_row]
    }
}
