//! Evidence of one reading as log-odds over range: quantised, so that sums do not depend on their order.

use crate::{Reading, SonarModel, SonarModelError};

/// Every increment is a multiple of this [log-odds]. `f32` sums of such multiples are exact up to 2^24 of
/// them, that is up to 16 384.
pub(crate) const QUANTUM: f64 = 1.0 / 1024.0;

/// Bins from the first to the last evidence; the table is a power of two, its tail is 0.
const LAST_BIN: f64 = 1000.0;
const TABLE_LEN: usize = 1024;

/// From here in front of the echo on, the Gaussian is under half a quantum [sigma].
const FRONT_SIGMAS: f64 = 5.0;
/// Where the density ends behind the echo (§2.1) [sigma].
const BACK_SIGMAS: f64 = 3.0;

type Table = [f32; TABLE_LEN];

/// A sonar model prepared for one cell size.
#[derive(Debug, Clone)]
pub(crate) struct EvidenceTables {
    model: SonarModel,
    resolution: f64,
    /// Over r - d, from `-front` in steps of `bin`.
    echo: Table,
    /// Over r / listened, in steps of 1 / LAST_BIN.
    no_echo: Table,
    /// [m]
    front: f64,
    /// [m]
    back: f64,
    /// [m]
    bin: f64,
}

/// Evidence of one reading over the distance from the sonar.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RangeEvidence<'a> {
    table: &'a Table,
    /// Bins a cell.
    scale: f32,
    /// Bin at the sonar.
    offset: f32,
    /// Cells nearer than this get nothing [cells^2].
    blanking_squared: f32,
    /// Up to here the evidence is that of the first bin [cells^2]; 0 where there is no such place.
    even_squared: f32,
    /// Nothing farther than this gets any [m].
    pub(crate) reach: f64,
}

/// Log-odds as a multiple of [`QUANTUM`].
pub(crate) fn quantise(log_odds: f64) -> f32 {
    ((log_odds / QUANTUM).round() * QUANTUM) as f32
}

pub(crate) fn log_odds(p: f64) -> f64 {
    (p / (1.0 - p)).ln()
}

/// The square of the distance from which on cells get evidence [cells^2]. Cells at the very blanking distance do,
/// however their distance is rounded.
fn blanking_squared(model: &SonarModel, resolution: f64) -> f32 {
    (model.blanking * (1.0 - 1e-6) / resolution).powi(2) as f32
}

/// Over how many points of a cell's depth the evidence of an echo is averaged: enough that they are at most
/// half a sigma apart (one, the centre, for cells up to that size).
pub(crate) fn depth_samples(model: &SonarModel, resolution: f64) -> usize {
    (2.0 * resolution / model.sigma).ceil().clamp(1.0, 64.0) as usize
}

impl EvidenceTables {
    pub(crate) fn new(model: &SonarModel, resolution: f64) -> Result<Self, SonarModelError> {
        model.validate()?;
        let samples = depth_samples(model, resolution);
        let margin = if samples > 1 { 0.5 * resolution } else { 0.0 };
        let front = FRONT_SIGMAS * model.sigma + margin;
        let back = BACK_SIGMAS * model.sigma + margin;
        let bin = (front + back) / LAST_BIN;
        let tabulate = |value: &dyn Fn(f64) -> f64| {
            let mut table = [0.0; TABLE_LEN];
            for (k, entry) in table.iter_mut().enumerate().take(LAST_BIN as usize + 1) {
                *entry = quantise(value(k as f64));
            }
            table
        };
        let echo = tabulate(&|k| {
            // the last bin is still inside the density, however its place is rounded
            let end = BACK_SIGMAS * model.sigma * (1.0 - 1e-12) + margin;
            let from_echo = (k * bin - front).min(end);
            let sample = |s| {
                let depth = (s as f64 + 0.5) / samples as f64 - 0.5;
                log_odds(model.occupancy(from_echo + depth * resolution, 0.0))
            };
            (0..samples).map(sample).sum::<f64>() / samples as f64
        });
        let no_echo = tabulate(&|k| log_odds(model.occupancy_no_echo(k / LAST_BIN, 1.0)));
        Ok(Self {
            model: *model,
            resolution,
            echo,
            no_echo,
            front,
            back,
            bin,
        })
    }

    pub(crate) fn is_for(&self, model: &SonarModel, resolution: f64) -> bool {
        self.model == *model && self.resolution.to_bits() == resolution.to_bits()
    }

    /// What a reading says, or `None` where it says nothing.
    pub(crate) fn of(&self, reading: Reading) -> Option<RangeEvidence<'_>> {
        if !self.model.is_evidence(reading) {
            return None;
        }
        let (table, bin, offset, reach) = match reading {
            Reading::Echo { range } => (
                &self.echo,
                self.bin,
                (self.front - range) / self.bin,
                range + self.back,
            ),
            Reading::NoEcho { listened } => {
                let listened = listened.min(self.model.max_range);
                (&self.no_echo, listened / LAST_BIN, 0.0, listened)
            }
            Reading::TooClose | Reading::Fault => return None,
        };
        let scale = self.resolution / bin;
        // less than half a bin by more than rounding can matter
        let even = ((0.49 - offset - 1e-6 * offset.abs()) / scale).max(0.0);
        Some(RangeEvidence {
            table,
            scale: scale as f32,
            offset: offset as f32,
            even_squared: (even * even) as f32,
            blanking_squared: blanking_squared(&self.model, self.resolution),
            reach,
        })
    }
}

/// Cells in the widest vector.
const LANES: usize = 16;

/// Places in a vector.
const STEPS: [f32; LANES] = [
    0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
];

/// The last bin; empty.
const LAST: f32 = (TABLE_LEN - 1) as f32;

/// Adding 2^23 leaves the nearest integer in the low bits.
const INTEGER: f32 = 8_388_608.0;

impl RangeEvidence<'_> {
    /// Evidence for a cell whose centre is at (x, y) from the sonar [cells].
    pub(crate) fn at(&self, x: f64, y: f64) -> f32 {
        let (x, y) = (x as f32, y as f32);
        let squared = x * x + y * y;
        let place = (squared.sqrt() * self.scale + self.offset).clamp(0.0, LAST);
        let place = if squared < self.blanking_squared {
            LAST
        } else {
            place
        };
        self.table[(place + INTEGER).to_bits() as usize % TABLE_LEN]
    }

    /// Adds the evidence to a run of cells in a row `y` above the sonar [cells]. The first of them is `x` columns
    /// to the right of the sonar's, the sonar `offset` to the right of that one's centre.
    #[inline(always)]
    pub(crate) fn add_run<S: pulp::Simd>(
        &self,
        simd: S,
        cells: &mut [f32],
        x: f32,
        offset: f32,
        y: f32,
    ) {
        let y_squared = y * y;
        let steps = S::as_simd_f32s(&STEPS).0[0];
        let mut x = x;
        for run in cells.chunks_mut(S::F32_LANES) {
            let (first, last) = (x - offset, x - offset + (S::F32_LANES - 1) as f32);
            let far = if -first > last { first } else { last };
            let even = far * far + y_squared <= self.even_squared;
            if even && y_squared >= self.blanking_squared {
                let value = simd.splat_f32s(self.table[0]);
                let sums = simd.add_f32s(simd.partial_load_f32s(run), value);
                simd.partial_store_f32s(run, sums);
            } else {
                let x = simd.add_f32s(simd.splat_f32s(x), steps);
                let x = simd.sub_f32s(x, simd.splat_f32s(offset));
                let mut bins = [0; LANES];
                S::as_mut_simd_u32s(&mut bins).0[0] = self.bins(simd, x, y_squared);
                for (cell, &bin) in run.iter_mut().zip(&bins) {
                    *cell += self.table[bin as usize % TABLE_LEN];
                }
            }
            x += S::F32_LANES as f32;
        }
    }

    /// [`RangeEvidence::at`], up to the table.
    #[inline(always)]
    fn bins<S: pulp::Simd>(&self, simd: S, x: S::f32s, y_squared: f32) -> S::u32s {
        let last = simd.splat_f32s(LAST);
        let squared = simd.add_f32s(simd.mul_f32s(x, x), simd.splat_f32s(y_squared));
        let place = simd.mul_f32s(simd.sqrt_f32s(squared), simd.splat_f32s(self.scale));
        let place = simd.add_f32s(place, simd.splat_f32s(self.offset));
        let place = simd.min_f32s(simd.max_f32s(place, simd.splat_f32s(0.0)), last);
        let blank = simd.less_than_f32s(squared, simd.splat_f32s(self.blanking_squared));
        let place = simd.select_f32s(blank, last, place);
        simd.transmute_u32s_f32s(simd.add_f32s(place, simd.splat_f32s(INTEGER)))
    }
}
