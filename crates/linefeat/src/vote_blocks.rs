//! Votes of all pixels of a block at once, 32 angles side by side.
//!
//! The pixels of an 8 x 8 block fall into at most 12 adjacent bins at any angle. Those are counted in
//! registers (a comparison a bin, 32 angles wide), turned into rows by angle and added to the
//! accumulator: one addition in memory for an angle instead of one for every pixel.

use crate::EdgeMap;
use crate::accumulator::Accumulator;

/// Angles side by side.
pub(crate) const LANES: usize = 32;
/// Side of a block.
const SIDE: usize = 8;
/// Bins that a block may reach.
const BINS: usize = 12;

/// Buffers of [`vote`].
#[derive(Clone, Debug, Default)]
pub(crate) struct VoteBlocks {
    /// Fixed-point rho from the block's corner: by group of angles, pixel of the block, lane.
    offsets: Vec<[i32; LANES]>,
    /// The least of these, by group.
    least: Vec<[i32; LANES]>,
    /// The edge pixels of each block of a band, and how many.
    members: Vec<[u8; SIDE * SIDE]>,
    counts: Vec<u8>,
}

/// Adds the votes of `edges` at all angles. False, and nothing done, if this machine or the bins do not
/// suit.
pub(crate) fn vote(votes: &mut Accumulator, edges: &EdgeMap, blocks: &mut VoteBlocks) -> bool {
    let suits = (SIDE - 1) as f64 * std::f64::consts::SQRT_2 / votes.rho_px < (BINS - 2) as f64;
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if suits && let Some(simd) = pulp::x86::V3::try_new() {
        blocks.prepare(votes, edges);
        simd.vectorize(wide::Bands {
            simd,
            votes,
            edges,
            blocks,
        });
        return true;
    }
    let _ = (suits, edges, blocks);
    false
}

impl VoteBlocks {
    fn prepare(&mut self, votes: &Accumulator, edges: &EdgeMap) {
        let table = &votes.table;
        self.offsets.clear();
        self.least.clear();
        for first in (0..votes.angles).step_by(LANES) {
            let (cos, sin) = (&table.cos[first..][..LANES], &table.sin[first..][..LANES]);
            for place in 0..SIDE * SIDE {
                let (du, dv) = ((place % SIDE) as i32, (place / SIDE) as i32);
                self.offsets
                    .push(std::array::from_fn(|i| du * cos[i] + dv * sin[i]));
            }
            let far = SIDE as i32 - 1;
            self.least.push(std::array::from_fn(|i| {
                far * (cos[i].min(0) + sin[i].min(0))
            }));
        }
        let across = (edges.width() as usize).div_ceil(SIDE);
        self.members.resize(across, [0; SIDE * SIDE]);
        self.counts.clear();
        self.counts.resize(across, 0);
    }
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
mod wide {
    use super::{BINS, LANES, SIDE, VoteBlocks};
    use crate::EdgeMap;
    use crate::accumulator::Accumulator;
    use pulp::cast;
    use pulp::x86::V3;
    use std::arch::x86_64::__m256i;

    pub(super) struct Bands<'a> {
        pub(super) simd: V3,
        pub(super) votes: &'a mut Accumulator,
        pub(super) edges: &'a EdgeMap,
        pub(super) blocks: &'a mut VoteBlocks,
    }

    impl pulp::NullaryFnOnce for Bands<'_> {
        type Output = ();

        #[inline(always)]
        fn call(self) {
            let Self {
                simd,
                votes,
                edges,
                blocks,
            } = self;
            let VoteBlocks {
                members, counts, ..
            } = blocks;
            let mut rest = edges.pixels();
            while let Some(pixel) = rest.first() {
                let band = pixel.v as usize / SIDE;
                let end = ((band + 1) * SIDE) as u32;
                let mut inside = 0;
                for pixel in rest.iter().take_while(|pixel| pixel.v < end) {
                    let block = pixel.u as usize / SIDE;
                    let place = pixel.v as usize % SIDE * SIDE + pixel.u as usize % SIDE;
                    members[block][counts[block] as usize % (SIDE * SIDE)] = place as u8;
                    counts[block] += 1;
                    inside += 1;
                }
                rest = &rest[inside..];
                for (block, count) in counts.iter_mut().enumerate() {
                    let count = std::mem::take(count) as usize;
                    if count > 0 {
                        let corner = [(block * SIDE) as i32, (band * SIDE) as i32];
                        let places = &members[block][..count];
                        for group in 0..blocks.least.len() {
                            let least = &blocks.least[group];
                            let offsets = &blocks.offsets[group * SIDE * SIDE..][..SIDE * SIDE];
                            block_votes(simd, votes, group, corner, places, offsets, least);
                        }
                    }
                }
            }
        }
    }

    /// Adds the votes of a block's pixels at the angles of a group.
    #[inline(always)]
    fn block_votes(
        simd: V3,
        votes: &mut Accumulator,
        group: usize,
        corner: [i32; 2],
        places: &[u8],
        offsets: &[[i32; LANES]],
        least: &[i32; LANES],
    ) {
        let table = &votes.table;
        let first = group * LANES;
        let cos: &[i32; LANES] = table.cos[first..][..LANES].try_into().expect("that long");
        let sin: &[i32; LANES] = table.sin[first..][..LANES].try_into().expect("that long");
        let zero: &[u32; LANES] = table.zero[first..][..LANES].try_into().expect("that long");
        let (fraction, half) = (table.fraction, (1 << table.fraction) >> 1);
        let mut base = [0i32; LANES];
        let mut bins = [0u32; LANES];
        for i in 0..LANES {
            let sum = corner[0]
                .wrapping_mul(cos[i])
                .wrapping_add(corner[1].wrapping_mul(sin[i]));
            let rounded = sum.wrapping_add(half);
            let low = rounded.wrapping_add(least[i]) >> fraction;
            base[i] = rounded.wrapping_sub(low << fraction);
            bins[i] = zero[i].wrapping_add_signed(low);
        }
        let counted = count(simd, fraction, base, places, offsets);
        let rows = turned(simd, counted);
        let angles = LANES.min(votes.angles - first);
        for (i, &bin) in bins[..angles].iter().enumerate() {
            let [low, high]: [[u8; 16]; 2] = cast(rows[i % 16]);
            let row = if i < 16 { low } else { high };
            let Some(window) = votes.bins.get_mut(bin as usize..bin as usize + 16) else {
                continue;
            };
            let window: &mut [u16; 16] = window.try_into().expect("16 bins");
            let more = simd.avx2._mm256_cvtepu8_epi16(cast(row));
            *window = cast(simd.avx2._mm256_adds_epu16(cast(*window), more));
        }
    }

    /// How many of the pixels fall into each bin from the block's lowest, by lane.
    #[inline(always)]
    fn count(
        simd: V3,
        fraction: u32,
        base: [i32; LANES],
        places: &[u8],
        offsets: &[[i32; LANES]],
    ) -> [__m256i; BINS] {
        let avx2 = simd.avx2;
        let base: [__m256i; 4] = cast(base);
        let shift = simd.sse2._mm_cvtsi32_si128(fraction as i32);
        let names: [__m256i; BINS] = std::array::from_fn(|bin| cast([bin as u8; LANES]));
        let mut counted: [__m256i; BINS] = [cast([0u8; LANES]); BINS];
        let order = cast([0i32, 4, 1, 5, 2, 6, 3, 7]);
        for &place in places {
            let offsets: [__m256i; 4] = cast(offsets[place as usize % (SIDE * SIDE)]);
            let bin =
                |i: usize| avx2._mm256_sra_epi32(avx2._mm256_add_epi32(base[i], offsets[i]), shift);
            let words = avx2._mm256_packs_epi32(bin(0), bin(1));
            let more = avx2._mm256_packs_epi32(bin(2), bin(3));
            let bytes = avx2._mm256_packs_epi16(words, more);
            let bytes = avx2._mm256_permutevar8x32_epi32(bytes, order);
            for (counted, &name) in counted.iter_mut().zip(&names) {
                // equal is -1
                *counted = avx2._mm256_sub_epi8(*counted, avx2._mm256_cmpeq_epi8(bytes, name));
            }
        }
        counted
    }

    /// Both halves of 16 rows (the last ones 0), each transposed.
    #[inline(always)]
    fn turned(simd: V3, counted: [__m256i; BINS]) -> [__m256i; 16] {
        let zero: __m256i = cast([0u8; LANES]);
        let mut rows: [__m256i; 16] =
            std::array::from_fn(|i| if i < BINS { counted[i] } else { zero });
        for _ in 0..4 {
            rows = std::array::from_fn(|i| {
                let (a, b) = (rows[i / 2], rows[i / 2 + 8]);
                if i % 2 == 0 {
                    simd.avx2._mm256_unpacklo_epi8(a, b)
                } else {
                    simd.avx2._mm256_unpackhi_epi8(a, b)
                }
            });
        }
        rows
    }
}
