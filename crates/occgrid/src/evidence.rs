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
    echo: Box<Table>,
    /// Over r / listened, in steps of 1 / LAST_BIN.
    no_echo: Box<Table>,
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
    scale: f64,
    /// Bin at the sonar.
    offset: f64,
    /// Cells nearer than this get nothing [cells^2].
    blanking_squared: f64,
    /// Up to here the evidence is that of the first bin [cells^2]; 0 where there is no such place.
    even_squared: f64,
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
            let mut table = Box::new([0.0; TABLE_LEN]);
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
        // a little less than half a bin, so that rounding cannot matter
        let even = ((0.499 - offset) / scale).max(0.0);
        Some(RangeEvidence {
            table,
            scale,
            // round numbers halfway between two bins go to the upper one, however they are rounded
            offset: offset + 1e-7,
            even_squared: even * even,
            // a cell at this very distance is not nearer, however the distance is rounded
            blanking_squared: (self.model.blanking * (1.0 - 1e-9) / self.resolution).powi(2),
            reach,
        })
    }
}

/// Cells whose bins are found together, before they are looked up: the first half is vector arithmetic, the
/// second is not.
const RUN: usize = 128;

/// Runs are padded to whole vectors.
const LANES: usize = 8;

/// Room for the bins of a run.
pub(crate) type Bins = [u32; RUN];

/// Room for bins, before any run.
pub(crate) const EMPTY_BINS: Bins = [0; RUN];

impl RangeEvidence<'_> {
    /// Evidence for a cell whose centre is at (x, y) from the sonar [cells].
    pub(crate) fn at(&self, x: f64, y: f64) -> f32 {
        let mut bin = [0];
        self.find_bins(&mut bin, x, y * y);
        self.table[bin[0] as usize % TABLE_LEN]
    }

    /// Adds the evidence to a run of cells in one row, the first of which has its centre at (x, y) from the
    /// sonar [cells].
    #[inline(always)]
    pub(crate) fn add_to(&self, cells: &mut [f32], x: f64, y: f64, bins: &mut Bins) {
        let chord = self.even_squared - y * y;
        // what fits one vector is not worth taking apart
        if chord <= 0.0 || cells.len() <= LANES {
            return self.add_looked_up(cells, x, y, bins);
        }
        // The cells in the middle, |x| <= sqrt(chord), all get the same.
        let half = chord.sqrt();
        let from = ((-half - x).ceil().max(0.0) as usize).min(cells.len());
        let to = ((half - x + 1.0).floor().max(0.0) as usize).clamp(from, cells.len());
        let (front, rest) = cells.split_at_mut(from);
        let (even, back) = rest.split_at_mut(to - from);
        self.add_looked_up(front, x, y, bins);
        self.add_even(even, x + from as f64, y);
        self.add_looked_up(back, x + to as f64, y, bins);
    }

    #[inline(always)]
    fn add_even(&self, cells: &mut [f32], x: f64, y: f64) {
        let value = self.table[0];
        let y_squared = y * y;
        if self.blanking_squared <= y_squared {
            for cell in cells {
                *cell += value;
            }
        } else {
            for (step, cell) in (0_i32..).zip(cells) {
                let x = x + f64::from(step);
                *cell += if x * x + y_squared < self.blanking_squared {
                    0.0
                } else {
                    value
                };
            }
        }
    }

    #[inline(always)]
    fn add_looked_up(&self, cells: &mut [f32], x: f64, y: f64, bins: &mut Bins) {
        let mut first = x;
        for run in cells.chunks_mut(RUN) {
            let padded = run.len().next_multiple_of(LANES);
            let mut x = first;
            for vector in bins[..padded].chunks_exact_mut(LANES) {
                self.find_bins(vector, x, y * y);
                x += LANES as f64;
            }
            for (cell, &bin) in run.iter_mut().zip(bins.iter()) {
                *cell += self.table[bin as usize % TABLE_LEN];
            }
            first += RUN as f64;
        }
    }

    #[inline(always)]
    fn find_bins(&self, bins: &mut [u32], x: f64, y_squared: f64) {
        /// Adding 2^52 leaves the nearest integer in the low bits: a conversion that vectorises.
        const INTEGER: f64 = 4_503_599_627_370_496.0;
        const LAST: f64 = (TABLE_LEN - 1) as f64;
        for (step, bin) in (0_i32..).zip(bins) {
            let x = x + f64::from(step);
            let squared = x * x + y_squared;
            let place = squared.sqrt() * self.scale + self.offset;
            let place = if place > 0.0 { place } else { 0.0 };
            let place = if place < LAST { place } else { LAST };
            let place = if squared < self.blanking_squared {
                LAST
            } else {
                place
            };
            *bin = (place + INTEGER).to_bits() as u32;
        }
    }
}
