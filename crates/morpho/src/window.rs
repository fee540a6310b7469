//! The one kernel under erosion and dilation: meet (and) or join (or) over a window, 64 pixels a
//! word.
//!
//! A window of k columns takes log2 k steps: from the meets over 2^j columns follow those over
//! 2^(j+1), and two of the largest power below k overlap to k. A rectangle's rows meet first, by the
//! suffixes and prefixes of blocks (van Herk 1992, Gil and Werman 1993: three operations whatever the
//! height); an arbitrary element is a set of horizontal runs, of which each distinct one is made
//! once a row.

use std::marker::PhantomData;

use crate::BitImage;
use crate::element::{Element, ElementRun};
use crate::row::{self, Narrow};

/// The two operations, bit by bit.
pub(crate) trait Lattice {
    /// What changes nothing.
    const NEUTRAL: u64;
    fn meet(a: u64, b: u64) -> u64;
}

pub(crate) struct And;

impl Lattice for And {
    const NEUTRAL: u64 = u64::MAX;
    #[inline(always)]
    fn meet(a: u64, b: u64) -> u64 {
        a & b
    }
}

pub(crate) struct Or;

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
    /// See [`Levels`].
    levels: Vec<u64>,
    /// See [`Rows`]; the result, with margins, in [`scatter`].
    block: Vec<u64>,
    /// Some rows through a window.
    band: Vec<u64>,
    /// The element, as it lies.
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
    match operation {
        Operation::Erode => {
            pulp::Arch::new().dispatch(Sweep::<And>::new(image, outside, buffers, out))
        }
        Operation::Dilate => {
            pulp::Arch::new().dispatch(Sweep::<Or>::new(image, outside, buffers, out))
        }
    }
}

/// The arguments of [`sweep`], to be run with the machine's widest registers. (A struct, for a
/// closure is not inlined into the function that may use them.)
struct Sweep<'a, L> {
    image: &'a BitImage,
    outside: u64,
    buffers: &'a mut Buffers,
    out: &'a mut BitImage,
    lattice: PhantomData<L>,
}

impl<'a, L> Sweep<'a, L> {
    fn new(
        image: &'a BitImage,
        outside: u64,
        buffers: &'a mut Buffers,
        out: &'a mut BitImage,
    ) -> Self {
        Self {
            image,
            outside,
            buffers,
            out,
            lattice: PhantomData,
        }
    }
}

impl<L: Lattice> pulp::NullaryFnOnce for Sweep<'_, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        run::<L>(self.image, self.outside, self.buffers, self.out);
    }
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

/// Some rows, and their meets over powers of two of columns. Between rows lies a margin of outside,
/// no narrower than the windows reach: right of one row and left of the next, so that all rows
/// pass as one.
struct Levels<'a> {
    words: &'a mut [u64],
    /// Words a level.
    length: usize,
    margin: usize,
    /// Words from row to row.
    pitch: usize,
    stride: usize,
    seal: u64,
}

impl<'a> Levels<'a> {
    /// Room for `rows` rows.
    #[inline(always)]
    fn new(
        words: &'a mut Vec<u64>,
        image: &BitImage,
        outside: u64,
        runs: &[ElementRun],
        rows: usize,
    ) -> Self {
        let margin = margin(runs);
        let pitch = image.stride() + margin;
        let length = rows * pitch + 3 * margin + 2;
        let depth = runs.iter().map(ElementRun::power).max().unwrap_or(0) as usize + 1;
        words.clear();
        words.resize(length * depth, outside);
        Self {
            words,
            length,
            margin,
            pitch,
            stride: image.stride(),
            seal: outside & !image.tail_mask(),
        }
    }

    /// Puts a row in its place.
    #[inline(always)]
    fn load(&mut self, place: usize, row: &[u64]) {
        let words = &mut self.words[self.margin + place * self.pitch..][..self.stride];
        words.copy_from_slice(row);
        words[row.len() - 1] |= self.seal;
    }

    /// Works out the levels of the first `rows` rows, up to 2^`power` columns.
    #[inline(always)]
    fn raise<L: Lattice>(&mut self, power: u32, rows: usize) {
        let span = self.margin + rows * self.pitch;
        for level in 1..=power as usize {
            let (below, this) = self.words.split_at_mut(level * self.length);
            let below = &below[(level - 1) * self.length..];
            let shift = 1usize << (level - 1);
            let (skip, bit) = (shift / 64, (shift % 64) as u32);
            let next = View {
                near: &below[skip..],
                far: &below[skip + 1..],
                bit,
            };
            let words = below.iter().zip(next.near).zip(next.far);
            for (out, ((&word, &near), &far)) in this[..span].iter_mut().zip(words) {
                *out = L::meet(word, near >> bit | (far << 1) << (63 - bit));
            }
        }
    }

    /// The meets over the columns `dx0..=dx1` of a run for rows of `out`, [`Self::pitch`] apart.
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

    /// A level from column `dx` of the first row on.
    #[inline(always)]
    fn view<'b>(&self, level: &'b [u64], dx: isize) -> View<'b> {
        let at = (self.margin * 64).wrapping_add_signed(dx);
        View {
            near: &level[at / 64..],
            far: &level[at / 64 + 1..],
            bit: (at % 64) as u32,
        }
    }
}

/// The words that windows reach to the sides.
fn margin(runs: &[ElementRun]) -> usize {
    let reach = |run: &ElementRun| run.dx0.unsigned_abs().max(run.dx1.unsigned_abs());
    runs.iter()
        .map(reach)
        .max()
        .unwrap_or(0)
        .div_ceil(64)
        .max(1)
}

/// Words from a column that need not be the first of a word.
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
        band,
        runs,
    } = buffers;
    let run = runs[0];
    let rows = Rows::new(image, outside, run.dy, runs.len(), block);
    let Some(window) = Narrow::new(run.dx0, run.dx1) else {
        let levels = Levels::new(levels, image, outside, &runs[..1], rows.band_rows());
        return rows.filter::<L>(&mut Wide { levels, run, band }, out);
    };
    match window.power {
        0 => rows.filter::<L>(&mut OnePass::<0> { window, outside }, out),
        1 => rows.filter::<L>(&mut OnePass::<1> { window, outside }, out),
        2 => rows.filter::<L>(&mut OnePass::<2> { window, outside }, out),
        3 => rows.filter::<L>(&mut OnePass::<3> { window, outside }, out),
        4 => rows.filter::<L>(&mut OnePass::<4> { window, outside }, out),
        _ => rows.filter::<L>(&mut OnePass::<5> { window, outside }, out),
    }
}

/// What rows go through.
trait Horizontal {
    /// Some rows of `stride` words, one after the other, with one word before and one behind.
    fn filter<L: Lattice>(&mut self, rows: &[u64], stride: usize, out: &mut [u64]);
}

/// A narrow window, whose power is known.
struct OnePass<const POWER: usize> {
    window: Narrow,
    outside: u64,
}

impl<const POWER: usize> Horizontal for OnePass<POWER> {
    #[inline(always)]
    fn filter<L: Lattice>(&mut self, rows: &[u64], stride: usize, out: &mut [u64]) {
        row::filter::<L, POWER>(rows, self.window, out);
        // the words at a row's ends saw the rows above and below instead of the outside
        for first in (0..out.len()).step_by(stride) {
            let last = first + stride - 1;
            for at in [first, last] {
                let left = if at == first { self.outside } else { rows[at] };
                let right = if at == last {
                    self.outside
                } else {
                    rows[at + 2]
                };
                out[at] = row::word::<L, POWER>([left, rows[at + 1], right], self.window);
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
    fn filter<L: Lattice>(&mut self, rows: &[u64], stride: usize, out: &mut [u64]) {
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

/// The meets of the rows `y + first .. y + first + count`, for y from 0 upwards.
struct Rows<'a> {
    image: &'a BitImage,
    outside: u64,
    first: isize,
    count: usize,
    block: &'a mut Vec<u64>,
}

/// Windows up to this many rows meet directly.
const FEW_ROWS: usize = 3;

/// Words that go through the window at a time: few enough to stay in the nearest cache.
const BAND_WORDS: usize = 1024;

impl<'a> Rows<'a> {
    fn new(
        image: &'a BitImage,
        outside: u64,
        first: isize,
        count: usize,
        block: &'a mut Vec<u64>,
    ) -> Self {
        Self {
            image,
            outside,
            first,
            count,
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

    /// Rows that pass at a time.
    fn band_rows(&self) -> usize {
        (BAND_WORDS / self.image.stride()).clamp(1, self.image.height())
    }

    /// The meets through `horizontal` into `out`, some rows at a time.
    #[inline(always)]
    fn filter<L: Lattice>(self, horizontal: &mut impl Horizontal, out: &mut BitImage) {
        let stride = self.image.stride();
        let tail = self.image.tail_mask();
        let band_rows = self.band_rows();
        let mut block = std::mem::take(self.block);
        block.clear();
        block.resize((self.count + 1 + band_rows) * stride + 2, L::NEUTRAL);
        let (van_herk, band) = block.split_at_mut((self.count + 1) * stride);
        for (band_at, out) in out.words_mut().chunks_mut(band_rows * stride).enumerate() {
            let top = band_at * band_rows;
            let band = &mut band[..out.len() + 2];
            let rows = &mut band[1..=out.len()];
            if self.count > FEW_ROWS {
                for (y, row) in (top..).zip(rows.chunks_exact_mut(stride)) {
                    self.split::<L>(y, van_herk, row);
                }
            } else if self.sees_inside(top, top + out.len() / stride) {
                self.direct::<L>(top, rows);
            } else {
                for (y, row) in (top..).zip(rows.chunks_exact_mut(stride)) {
                    if self.sees_inside(y, y + 1) {
                        self.direct::<L>(y, row);
                    } else {
                        self.at_the_edge::<L>(y, row);
                    }
                }
            }
            if self.outside & !tail != 0 {
                for row in rows.chunks_exact_mut(stride) {
                    row[stride - 1] |= !tail;
                }
            }
            horizontal.filter::<L>(band, stride, out);
            if tail != u64::MAX {
                for row in out.chunks_exact_mut(stride) {
                    row[stride - 1] &= tail;
                }
            }
        }
        *self.block = block;
    }

    /// Whether the windows of the rows `top .. bottom` lie inside the image.
    #[inline(always)]
    fn sees_inside(&self, top: usize, bottom: usize) -> bool {
        let last = bottom.cast_signed() - 1 + self.first + self.count.cast_signed();
        top.cast_signed() + self.first >= 0 && last <= self.image.height().cast_signed()
    }

    /// The meets of up to three rows, for the result's rows from `top` on.
    #[inline(always)]
    fn direct<L: Lattice>(&self, top: usize, rows: &mut [u64]) {
        let stride = self.image.stride();
        let start = top.wrapping_add_signed(self.first) * stride;
        // a row that meets itself stays as it is
        let [a, b, c] =
            [0, 1, 2].map(|i| &self.image.words()[start + i.min(self.count - 1) * stride..]);
        for (out, ((&a, &b), &c)) in rows.iter_mut().zip(a.iter().zip(b).zip(c)) {
            *out = L::meet(L::meet(a, b), c);
        }
    }

    /// The meet of the rows of a window that the image's edge cuts.
    #[inline(always)]
    fn at_the_edge<L: Lattice>(&self, y: usize, out: &mut [u64]) {
        if self.outside != L::NEUTRAL {
            return out.fill(self.outside);
        }
        out.fill(L::NEUTRAL);
        let start = y.cast_signed() + self.first;
        for row in (start..start + self.count.cast_signed()).filter_map(|y| self.row(y)) {
            meet_into::<L>(out, row);
        }
    }

    /// The meet of any number of rows: the suffix of the block of rows that the window starts in
    /// and the prefix of the one it ends in. `van_herk` keeps both from row to row.
    #[inline(always)]
    fn split<L: Lattice>(&self, y: usize, van_herk: &mut [u64], out: &mut [u64]) {
        let stride = self.image.stride();
        let (prefix, suffixes) = van_herk.split_at_mut(stride);
        let start = y.cast_signed() + self.first;
        let place = y % self.count;
        if place == 0 {
            self.suffixes::<L>(start, suffixes);
            prefix.fill(L::NEUTRAL);
        } else if let Some(added) = self.row(start + self.count.cast_signed() - 1) {
            meet_into::<L>(prefix, added);
        }
        if self.sees_inside(y, y + 1) || self.outside == L::NEUTRAL {
            let suffix = &suffixes[place * stride..][..stride];
            for (out, (&a, &b)) in out.iter_mut().zip(prefix.iter().zip(suffix)) {
                *out = L::meet(a, b);
            }
        } else {
            out.fill(self.outside);
        }
    }

    /// The meets of the last 1, 2, 3 .. of the rows `start .. start + count`, the longest first.
    #[inline(always)]
    fn suffixes<L: Lattice>(&self, start: isize, suffixes: &mut [u64]) {
        let stride = self.image.stride();
        for i in (0..self.count).rev() {
            let (these, later) = suffixes.split_at_mut((i + 1) * stride);
            let suffix = &mut these[i * stride..];
            match self.row(start + i.cast_signed()) {
                Some(row) => suffix.copy_from_slice(row),
                None => suffix.fill(L::NEUTRAL),
            }
            if i + 1 < self.count {
                meet_into::<L>(suffix, &later[..stride]);
            }
        }
    }
}

#[inline(always)]
fn meet_into<L: Lattice>(out: &mut [u64], row: &[u64]) {
    for (out, &word) in out.iter_mut().zip(row) {
        *out = L::meet(*out, word);
    }
}

/// Any set of runs: each distinct pair of columns is made once for some rows, and meets the rows of
/// the result that look at them.
#[inline(always)]
fn scatter<L: Lattice>(image: &BitImage, outside: u64, buffers: &mut Buffers, out: &mut BitImage) {
    let Buffers {
        levels,
        block,
        band,
        runs,
    } = buffers;
    let height = image.height();
    let power = runs.iter().map(ElementRun::power).max().unwrap_or(0);
    let pitch = image.stride() + margin(runs);
    let band_rows = (BAND_WORDS / 2 / pitch).clamp(1, height);
    let mut levels = Levels::new(levels, image, outside, runs, band_rows);
    block.clear();
    block.resize(height * pitch, L::NEUTRAL);
    for top in (0..height).step_by(band_rows) {
        let rows = band_rows.min(height - top);
        for place in 0..rows {
            levels.load(place, image.row(top + place));
        }
        levels.raise::<L>(power, rows);
        band.resize(rows * pitch, 0);
        for group in runs.chunk_by(|a, b| (a.dx0, a.dx1) == (b.dx0, b.dx1)) {
            levels.window::<L>(&group[0], band);
            for run in group {
                // the rows of the band that some row of the image looks at
                let target = top.cast_signed() - run.dy;
                let first = (-target).clamp(0, rows.cast_signed());
                let last = (height.cast_signed() - target).clamp(first, rows.cast_signed());
                if first < last {
                    let seen = &band[first.cast_unsigned() * pitch..last.cast_unsigned() * pitch];
                    let to = (target + first).cast_unsigned() * pitch;
                    meet_into::<L>(&mut block[to..to + seen.len()], seen);
                }
            }
        }
    }
    let up = runs.iter().map(|run| -run.dy).max().unwrap_or(0).max(0);
    let down = runs.iter().map(|run| run.dy).max().unwrap_or(0).max(0);
    let inside = up.cast_unsigned()..height.saturating_sub(down.cast_unsigned());
    let tail = image.tail_mask();
    for (y, met) in block.chunks_exact(pitch).enumerate() {
        let row = out.row_mut(y);
        if outside == L::NEUTRAL || inside.contains(&y) {
            row.copy_from_slice(&met[..row.len()]);
        } else {
            row.fill(outside);
        }
        let last = row.len() - 1;
        row[last] &= tail;
    }
}
