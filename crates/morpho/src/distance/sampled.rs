//! Distances of chosen pixels only, in memory that fits in a cache.
//!
//! Distances along the columns are held for a band of rows at a time: a first walk from the bottom to
//! the top leaves those to the background below each band.

use std::marker::PhantomData;

use super::transform::{BLOCK, FAR, Metric, step};
use crate::{BitImage, Border};

/// Rows of a band.
const BAND: usize = 64;
/// Columns that a pixel looks at together, on either side.
const CHUNK: usize = 32;

/// The distances of the pixels of `wanted`, in raster order. `image` and `wanted` are of one size.
pub(super) fn sample<M: Metric>(image: &BitImage, wanted: &BitImage, border: Border) -> Vec<u32> {
    if wanted.words().is_empty() {
        return Vec::new();
    }
    let outside = match border {
        Border::Background => 0,
        Border::Neutral | Border::Foreground => u16::MAX,
    };
    pulp::Arch::new().dispatch(Job::<M> {
        image,
        wanted,
        outside,
        metric: PhantomData,
    })
}

/// The work as a type: a closure would be compiled apart, without the wide vectors.
struct Job<'a, M> {
    image: &'a BitImage,
    wanted: &'a BitImage,
    outside: u16,
    metric: PhantomData<M>,
}

impl<M: Metric> pulp::NullaryFnOnce for Job<'_, M> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn call(self) -> Vec<u32> {
        let (image, outside) = (self.image, self.outside);
        let padded = image.stride() * BLOCK;
        let under_bands = under_bands(image, outside);
        let mut below = vec![0; BAND * padded];
        let mut above = vec![outside; padded];
        let mut finish = Row::<M>::new(image.width(), outside == 0);
        let mut samples = Vec::with_capacity(self.wanted.count_ones());
        for (band, under) in under_bands.chunks_exact(padded).enumerate() {
            let (first, end) = (band * BAND, image.height().min((band + 1) * BAND));
            let mut next = under;
            for (y, row) in (first..end).zip(below.chunks_exact_mut(padded)).rev() {
                row.copy_from_slice(next);
                step_row(image.row(y), row);
                next = row;
            }
            for (y, below) in (first..end).zip(below.chunks_exact(padded)) {
                step_row(image.row(y), &mut above);
                let wanted = self.wanted.row(y);
                if wanted.iter().any(|&word| word != 0) {
                    finish.set(&above, below);
                    finish.sample(wanted, &mut samples);
                }
            }
        }
        samples
    }
}

/// The distances to the nearest background below each band, those of the first band first.
#[inline(always)]
fn under_bands(image: &BitImage, outside: u16) -> Vec<u16> {
    let padded = image.stride() * BLOCK;
    let bands = image.height().div_ceil(BAND);
    let mut under = vec![outside; bands * padded];
    for band in (1..bands).rev() {
        let (before, after) = under.split_at_mut(band * padded);
        let run = &mut before[(band - 1) * padded..];
        run.copy_from_slice(&after[..padded]);
        for y in (band * BAND..image.height().min((band + 1) * BAND)).rev() {
            step_row(image.row(y), run);
        }
    }
    under
}

/// One row further from the background.
#[inline(always)]
fn step_row(words: &[u64], distances: &mut [u16]) {
    for (&word, distances) in words.iter().zip(distances.as_chunks_mut::<BLOCK>().0) {
        if word == 0 {
            *distances = [0; BLOCK];
        } else {
            step(word, distances);
        }
    }
}

/// The row in hand.
struct Row<M> {
    width: usize,
    /// Squared distances along the columns, with [`CHUNK`] or more of the outside on either side.
    column: Vec<u32>,
    /// The squares of -(width + CHUNK)..=width + CHUNK.
    squares: Vec<u32>,
    beside: u32,
    metric: PhantomData<M>,
}

impl<M: Metric> Row<M> {
    #[inline(always)]
    fn new(width: usize, walled: bool) -> Self {
        let beside = if walled { 0 } else { FAR };
        let reach = (width + CHUNK) as u32;
        let right = (0..=reach).map(M::square);
        Self {
            width,
            column: vec![beside; width.next_multiple_of(BLOCK) + 2 * CHUNK],
            squares: (1..=reach).rev().map(M::square).chain(right).collect(),
            beside,
            metric: PhantomData,
        }
    }

    #[inline(always)]
    fn set(&mut self, above: &[u16], below: &[u16]) {
        let pairs = above.as_chunks::<BLOCK>().0.iter();
        let pairs = pairs.zip(below.as_chunks::<BLOCK>().0);
        let blocks = self.column[CHUNK..].as_chunks_mut::<BLOCK>().0;
        for (block, (above, below)) in blocks.iter_mut().zip(pairs) {
            for i in 0..BLOCK {
                block[i] = M::square(u32::from(above[i].min(below[i])));
            }
        }
        self.column[CHUNK + self.width..].fill(self.beside);
    }

    #[inline(always)]
    fn sample(&self, wanted: &[u64], samples: &mut Vec<u32>) {
        for (k, &word) in wanted.iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                let x = k * BLOCK + rest.trailing_zeros() as usize;
                rest &= rest - 1;
                let distance = self.nearest(x);
                samples.push(if distance < FAR { distance } else { u32::MAX });
            }
        }
    }

    /// Looks outward from a pixel until nothing farther can win.
    #[inline(always)]
    fn nearest(&self, x: usize) -> u32 {
        let (here, middle) = (CHUNK + x, CHUNK + self.width);
        let mut best = self.column[here];
        let mut near = 1;
        while near <= self.width && self.squares[middle + near] < best {
            let mut lanes = [best; CHUNK];
            if near <= x + 1 {
                let reach = near + CHUNK - 1;
                self.look(here - reach, middle - reach, &mut lanes);
            }
            if x + near <= self.width {
                self.look(here + near, middle + near, &mut lanes);
            }
            best = lanes.into_iter().fold(best, u32::min);
            near += CHUNK;
        }
        best
    }

    #[inline(always)]
    fn look(&self, column: usize, square: usize, lanes: &mut [u32; CHUNK]) {
        let columns = self.column[column..].first_chunk::<CHUNK>();
        let squares = self.squares[square..].first_chunk::<CHUNK>();
        if let (Some(columns), Some(squares)) = (columns, squares) {
            for i in 0..CHUNK {
                lanes[i] = lanes[i].min(columns[i] + squares[i]);
            }
        }
    }
}
