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
        Some(RangeEvidence {
            table,
            scale: self.resolution / bin,
            offset,
            blanking_squared: (self.model.blanking / self.resolution).powi(2),
            reach,
        })
    }
}

impl RangeEvidence<'_> {
    /// Evidence for a cell whose centre is at (x, y) from the sonar [cells].
    #[inline(always)]
    pub(crate) fn at(&self, x: f64, y: f64) -> f32 {
        /// Adding 2^52 leaves the nearest integer in the low bits: a conversion that vectorises.
        const INTEGER: f64 = 4_503_599_627_370_496.0;
        let squared = x * x + y * y;
        let bin = (squared.sqrt() * self.scale + self.offset)
            .max(0.0)
            .min((TABLE_LEN - 1) as f64);
        let value = self.table[(bin + INTEGER).to_bits() as usize % TABLE_LEN];
        if squared < self.blanking_squared {
            0.0
        } else {
            value
        }
    }
}
