//! Shots into the cells of a grid, some rows at a time.
//!
//! The rows of a large grid are far apart in memory, and a robot takes many shots in one place. So the rows are
//! gone through once for a batch of shots, and each shot adds what it has to add to a few rows while these are in
//! the cache. Every cell still gets its evidence in the order of the shots.

use std::ops::Range;

use crate::evidence::RangeEvidence;
use crate::footprint::{BLOCK_ROWS, Bounds, Footprint, RowSpans, Runs};

/// Shots that go through the rows together.
pub(crate) const BATCH: usize = 32;

const BLOCK: i64 = BLOCK_ROWS as i64;

/// A shot that is evidence, ready to be added.
#[derive(Debug)]
pub(crate) struct Prepared<'a> {
    evidence: RangeEvidence<'a>,
    footprint: Footprint,
    pub(crate) bounds: Bounds,
    /// The sonar's cell.
    cell: [i64; 2],
    /// From the centre of that cell to the sonar [cells]; exact, as places are multiples of 2^-20.
    offset: [f32; 2],
}

impl<'a> Prepared<'a> {
    pub(crate) fn new(evidence: RangeEvidence<'a>, footprint: Footprint, bounds: Bounds) -> Self {
        let apex = footprint.apex();
        let cell = apex.map(f64::floor);
        Self {
            evidence,
            footprint,
            bounds,
            cell: cell.map(|c| c as i64),
            offset: [0, 1].map(|k| (apex[k] - cell[k] - 0.5) as f32),
        }
    }
}

/// The union of two ranges of rows, if no row between them is missing.
pub(crate) fn joined(a: &Range<i64>, b: &Range<i64>) -> Option<Range<i64>> {
    (a.start <= b.end && b.start <= a.end).then(|| a.start.min(b.start)..a.end.max(b.end))
}

/// Adds shots to a grid that covers them, to be run with the machine's widest registers.
pub(crate) struct AddShots<'a> {
    shots: &'a [Prepared<'a>],
    /// All rows of the shots.
    rows: Range<i64>,
    log_odds: &'a mut [f32],
    /// Of the grid [cells].
    width: i64,
    /// Index of the lattice's cell (0, 0), were it covered.
    origin: i64,
}

impl<'a> AddShots<'a> {
    /// Shots in `rows`, for the cells of a grid.
    pub(crate) fn new(
        shots: &'a [Prepared<'a>],
        rows: Range<i64>,
        log_odds: &'a mut [f32],
        covered: &Bounds,
    ) -> Self {
        let width = covered.cols.end - covered.cols.start;
        Self {
            shots,
            rows,
            log_odds,
            width,
            origin: (covered.rows.end - 1) * width - covered.cols.start,
        }
    }
}

impl pulp::WithSimd for AddShots<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, simd: S) {
        let mut block = self.rows.start.div_euclid(BLOCK) * BLOCK;
        while block < self.rows.end {
            for shot in self.shots {
                if shot.bounds.rows.start < block + BLOCK && block < shot.bounds.rows.end {
                    self.add_block(simd, shot, block);
                }
            }
            block += BLOCK;
        }
    }
}

impl AddShots<'_> {
    /// The cells of one shot in one block of rows.
    #[inline(always)]
    fn add_block<S: pulp::Simd>(&mut self, simd: S, shot: &Prepared<'_>, block: i64) {
        let runs = shot.footprint.runs(block);
        self.fetch(&runs, block);
        for k in 0..BLOCK_ROWS {
            let j = block + k as i64;
            if runs.sure[k] == 0 {
                self.add_row(shot, j);
                continue;
            }
            let run = runs.first[k]..runs.end[k];
            if !run.is_empty() {
                let x = (run.start - shot.cell[0]) as f32;
                let y = (j - shot.cell[1]) as f32 - shot.offset[1];
                let cells = self.cells(j, &run);
                shot.evidence.add_run(simd, cells, x, shot.offset[0], y);
            }
        }
    }

    /// Asks for both ends of all runs at once, so that memory sends them together and not one after the other.
    #[inline(always)]
    fn fetch(&self, runs: &Runs, block: i64) {
        let mut bits = 0;
        for k in 0..BLOCK_ROWS {
            for i in [runs.first[k], runs.end[k] - 1] {
                // an empty or unsure run may be anywhere
                let index = self.index(i, block + k as i64);
                bits |= self.log_odds.get(index).map_or(0, |v| v.to_bits());
            }
        }
        std::hint::black_box(bits);
    }

    /// A row whose ends need care.
    #[cold]
    #[inline(never)]
    fn add_row(&mut self, shot: &Prepared<'_>, j: i64) {
        let [x, y] = shot.footprint.apex();
        let RowSpans { cone, axis } = shot.footprint.row(j);
        let y = j as f64 + 0.5 - y;
        for span in [cone].into_iter().chain(axis).filter(|s| !s.is_empty()) {
            for (i, cell) in span.clone().zip(self.cells(j, &span)) {
                *cell += shot.evidence.at(i as f64 + 0.5 - x, y);
            }
        }
    }

    /// The cells of a span of row `j`.
    #[inline(always)]
    fn cells(&mut self, j: i64, span: &Range<i64>) -> &mut [f32] {
        let from = self.index(span.start, j);
        &mut self.log_odds[from..from + (span.end - span.start) as usize]
    }

    /// Where cell (i, j) of the lattice is, if the grid covers it.
    #[inline(always)]
    fn index(&self, i: i64, j: i64) -> usize {
        (self.origin - j * self.width + i) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::EvidenceTables;
    use crate::{Pose2, Reading, SonarModel};

    const SIDE: i64 = 129;

    fn covered() -> Bounds {
        Bounds {
            cols: 0..SIDE,
            rows: 0..SIDE,
        }
    }

    /// The same shots with whatever `run` does with them.
    fn grid(shots: &[Prepared<'_>], run: impl FnOnce(AddShots<'_>)) -> Vec<u32> {
        let mut log_odds = vec![-0.0; (SIDE * SIDE) as usize];
        run(AddShots::new(shots, 0..SIDE, &mut log_odds, &covered()));
        log_odds.iter().map(|v| v.to_bits()).collect()
    }

    /// Row by row, cell by cell.
    fn careful(mut work: AddShots<'_>) {
        for shot in work.shots {
            for j in shot.bounds.rows.clone() {
                work.add_row(shot, j);
            }
        }
    }

    #[test]
    fn all_registers_give_the_same_bits() {
        let mut seed = 5_u64;
        let mut random = move || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut touched = 0;
        for case in 0..1000 {
            let model = SonarModel {
                beam_width: 0.001 * 3000_f64.powf(random()),
                sigma: 0.02 + 0.2 * random(),
                blanking: if random() < 0.5 { 0.0 } else { 0.3 * random() },
                ..SonarModel::default()
            };
            let tables = EvidenceTables::new(&model, 0.1).expect("a valid model");
            let shots: Vec<Prepared<'_>> = (0..3)
                .map(|_| {
                    let range = 0.3 + 4.5 * random();
                    let reading = if random() < 0.5 {
                        Reading::Echo { range }
                    } else {
                        Reading::NoEcho { listened: range }
                    };
                    let evidence = tables.of(reading).expect("evidence");
                    let place = Pose2::new(6.45 + 0.1 * random(), 6.45, 7.0 * random());
                    let (width, reach) = (model.beam_width, evidence.reach);
                    let footprint = Footprint::new(Pose2::default(), 0.1, place, width, reach);
                    let bounds = footprint.bounds().expect("near");
                    Prepared::new(evidence, footprint, bounds)
                })
                .collect();
            let expected = grid(&shots, careful);
            let fast = [
                grid(&shots, |work| {
                    pulp::Simd::vectorize(pulp::Scalar::new(), work)
                }),
                grid(&shots, |work| pulp::Arch::new().dispatch(work)),
                #[cfg(target_arch = "x86_64")]
                grid(&shots, |work| match pulp::x86::V3::try_new() {
                    Some(simd) => pulp::Simd::vectorize(simd, work),
                    None => careful(work),
                }),
            ];
            for found in fast {
                assert!(found == expected, "case {case}: {model:?}");
            }
            touched += expected
                .iter()
                .filter(|v| **v != (-0.0_f32).to_bits())
                .count();
        }
        assert!(touched > 100_000, "{touched}");
    }
}
