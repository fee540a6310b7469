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
use crate::aligned::AlignedWords;
use crate::element::{Element, ElementRun};
use crate::lanes::Opening;
use crate::levels::{Levels, margin};
use crate::rectangle::{Along, BAND_WORDS, rectangle};
use crate::square;
use crate::vertical::Strip;

/// The two operations, bit by bit.
pub(crate) trait Lattice {
    /// What changes nothing.
    const NEUTRAL: u64;
    type Other: Lattice;
    fn meet(a: u64, b: u64) -> u64;
}

pub(crate) struct And;

impl Lattice for And {
    type Other = Or;
    const NEUTRAL: u64 = u64::MAX;
    #[inline(always)]
    fn meet(a: u64, b: u64) -> u64 {
        a & b
    }
}

pub(crate) struct Or;

impl Lattice for Or {
    type Other = And;
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
    pub(crate) levels: Vec<u64>,
    /// Some rows that have met; the result, with margins, in [`scatter`].
    pub(crate) block: Vec<u64>,
    /// Some rows through a window.
    pub(crate) band: Vec<u64>,
    /// See [`Vertical`](crate::vertical::Vertical).
    pub(crate) strips: Vec<Strip>,
    /// Some rows between the two operations of an opening.
    pub(crate) between: AlignedWords,
    /// The element, as it lies.
    pub(crate) runs: Vec<ElementRun>,
}

/// One erosion or dilation.
#[derive(Clone, Copy)]
pub(crate) struct Step<'a> {
    pub(crate) operation: Operation,
    pub(crate) element: &'a Element,
    pub(crate) turn: Turn,
    /// What a pixel outside the image is.
    pub(crate) outside: bool,
}

impl Step<'_> {
    pub(crate) fn run(&self, image: &BitImage, buffers: &mut Buffers, out: &mut BitImage) {
        self.sweep(image, Along::Once, buffers, out);
    }

    /// This step, and then the other operation with the element turned.
    pub(crate) fn run_both(
        &self,
        second: &Self,
        image: &BitImage,
        buffers: &mut Buffers,
        between: &mut BitImage,
        out: &mut BitImage,
    ) {
        let then_outside = word(second.outside);
        let [along, then_along] = match self.element.as_rectangle() {
            Some((square::RUN, square::ROWS)) => {
                return self.sweep(image, Along::All { then_outside }, buffers, out);
            }
            Some((run, _)) if Opening::new(&run).is_some() => {
                [Along::Twice { then_outside }, Along::Not]
            }
            _ => [Along::Once; 2],
        };
        self.sweep(image, along, buffers, between);
        second.sweep(between, then_along, buffers, out);
    }

    fn sweep(&self, image: &BitImage, along: Along, buffers: &mut Buffers, out: &mut BitImage) {
        let (width, height) = (image.width(), image.height());
        out.reshape(width, height);
        if width == 0 || height == 0 {
            return;
        }
        take_runs(self.element, self.turn, width, height, &mut buffers.runs);
        let outside = word(self.outside);
        let arch = pulp::Arch::new();
        match self.operation {
            Operation::Erode => arch.dispatch(Sweep {
                image,
                outside,
                along,
                buffers,
                out,
                lattice: PhantomData::<And>,
            }),
            Operation::Dilate => arch.dispatch(Sweep {
                image,
                outside,
                along,
                buffers,
                out,
                lattice: PhantomData::<Or>,
            }),
        }
    }
}

/// 64 equal pixels.
fn word(pixel: bool) -> u64 {
    if pixel { u64::MAX } else { 0 }
}

/// The arguments of [`run`], to be run with the machine's widest registers. (A struct, for a
/// closure is not inlined into the function that may use them.)
struct Sweep<'a, L> {
    image: &'a BitImage,
    outside: u64,
    along: Along,
    buffers: &'a mut Buffers,
    out: &'a mut BitImage,
    lattice: PhantomData<L>,
}

impl<L: Lattice> pulp::NullaryFnOnce for Sweep<'_, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        run::<L>(self.image, self.outside, self.along, self.buffers, self.out);
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
fn run<L: Lattice>(
    image: &BitImage,
    outside: u64,
    along: Along,
    buffers: &mut Buffers,
    out: &mut BitImage,
) {
    let (first, last) = (buffers.runs[0], buffers.runs[buffers.runs.len() - 1]);
    let rows = last.dy - first.dy + 1;
    // sorted by columns: equal ends mean that all are equal
    let same = (first.dx0, first.dx1) == (last.dx0, last.dx1);
    if same && rows.cast_unsigned() == buffers.runs.len() {
        rectangle::<L>(image, outside, along, buffers, out);
    } else {
        scatter::<L>(image, outside, buffers, out);
    }
}

#[inline(always)]
pub(crate) fn meet_into<L: Lattice>(out: &mut [u64], row: &[u64]) {
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
        ..
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
