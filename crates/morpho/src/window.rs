//! The one kernel under erosion and dilation: meet (and) or join (or) over a window, 64 pixels a
//! word.
//!
//! A window of k columns takes log2 k steps: from the meets over 2^j columns follow those over
//! 2^(j+1), and two of the largest power below k overlap to k. A rectangle's rows meet first, by the
//! suffixes and prefixes of blocks (van Herk 1992, Gil and Werman 1993: three operations whatever the
//! height); an arbitrary element is a set of horizontal runs, of which each distinct one is made
//! once a row.

use crate::BitImage;
use crate::element::{Element, ElementRun};

/// The two operations, bit by bit.
trait Lattice {
    /// What changes nothing.
    const NEUTRAL: u64;
    fn meet(a: u64, b: u64) -> u64;
}

struct And;

impl Lattice for And {
    const NEUTRAL: u64 = u64::MAX;
    #[inline(always)]
    fn meet(a: u64, b: u64) -> u64 {
        a & b
    }
}

struct Or;

impl Lattice for Or {
    const NEUTRAL: u64 = 0;
    #[inline(always)]
    fn meet(a: u64, b: u64) -> u64 {
        a | b
    }
}

/// Which operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operation {
    Erode,
    Dilate,
}

/// Which way round the element lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    Upright,
    Reflected,
}

/// What the kernel keeps between calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct Buffers {
    /// The row in work, and its meets over 2, 4, 8 .. columns, each with margins.
    levels: Vec<u64>,
    /// The suffixes of a block of rows, then the prefix of the next.
    block: Vec<u64>,
    /// One row.
    row: Vec<u64>,
    runs: Vec<ElementRun>,
}

/// `operation` over the element's window, where a pixel outside the image is `outside`.
pub(crate) fn sweep(
    image: &BitImage,
    operation: Operation,
    element: &Element,
    turn: Turn,
    outside: bool,
    buffers: &mut Buffers,
    out: &mut BitImage,
) {
    let (width, height) = (image.width(), image.height());
    out.reshape(width, height);
    if width == 0 || height == 0 {
        return;
    }
    take_runs(element, turn, width, height, &mut buffers.runs);
    let outside = if outside { u64::MAX } else { 0 };
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || match operation {
            Operation::Erode => run::<And>(image, outside, buffers, out),
            Operation::Dilate => run::<Or>(image, outside, buffers, out),
        },
    );
}

/// The element's runs as they lie, sorted by columns. Offsets past the image's size look at the
/// same outside as those just past it.
fn take_runs(
    element: &Element,
    turn: Turn,
    width: usize,
    height: usize,
    runs: &mut Vec<ElementRun>,
) {
    let (w, h) = (width.cast_signed(), height.cast_signed());
    runs.clear();
    runs.extend(element.runs().iter().map(|run| {
        let ElementRun { dy, dx0, dx1 } = match turn {
            Turn::Upright => *run,
            Turn::Reflected => run.reflected(),
        };
        ElementRun {
            dy: dy.clamp(-h, h),
            dx0: dx0.clamp(-w, w),
            dx1: dx1.clamp(-w, w),
        }
    }));
    runs.sort_unstable_by_key(|run| (run.dx0, run.dx1, run.dy));
    runs.dedup();
}

#[inline(always)]
fn run<L: Lattice>(image: &BitImage, outside: u64, buffers: &mut Buffers, out: &mut BitImage) {
    let (first, last) = (buffers.runs[0], buffers.runs[buffers.runs.len() - 1]);
    let rows = last.dy - first.dy + 1;
    // sorted by columns: equal ends mean that all are equal
    let same = (first.dx0, first.dx1) == (last.dx0, last.dx1);
    if same && rows.cast_unsigned() == buffers.runs.len() {
        rectangle::<L>(image, outside, buffers, out);
    } else {
        scatter::<L>(image, outside, buffers, out);
    }
}

/// A row with margins, and its meets over powers of two of columns.
struct Levels<'a> {
    words: &'a mut [u64],
    /// Words a level.
    length: usize,
    /// Words before the image's first.
    margin: usize,
    /// Words of a level that are worked out; the image ends before, and all beyond is outside.
    span: usize,
    stride: usize,
    tail: u64,
    outside: u64,
}

impl<'a> Levels<'a> {
    #[inline(always)]
    fn new(words: &'a mut Vec<u64>, image: &BitImage, outside: u64, runs: &[ElementRun]) -> Self {
        let reach = runs
            .iter()
            .map(|run| run.dx0.unsigned_abs().max(run.dx1.unsigned_abs()))
            .max()
            .unwrap_or(0);
        let stride = image.stride();
        let margin = reach.div_ceil(64);
        let span = (margin + stride + 1).next_multiple_of(8);
        let length = (span + 2 * margin + 2).next_multiple_of(8);
        let depth = runs.iter().map(|run| run.power()).max().unwrap_or(0) as usize + 1;
        words.clear();
        words.resize(length * depth, outside);
        Self {
            words,
            length,
            margin,
            span,
            stride,
            tail: image.tail_mask(),
            outside,
        }
    }

    /// Where the image's row belongs. Its last word wants [`Self::seal`] afterwards.
    #[inline(always)]
    fn row_mut(&mut self) -> &mut [u64] {
        &mut self.words[self.margin..self.margin + self.stride]
    }

    /// Makes the bits past the width of the row outside.
    #[inline(always)]
    fn seal(&mut self) {
        let last = &mut self.words[self.margin + self.stride - 1];
        *last = *last & self.tail | self.outside & !self.tail;
    }

    /// Works out the levels up to 2^`power` columns.
    #[inline(always)]
    fn raise<L: Lattice>(&mut self, power: u32) {
        for level in 1..=power as usize {
            let (below, this) = self.words.split_at_mut(level * self.length);
            let below = &below[(level - 1) * self.length..];
            let this = &mut this[..self.span];
            let shift = 1usize << (level - 1);
            let (skip, bit) = (shift / 64, shift % 64);
            if bit == 0 {
                for (out, (&a, &b)) in this.iter_mut().zip(below.iter().zip(&below[skip..])) {
                    *out = L::meet(a, b);
                }
                continue;
            }
            let near = &below[skip..skip + self.span];
            let far = &below[skip + 1..skip + 1 + self.span];
            for (((out, &a), &b), &c) in this.iter_mut().zip(below).zip(near).zip(far) {
                *out = L::meet(a, b >> bit | c << (64 - bit));
            }
        }
    }

    /// The meets over the columns `dx0..=dx1` of a run, handed to `store` with the word to change.
    #[inline(always)]
    fn window<L: Lattice>(&self, run: &ElementRun, out: &mut [u64]) {
        let power = run.power();
        let level = &self.words[power as usize * self.length..][..self.length];
        let left = self.view(level, run.dx0);
        let right = self.view(level, run.dx1 + 1 - (1 << power));
        let (bl, br) = (left.bit, right.bit);
        let both = left
            .near
            .iter()
            .zip(left.far)
            .zip(right.near)
            .zip(right.far);
        for (out, (((&a, &b), &c), &d)) in out.iter_mut().zip(both) {
            *out = L::meet(
                a >> bl | (b << 1) << (63 - bl),
                c >> br | (d << 1) << (63 - br),
            );
        }
    }

    /// A level from column `dx` on.
    #[inline(always)]
    fn view<'b>(&self, level: &'b [u64], dx: isize) -> View<'b> {
        let at = (self.margin * 64).wrapping_add_signed(dx);
        View {
            near: &level[at / 64..][..self.stride],
            far: &level[at / 64 + 1..][..self.stride],
            bit: (at % 64) as u32,
        }
    }
}

/// A row from a column that need not be the first of a word.
struct View<'a> {
    near: &'a [u64],
    far: &'a [u64],
    bit: u32,
}

/// All runs have the same columns, and their rows follow one another.
#[inline(always)]
fn rectangle<L: Lattice>(
    image: &BitImage,
    outside: u64,
    buffers: &mut Buffers,
    out: &mut BitImage,
) {
    let Buffers {
        levels,
        block,
        runs,
        ..
    } = buffers;
    let run = runs[0];
    let mut levels = Levels::new(levels, image, outside, &runs[..1]);
    let (dy0, rows) = (run.dy, runs.len());
    let (stride, height) = (image.stride(), image.height());
    let mut vertical = Vertical::new(image, dy0, rows, outside, block);
    for y in 0..height {
        vertical.meet::<L>(y, levels.row_mut());
        levels.seal();
        levels.raise::<L>(run.power());
        let row = &mut out.words_mut()[y * stride..(y + 1) * stride];
        levels.window::<L>(&run, row);
        row[stride - 1] &= levels.tail;
    }
}

/// The meets of the rows `y + dy0 .. y + dy0 + rows`, for y from 0 upwards.
struct Vertical<'a> {
    image: &'a BitImage,
    dy0: isize,
    rows: usize,
    outside: u64,
    /// `rows` suffixes and one prefix.
    block: &'a mut [u64],
}

/// Windows up to this many rows meet directly.
const FEW_ROWS: usize = 4;

impl<'a> Vertical<'a> {
    #[inline(always)]
    fn new(
        image: &'a BitImage,
        dy0: isize,
        rows: usize,
        outside: u64,
        block: &'a mut Vec<u64>,
    ) -> Self {
        if rows > FEW_ROWS {
            block.resize((rows + 1) * image.stride(), 0);
        }
        Self {
            image,
            dy0,
            rows,
            outside,
            block,
        }
    }

    /// A row of the image; `None` outside.
    #[inline(always)]
    fn row(&self, y: isize) -> Option<&'a [u64]> {
        (0..self.image.height().cast_signed())
            .contains(&y)
            .then(|| self.image.row(y.cast_unsigned()))
    }

    #[inline(always)]
    fn meet<L: Lattice>(&mut self, y: usize, out: &mut [u64]) {
        let start = y.cast_signed() + self.dy0;
        let end = start + self.rows.cast_signed();
        if self.rows <= FEW_ROWS {
            out.fill(L::NEUTRAL);
            match (self.rows, self.row(start), self.row(end - 1)) {
                (3, Some(a), Some(c)) => {
                    let b = self.image.row((start + 1).cast_unsigned());
                    for (out, ((&a, &b), &c)) in out.iter_mut().zip(a.iter().zip(b).zip(c)) {
                        *out = L::meet(L::meet(a, b), c);
                    }
                }
                _ => {
                    for row in (start..end).filter_map(|y| self.row(y)) {
                        meet_into::<L>(out, row);
                    }
                }
            }
        } else {
            self.meet_block::<L>(y, out);
        }
        let inside = start >= 0 && end <= self.image.height().cast_signed();
        if !inside && self.outside != L::NEUTRAL {
            out.fill(self.outside);
        }
    }

    /// The suffix of the block that the window starts in, and the prefix of the block it ends in.
    #[inline(always)]
    fn meet_block<L: Lattice>(&mut self, y: usize, out: &mut [u64]) {
        let stride = self.image.stride();
        let i = y % self.rows;
        let start = y.cast_signed() + self.dy0;
        if i == 0 {
            for j in (0..self.rows).rev() {
                let (these, later) = self.block.split_at_mut((j + 1) * stride);
                let suffix = &mut these[j * stride..];
                suffix.fill(L::NEUTRAL);
                if let Some(row) = (0..self.image.height().cast_signed())
                    .contains(&(start + j.cast_signed()))
                    .then(|| self.image.row((start + j.cast_signed()).cast_unsigned()))
                {
                    suffix.copy_from_slice(row);
                }
                if j + 1 < self.rows {
                    meet_into::<L>(suffix, &later[..stride]);
                }
            }
            self.block[self.rows * stride..].fill(L::NEUTRAL);
        }
        let added = self.row(start + self.rows.cast_signed() - 1);
        let (suffixes, prefix) = self.block.split_at_mut(self.rows * stride);
        if let (Some(row), true) = (added, i > 0) {
            meet_into::<L>(prefix, row);
        }
        let suffix = &suffixes[i * stride..];
        for (out, (&a, &b)) in out.iter_mut().zip(suffix.iter().zip(&*prefix)) {
            *out = L::meet(a, b);
        }
    }
}

#[inline(always)]
fn meet_into<L: Lattice>(out: &mut [u64], row: &[u64]) {
    for (out, &word) in out.iter_mut().zip(row) {
        *out = L::meet(*out, word);
    }
}

/// Any set of runs: each distinct pair of columns is made once a row, and meets the rows of the
/// result that look at it.
#[inline(always)]
fn scatter<L: Lattice>(image: &BitImage, outside: u64, buffers: &mut Buffers, out: &mut BitImage) {
    let Buffers {
        levels, row, runs, ..
    } = buffers;
    let (stride, height) = (image.stride(), image.height());
    let power = runs.iter().map(|run| run.power()).max().unwrap_or(0);
    let mut levels = Levels::new(levels, image, outside, runs);
    row.clear();
    row.resize(stride, 0);
    let words = out.words_mut();
    words.fill(L::NEUTRAL);
    for y in 0..height {
        levels.row_mut().copy_from_slice(image.row(y));
        levels.seal();
        levels.raise::<L>(power);
        for group in runs.chunk_by(|a, b| (a.dx0, a.dx1) == (b.dx0, b.dx1)) {
            levels.window::<L>(&group[0], row);
            for run in group {
                let target = y.wrapping_add_signed(-run.dy);
                if target < height {
                    meet_into::<L>(&mut words[target * stride..][..stride], row);
                }
            }
        }
    }
    if outside != L::NEUTRAL {
        let up = runs.iter().map(|run| -run.dy).max().unwrap_or(0).max(0);
        let down = runs.iter().map(|run| run.dy).max().unwrap_or(0).max(0);
        words[..up.cast_unsigned() * stride].fill(outside);
        words[(height - down.cast_unsigned()) * stride..].fill(outside);
    }
    let tail = levels.tail;
    for row in words.chunks_exact_mut(stride) {
        row[stride - 1] &= tail;
    }
}
