//! Rectangles: rows meet first, then columns, some rows at a time so that they stay in the cache.

use crate::BitImage;
use crate::element::ElementRun;
use crate::lanes::{Near, Opening};
use crate::levels::Levels;
use crate::square;
use crate::vertical::Vertical;
use crate::window::{Buffers, Lattice};

/// Words that go through the window at a time: few enough to stay in the nearest cache.
pub(crate) const BAND_WORDS: usize = 1024;

/// What happens along the rows of a rectangle.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Along {
    /// The operation.
    Once,
    /// The operation, and then the other one over the reflected window, which takes a pixel outside
    /// for `then_outside`. For windows that are [`Opening`]s round the anchor.
    Twice { then_outside: u64 },
    /// Nothing: it is done.
    Not,
    /// Both, along the columns too. For the square of 3 x 3 pixels.
    All { then_outside: u64 },
}

/// All runs have the same columns, and their rows follow one another.
#[inline(always)]
pub(crate) fn rectangle<L: Lattice>(
    image: &BitImage,
    outside: u64,
    along: Along,
    buffers: &mut Buffers,
    out: &mut BitImage,
) {
    let Buffers {
        levels,
        block,
        band,
        strips,
        runs,
        between,
    } = buffers;
    let run = runs[0];
    if let Along::All { then_outside } = along {
        return square::twice::<L>(image, [outside, then_outside], block, between, out);
    }
    if (run, runs.len()) == (square::RUN, square::ROWS) {
        return square::once::<L>(image, outside, block, out);
    }
    let vertical = Vertical::new(image, outside, run.dy, runs.len(), strips);
    let mut pass = Pass {
        stride: image.stride(),
        rows: vertical
            .band_rows(BAND_WORDS / image.stride())
            .min(image.height()),
        tail: image.tail_mask(),
        vertical,
        block,
    };
    // a filter of words, for the window's power
    macro_rules! pass {
        ($filter:expr, $beyond:expr) => {
            pass.filter::<L>(&mut Words::new($filter, image, &run, outside, $beyond), out)
        };
    }
    match along {
        Along::Not | Along::All { .. } => pass.rows_alone::<L>(out),
        Along::Twice { then_outside } => {
            let opening = Opening::new(&run).expect("a window that can be opened by");
            match run.power() {
                0 => pass!(Open::<0>(opening), then_outside),
                1 => pass!(Open::<1>(opening), then_outside),
                2 => pass!(Open::<2>(opening), then_outside),
                3 => pass!(Open::<3>(opening), then_outside),
                _ => pass!(Open::<4>(opening), then_outside),
            }
        }
        Along::Once => {
            let Some(near) = Near::new(&run) else {
                let levels = Levels::new(levels, image, outside, &[run], pass.rows);
                return pass.filter::<L>(&mut Wide { levels, run, band }, out);
            };
            match run.power() {
                0 => pass!(Meet::<0>(near), outside),
                1 => pass!(Meet::<1>(near), outside),
                2 => pass!(Meet::<2>(near), outside),
                3 => pass!(Meet::<3>(near), outside),
                4 => pass!(Meet::<4>(near), outside),
                _ => pass!(Meet::<5>(near), outside),
            }
        }
    }
}

/// The way of the rows of an image.
struct Pass<'a> {
    vertical: Vertical<'a>,
    stride: usize,
    /// Rows that pass at a time.
    rows: usize,
    tail: u64,
    block: &'a mut Vec<u64>,
}

impl Pass<'_> {
    /// The meets of rows into `out`.
    #[inline(always)]
    fn rows_alone<L: Lattice>(&mut self, out: &mut BitImage) {
        let bands = out.words_mut().chunks_mut(self.rows * self.stride);
        for (top, out) in (0..).step_by(self.rows).zip(bands) {
            self.vertical.meets::<L>(top, out);
            self.cut(out);
        }
    }

    /// The meets of rows through `horizontal` into `out`.
    #[inline(always)]
    fn filter<L: Lattice>(&mut self, horizontal: &mut impl Horizontal, out: &mut BitImage) {
        let mut block = std::mem::take(self.block);
        block.resize(self.rows * self.stride + 2, 0);
        let bands = out.words_mut().chunks_mut(self.rows * self.stride);
        for (top, out) in (0..).step_by(self.rows).zip(bands) {
            let band = &mut block[..out.len() + 2];
            self.vertical.meets::<L>(top, &mut band[1..=out.len()]);
            horizontal.filter::<L>(band, self.stride, out);
            self.cut(out);
        }
        *self.block = block;
    }

    /// Clears the bits past the width.
    #[inline(always)]
    fn cut(&self, out: &mut [u64]) {
        if self.tail != u64::MAX {
            for row in out.chunks_exact_mut(self.stride) {
                row[self.stride - 1] &= self.tail;
            }
        }
    }
}

/// What rows go through.
trait Horizontal {
    /// Some rows of `stride` words, one after the other, with one word before and one behind.
    fn filter<L: Lattice>(&mut self, rows: &mut [u64], stride: usize, out: &mut [u64]);
}

/// A filter of which a word follows from three.
trait Word {
    fn word<L: Lattice>(&self, words: [u64; 3]) -> u64;
}

struct Meet<const POWER: usize>(Near);

impl<const POWER: usize> Word for Meet<POWER> {
    #[inline(always)]
    fn word<L: Lattice>(&self, words: [u64; 3]) -> u64 {
        self.0.meet::<L, POWER>(words)
    }
}

/// Closing is the complement of the opening of the complement.
struct Open<const POWER: usize>(Opening);

impl<const POWER: usize> Word for Open<POWER> {
    #[inline(always)]
    fn word<L: Lattice>(&self, words: [u64; 3]) -> u64 {
        let kept = self.0.kept::<POWER>(words.map(|word| word ^ !L::NEUTRAL));
        kept ^ !L::NEUTRAL
    }
}

/// Rows through a filter of words.
struct Words<F> {
    filter: F,
    /// The words left and right of a row.
    beside: [u64; 2],
    /// What the last word of a row holds past the width, and where it is inside.
    seal: u64,
    tail: u64,
}

impl<F> Words<F> {
    /// The pixels outside that a window inside sees are `outside`, those farther away `beyond`.
    fn new(filter: F, image: &BitImage, run: &ElementRun, outside: u64, beyond: u64) -> Self {
        let tail = image.tail_mask();
        let [left, right] = [-run.dx0, run.dx1].map(|reach| reach.clamp(0, 63).cast_unsigned());
        let near_left = !(u64::MAX >> left);
        let near_right = ((1_u128 << right) - 1) << (tail.count_ones() % 64);
        let [last, after] = if tail == u64::MAX {
            [0, near_right as u64]
        } else {
            [near_right as u64, (near_right >> 64) as u64]
        };
        let mix = |near: u64| outside & near | beyond & !near;
        Self {
            filter,
            beside: [mix(near_left), mix(after)],
            seal: mix(last) & !tail,
            tail,
        }
    }
}

impl<F: Word> Horizontal for Words<F> {
    #[inline(always)]
    fn filter<L: Lattice>(&mut self, rows: &mut [u64], stride: usize, out: &mut [u64]) {
        for last in (stride..=out.len()).step_by(stride) {
            rows[last] = rows[last] & self.tail | self.seal;
        }
        let words = rows.iter().zip(&rows[1..]).zip(&rows[2..]);
        for (out, ((&a, &b), &c)) in out.iter_mut().zip(words) {
            *out = self.filter.word::<L>([a, b, c]);
        }
        // the words at a row's ends saw the rows above and below instead of the outside
        for first in (0..out.len()).step_by(stride) {
            let last = first + stride - 1;
            for at in [first, last] {
                let mut words = [rows[at], rows[at + 1], rows[at + 2]];
                if at == first {
                    words[0] = self.beside[0];
                }
                if at == last {
                    words[2] = self.beside[1];
                }
                out[at] = self.filter.word::<L>(words);
            }
        }
    }
}

/// Any window.
struct Wide<'a> {
    levels: Levels<'a>,
    run: ElementRun,
    band: &'a mut Vec<u64>,
}

impl Horizontal for Wide<'_> {
    #[inline(always)]
    fn filter<L: Lattice>(&mut self, rows: &mut [u64], stride: usize, out: &mut [u64]) {
        let count = out.len() / stride;
        for (place, row) in rows[1..=out.len()].chunks_exact(stride).enumerate() {
            self.levels.load(place, row);
        }
        self.levels.raise::<L>(self.run.power(), count);
        self.band.resize(count * self.levels.pitch, 0);
        self.levels.window::<L>(&self.run, self.band);
        let windows = self.band.chunks_exact(self.levels.pitch);
        for (out, row) in out.chunks_exact_mut(stride).zip(windows) {
            out.copy_from_slice(&row[..stride]);
        }
    }
}
