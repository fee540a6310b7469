//! The square of 3 x 3 pixels, the most common element: a word follows from nine, and what goes down
//! a column of words stays in registers.

use crate::BitImage;
use crate::aligned::AlignedWords;
use crate::element::ElementRun;
use crate::rectangle::BAND_WORDS;
use crate::window::Lattice;

/// Its first run.
pub(crate) const RUN: ElementRun = ElementRun {
    dy: -1,
    dx0: -1,
    dx1: 1,
};

/// Its rows.
pub(crate) const ROWS: usize = 3;

/// The operation into `out`.
#[inline(always)]
pub(crate) fn once<L: Lattice>(
    image: &BitImage,
    outside: u64,
    block: &mut Vec<u64>,
    out: &mut BitImage,
) {
    let mut source = Source::new(image, outside, block);
    let sides = Sides::new(image, outside);
    let (stride, rows) = (image.stride(), band_rows(image));
    let bands = out.words_mut().chunks_mut(rows * stride);
    for (top, out) in (0..).step_by(rows).zip(bands) {
        sides.sweep::<L>(source.around(top, out.len() / stride), out);
    }
}

/// The operation and then the other one, which takes a pixel outside for `then_outside`, into
/// `out`. What lies between them stays in the cache.
#[inline(always)]
pub(crate) fn twice<L: Lattice>(
    image: &BitImage,
    [outside, then_outside]: [u64; 2],
    block: &mut Vec<u64>,
    between: &mut AlignedWords,
    out: &mut BitImage,
) {
    let mut source = Source::new(image, outside, block);
    let sides = Sides::new(image, outside);
    let then_sides = Sides::new(image, then_outside);
    let (stride, height, rows) = (image.stride(), image.height(), band_rows(image));
    between.resize((rows + 2) * stride + 2 + 7);
    let bands = out.words_mut().chunks_mut(rows * stride);
    for (top, out) in (0..).step_by(rows).zip(bands) {
        let count = out.len() / stride;
        let between = &mut between[7..][..out.len() + 2 * stride + 2];
        // the rows top - 1 ..= top + count, as far as there are such
        let (mut first, mut last) = (1, between.len() - 1);
        if top == 0 {
            between[1..=stride].fill(then_outside);
            first += stride;
        }
        if top + count == height {
            between[last - stride..last].fill(then_outside);
            last -= stride;
        }
        let made = &mut between[first..last];
        let around = source.around(top.saturating_sub(1), made.len() / stride);
        sides.sweep::<L>(around, made);
        then_sides.sweep::<L::Other>(between, out);
    }
}

/// Rows that pass at a time: more than elsewhere, for two of each band are made twice.
fn band_rows(image: &BitImage) -> usize {
    (2 * BAND_WORDS / image.stride()).clamp(1, image.height())
}

/// Rows of an image, also where there are none.
struct Source<'a> {
    image: &'a BitImage,
    outside: u64,
    block: &'a mut Vec<u64>,
}

impl<'a> Source<'a> {
    fn new(image: &'a BitImage, outside: u64, block: &'a mut Vec<u64>) -> Self {
        Self {
            image,
            outside,
            block,
        }
    }

    /// The rows `top - 1 ..= top + count`, and one word more before and behind, of any value.
    #[inline(always)]
    fn around(&mut self, top: usize, count: usize) -> &[u64] {
        let (stride, height) = (self.image.stride(), self.image.height());
        if top > 1 && top + count + 1 < height {
            return &self.image.words()[(top - 1) * stride - 1..(top + count + 1) * stride + 1];
        }
        self.block.clear();
        self.block.resize((count + 2) * stride + 2, self.outside);
        for (y, row) in (top..).zip(self.block[1..].chunks_exact_mut(stride)) {
            if (1..=height).contains(&y) {
                row.copy_from_slice(self.image.row(y - 1));
            }
        }
        self.block
    }
}

/// What lies beside rows.
struct Sides {
    stride: usize,
    tail: u64,
    outside: u64,
}

impl Sides {
    fn new(image: &BitImage, outside: u64) -> Self {
        Self {
            stride: image.stride(),
            tail: image.tail_mask(),
            outside,
        }
    }

    /// Makes rows of the result; `rows` has one more above and below, and one word more before and
    /// behind.
    #[inline(always)]
    fn sweep<L: Lattice>(&self, rows: &[u64], out: &mut [u64]) {
        let mut x = 0;
        while x + 8 <= self.stride {
            match (x == 0, x + 8 == self.stride) {
                (false, false) => self.columns::<L, 8, false, false>(x, rows, out),
                (true, false) => self.columns::<L, 8, true, false>(x, rows, out),
                (_, true) => self.columns::<L, 8, true, true>(x, rows, out),
            }
            x += 8;
        }
        if x + 4 <= self.stride {
            self.columns::<L, 4, true, true>(x, rows, out);
            x += 4;
        }
        for x in x..self.stride {
            self.columns::<L, 1, true, true>(x, rows, out);
        }
    }

    /// The words `x .. x + W` of the rows; `FIRST` and `LAST` if the first or the last of a
    /// row may be among them.
    #[inline(always)]
    fn columns<L: Lattice, const W: usize, const FIRST: bool, const LAST: bool>(
        &self,
        x: usize,
        rows: &[u64],
        out: &mut [u64],
    ) {
        let stride = self.stride;
        let edge = Edge::<W>::new(self, x);
        let mut above = edge.three_columns::<L, FIRST, LAST>(&rows[x..]);
        let mut here = edge.three_columns::<L, FIRST, LAST>(&rows[stride + x..]);
        for y in 0..out.len() / stride {
            let below = edge.three_columns::<L, FIRST, LAST>(&rows[(y + 2) * stride + x..]);
            let out = &mut out[y * stride + x..][..W];
            for i in 0..W {
                out[i] = L::meet(L::meet(above[i], here[i]), below[i]);
                if LAST {
                    out[i] &= !edge.past[i];
                }
            }
            above = here;
            here = below;
        }
    }
}

/// Which bits of some words of a row, and of the words left and right of each, lie outside.
struct Edge<const W: usize> {
    outside: u64,
    left: [u64; W],
    past: [u64; W],
    right: [u64; W],
}

impl<const W: usize> Edge<W> {
    #[inline(always)]
    fn new(sides: &Sides, x: usize) -> Self {
        let [mut left, mut past, mut right] = [[0; W]; 3];
        if x == 0 {
            left[0] = u64::MAX;
        }
        if x + W == sides.stride {
            past[W - 1] = !sides.tail;
            right[W - 1] = u64::MAX;
        }
        // a compiler that knows the lanes that are 0 takes the registers apart
        std::hint::black_box(Self {
            outside: sides.outside,
            left,
            past,
            right,
        })
    }

    /// The meets of three columns, for words of which the first is `row[1]`.
    #[inline(always)]
    fn three_columns<L: Lattice, const FIRST: bool, const LAST: bool>(
        &self,
        row: &[u64],
    ) -> [u64; W] {
        let row = &row[..W + 2];
        let mut met = [0; W];
        for i in 0..W {
            let [mut a, mut b, mut c] = [row[i], row[i + 1], row[i + 2]];
            if FIRST {
                a = self.fill(a, self.left[i]);
            }
            if LAST {
                b = self.fill(b, self.past[i]);
                c = self.fill(c, self.right[i]);
            }
            met[i] = L::meet(b, L::meet(b << 1 | a >> 63, b >> 1 | c << 63));
        }
        met
    }

    #[inline(always)]
    fn fill(&self, word: u64, mask: u64) -> u64 {
        word & !mask | self.outside & mask
    }
}
