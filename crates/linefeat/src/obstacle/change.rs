//! Which pixels of the floor do not show what they showed in the last frame.

use super::ObstacleParams;
use super::fan::Fan;
use super::memory::Memory;
use super::shift::{Shift, Shifter};
use crate::bits::Bits;
use crate::floor_view::times;
use crate::hysteresis::{Open, follow};

/// How far an edge may be off, as a share of the change over two pixels around it: 0.4 is 0.8 px.
const MISPLACED: f64 = 0.4;

/// The share of the least difference at which a pixel that changed ones lead to has changed, too: feet
/// stand in their own shade and differ less from the floor than what is above them.
const WEAK: f64 = 0.5;

/// Blocks [px] of which changes consist: strips may be changes, specks and thin lines not.
const BLOCKS: [[usize; 2]; 2] = [[5, 2], [2, 5]];

/// Finds what has changed; keeps its buffers.
#[derive(Debug, Default)]
pub(super) struct Change {
    shifter: Shifter,
    /// Pixels that differ a little and enough, those of them that fill blocks, and corners of blocks.
    differing: [Bits; 2],
    blocks: [Bits; 2],
    corners: Bits,
    open: Open,
}

impl Change {
    /// The pixels of `current` that have changed, alone-standing thin lines apart. Above the farthest
    /// floor and outside the last frame nothing is marked.
    pub(super) fn find(
        &mut self,
        current: &Memory,
        previous: &Memory,
        warp: &[[f64; 3]; 3],
        fan: &Fan,
        params: &ObstacleParams,
    ) -> &Bits {
        let [w, h] = current.size();
        let buffers = self.differing.iter_mut().chain(&mut self.blocks);
        for bits in buffers.chain([&mut self.corners]) {
            bits.resize(w, h);
        }
        let frames = Frames {
            current,
            previous,
            warp,
            shift: self.shifter.shift(current, previous, warp, fan),
        };
        let slack = params.least_change.max(5.0 * frames.shift.noise);
        let [weak, strong] = &mut self.differing;
        for v in 0..h {
            let words = weak.row_mut(v).iter_mut().zip(strong.row_mut(v));
            let columns = fan.range[v * w..][..w].chunks(64);
            for (i, ((weak, strong), ranges)) in words.zip(columns).enumerate() {
                (*weak, *strong) = (0, 0);
                for (bit, _) in ranges.iter().enumerate().filter(|(_, r)| r.is_finite()) {
                    let excess = frames.excess([64 * i + bit, v]).unwrap_or(0.0);
                    *weak |= u64::from(excess > WEAK * slack) << bit;
                    *strong |= u64::from(excess > slack) << bit;
                }
            }
        }
        for (differing, blocks) in self.differing.iter().zip(&mut self.blocks) {
            open(differing, &mut self.corners, blocks);
        }
        let [weak, strong] = &mut self.blocks;
        follow(weak, strong, &mut self.open);
        strong
    }
}

/// A frame and an earlier one, and how they lie over each other.
struct Frames<'a> {
    current: &'a Memory,
    previous: &'a Memory,
    warp: &'a [[f64; 3]; 3],
    shift: Shift,
}

impl Frames<'_> {
    /// By how much a pixel differs, over what a misplaced edge explains [gray levels]; `None` outside the
    /// last frame.
    fn excess(&self, [u, v]: [usize; 2]) -> Option<f64> {
        let [w, h] = self.current.size();
        let [x, y, z] = times(self.warp, [u as f64, v as f64, 1.0]);
        let (pu, pv) = (x / z + self.shift.by[0], y / z + self.shift.by[1]);
        if !(pu >= 0.0 && pv >= 0.0 && pu <= (w - 1) as f64 && pv <= (h - 1) as f64) {
            return None;
        }
        let (here, there) = (v * w + u, (pv + 0.5) as usize * w + (pu + 0.5) as usize);
        let value = f64::from(self.current.smooth[here]) - self.shift.brighter;
        // either frame's edges, so that a thing is seen as large where it was as where it is
        let slope = self.current.slope[here].max(self.previous.slope[there]);
        let difference = value - self.previous.between([pu, pv]);
        Some(difference.abs() - MISPLACED * f64::from(slope))
    }
}

/// Keeps what full blocks cover.
fn open(differing: &Bits, corners: &mut Bits, into: &mut Bits) {
    let (height, stride) = (differing.height(), differing.stride());
    into.words_mut().fill(0);
    for [wide, high] in BLOCKS {
        for v in 0..(height + 1).saturating_sub(high) {
            let from = differing.start(v);
            for (i, corner) in corners.row_mut(v).iter_mut().enumerate() {
                *corner = u64::MAX;
                for row in 0..high {
                    let at = from + row * stride + i;
                    let words = &differing.words()[at..];
                    let pair = u128::from(words[0]) | u128::from(words[1]) << 64;
                    *corner &= (0..wide).fold(u64::MAX, |all, bit| all & (pair >> bit) as u64);
                }
            }
        }
        for v in 0..(height + 1).saturating_sub(high) {
            let from = corners.start(v);
            for i in 0..corners.row(v).len() {
                let words = &corners.words()[from + i - 1..];
                let pair = u128::from(words[0]) | u128::from(words[1]) << 64;
                let covered = (0..wide).fold(0, |any, bit| any | (pair << bit >> 64) as u64);
                for row in v..v + high {
                    into.row_mut(row)[i] |= covered;
                }
            }
        }
    }
}
