//! The two passes.

#![expect(
    clippy::needless_range_loop,
    reason = "loops over several rows of lanes at once are what becomes vector code"
)]

use std::marker::PhantomData;

use super::envelope;
use crate::{BitImage, Border};

/// A squared distance in x or y: 0 for 0, then growing. Values from [`FAR`] on are none.
pub(super) trait Metric {
    /// The square of `n` cells along an axis, at most [`FAR`].
    fn square(n: u32) -> u32;

    /// A cell in the units whose square the metric is.
    const CELL: i64;
    /// Where the parabola that a pixel casts to its right has its vertex, in these units from the
    /// pixel's centre.
    const VERTEX: i64;
}

/// From centre to centre, in cells.
pub(super) struct Centres;

impl Metric for Centres {
    #[inline(always)]
    fn square(n: u32) -> u32 {
        let n = n.min(46_341);
        (n * n).min(FAR)
    }

    const CELL: i64 = 1;
    const VERTEX: i64 = 0;
}

/// From the centre to the other pixel's square, in half cells.
pub(super) struct Squares;

impl Metric for Squares {
    #[inline(always)]
    fn square(n: u32) -> u32 {
        Centres::square((2 * n).saturating_sub(1))
    }

    const CELL: i64 = 2;
    const VERTEX: i64 = 1;
}

/// No background within reach, inside the transform. One step of a short scan beyond it still fits.
pub(super) const FAR: u32 = (1 << 31) - 1;

/// Pixels of a block, which look outward together.
pub(super) const BLOCK: usize = 64;
/// How far a block looks before its row goes through the lower envelopes instead.
const REACH: usize = 128;
/// How many steps a block takes between looking whether it may stop.
const STRIDE: usize = 4;

/// Memory that the `_into` forms use again.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    /// Distance to the nearest background above, row after row; words without foreground are not written.
    above: Vec<u16>,
    /// Distance to the nearest background below the row in hand.
    below: Vec<u16>,
    /// Squared distance along the column for the row in hand, with [`REACH`] more on either side.
    column: Vec<u32>,
    envelope: envelope::Queue,
}

pub(super) fn transform<M: Metric>(
    image: &BitImage,
    border: Border,
    workspace: &mut Workspace,
    distances: &mut Vec<u32>,
) {
    let (width, height) = (image.width(), image.height());
    distances.resize(width * height, 0);
    if width * height == 0 {
        return;
    }
    let padded = image.stride() * BLOCK;
    workspace.above.resize(padded * height, 0);
    workspace.below.resize(padded, 0);
    workspace.column.resize(padded + 2 * REACH, 0);
    pulp::Arch::new().dispatch(Job::<M> {
        image,
        border,
        workspace,
        distances,
        metric: PhantomData,
    });
}

/// The work as a type: a closure would be compiled apart, without the wide vectors.
struct Job<'a, M> {
    image: &'a BitImage,
    border: Border,
    workspace: &'a mut Workspace,
    distances: &'a mut [u32],
    metric: PhantomData<M>,
}

impl<M: Metric> pulp::NullaryFnOnce for Job<'_, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let outside = match self.border {
            Border::Background => 0,
            Border::Neutral | Border::Foreground => u16::MAX,
        };
        look_up(self.image, outside, self.workspace);
        row_by_row::<M>(self.image, outside, self.workspace, self.distances);
    }
}

/// One row further from the background: the distances of 64 pixels.
#[inline(always)]
pub(super) fn step(word: u64, distances: &mut [u16; BLOCK]) {
    for part in 0..BLOCK / 16 {
        let bits = (word >> (16 * part)) as u16;
        for i in 0..16 {
            let at = 16 * part + i;
            let next = distances[at].saturating_add(1);
            distances[at] = if bits & (1 << i) != 0 { next } else { 0 };
        }
    }
}

/// Fills `above`, top to bottom.
#[inline(always)]
fn look_up(image: &BitImage, outside: u16, workspace: &mut Workspace) {
    let padded = image.stride() * BLOCK;
    let run = &mut workspace.below;
    run.fill(outside);
    for y in 0..image.height() {
        let above = &mut workspace.above[y * padded..(y + 1) * padded];
        let runs = run.as_chunks_mut::<BLOCK>().0;
        let aboves = above.as_chunks_mut::<BLOCK>().0;
        for ((&word, run), above) in image.row(y).iter().zip(runs).zip(aboves) {
            if word == 0 {
                *run = [0; BLOCK];
            } else {
                step(word, run);
                *above = *run;
            }
        }
    }
}

/// Finishes the rows, bottom to top.
#[inline(always)]
fn row_by_row<M: Metric>(
    image: &BitImage,
    outside: u16,
    workspace: &mut Workspace,
    distances: &mut [u32],
) {
    let (width, padded) = (image.width(), image.stride() * BLOCK);
    let Workspace {
        above,
        below,
        column,
        envelope,
    } = workspace;
    below.fill(outside);
    let beside = if outside == 0 { 0 } else { FAR };
    column.fill(beside);
    for y in (0..image.height()).rev() {
        let words = image.row(y);
        let above = above[y * padded..(y + 1) * padded].as_chunks::<BLOCK>().0;
        let blocks = column[REACH..REACH + padded].as_chunks_mut::<BLOCK>().0;
        let belows = below.as_chunks_mut::<BLOCK>().0;
        for (((&word, above), below), block) in words.iter().zip(above).zip(belows).zip(blocks) {
            if word == 0 {
                *below = [0; BLOCK];
                *block = [0; BLOCK];
            } else {
                step(word, below);
                for i in 0..BLOCK {
                    block[i] = M::square(u32::from(below[i].min(above[i])));
                }
            }
        }
        column[REACH + width..REACH + padded].fill(beside);
        let row = &mut distances[y * width..(y + 1) * width];
        let complete = scan_row::<M>(words, column, row);
        if !complete {
            envelope::row::<M>(&column[REACH..REACH + width], beside == 0, envelope, row);
        }
    }
}

/// Looks outward from each block of a row; whether [`REACH`] was enough for all.
#[inline(always)]
fn scan_row<M: Metric>(words: &[u64], column: &[u32], row: &mut [u32]) -> bool {
    for (at, &word) in words.iter().enumerate() {
        let first = at * BLOCK;
        let mut best = [0; BLOCK];
        if word != 0 {
            let Some(found) = scan_block::<M>(column, REACH + first) else {
                return false;
            };
            best = found;
        }
        match row[first..].first_chunk_mut::<BLOCK>() {
            Some(out) => *out = best,
            None => {
                let rest = row.len() - first;
                row[first..].copy_from_slice(&best[..rest]);
            }
        }
    }
    true
}

/// The distances of the 64 pixels from `first` on, if [`REACH`] is enough for them.
#[inline(always)]
fn scan_block<M: Metric>(column: &[u32], first: usize) -> Option<[u32; BLOCK]> {
    let mut best: [u32; BLOCK] = *column[first..].first_chunk()?;
    let mut k = 1;
    while k < REACH {
        let mut largest = 0;
        for i in 0..BLOCK {
            largest = if best[i] > largest { best[i] } else { largest };
        }
        if M::square(k as u32) >= largest {
            return Some(best);
        }
        for k in k..k + STRIDE {
            let across = M::square(k as u32);
            let left: &[u32; BLOCK] = column[first - k..].first_chunk()?;
            let right: &[u32; BLOCK] = column[first + k..].first_chunk()?;
            for i in 0..BLOCK {
                let side = if left[i] < right[i] {
                    left[i]
                } else {
                    right[i]
                };
                let sum = side + across;
                best[i] = if sum < best[i] { sum } else { best[i] };
            }
        }
        k += STRIDE;
    }
    None
}
