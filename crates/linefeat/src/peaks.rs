//! Lines at the peaks of an accumulator.

use std::f64::consts::PI;

use crate::accumulator::Accumulator;
use crate::{EdgeMap, HoughParams, Line};

/// Buffers of [`Peaks::find`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Peaks {
    /// Votes, angle and bin of rho of each peak.
    found: Vec<(u16, u32, u32)>,
    /// Rho from the picture's centre of each line found.
    central: Vec<f64>,
}

impl Peaks {
    /// `lines` becomes the lines at the peaks, the strongest first.
    pub(crate) fn find(
        &mut self,
        votes: &Accumulator,
        edges: &EdgeMap,
        params: &HoughParams,
        lines: &mut Vec<Line>,
    ) {
        let least = params.votes.clamp(1, u32::from(u16::MAX)) as u16;
        self.found.clear();
        // no two neighbours are peaks
        let most = votes.angles.div_ceil(2) * (votes.reach + 1);
        self.found.reserve(most);
        pulp::Arch::new().dispatch(Scan {
            votes,
            least,
            found: &mut self.found,
        });
        self.found
            .sort_unstable_by_key(|&(votes, k, r)| (std::cmp::Reverse(votes), k, r));
        self.central.clear();
        self.central.reserve(most.min(params.lines));
        lines.clear();
        lines.reserve(most.min(params.lines));
        let centre = [edges.width(), edges.height()].map(|side| 0.5 * (f64::from(side) - 1.0));
        for &(_, k, r) in &self.found {
            if lines.len() >= params.lines {
                break;
            }
            let line = refined(votes, k as usize, r as usize);
            let (sin, cos) = line.theta.sin_cos();
            let central = line.rho - centre[0] * cos - centre[1] * sin;
            let known = lines.iter().zip(&self.central);
            if !known.into_iter().any(|(other, &from_centre)| {
                let turn = (line.theta - other.theta).abs();
                let flipped = turn > 0.5 * PI;
                let turn = if flipped { PI - turn } else { turn };
                let from_centre = if flipped { -from_centre } else { from_centre };
                turn < params.apart && (central - from_centre).abs() < params.apart_px
            }) {
                lines.push(line);
                self.central.push(central);
            }
        }
    }
}

/// Collects the bins with enough votes and no fewer than their neighbours.
struct Scan<'a> {
    votes: &'a Accumulator,
    least: u16,
    found: &'a mut Vec<(u16, u32, u32)>,
}

impl pulp::NullaryFnOnce for Scan<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        const STEP: usize = 64;
        for k in 0..self.votes.angles {
            let row = self.votes.row(k);
            for (some, bins) in row.chunks(STEP).enumerate() {
                if bins.iter().fold(0, |most, &votes| most.max(votes)) < self.least {
                    continue;
                }
                for (i, &votes) in bins.iter().enumerate() {
                    let r = some * STEP + i;
                    if votes >= self.least && is_peak(self.votes, k, r) {
                        self.found.push((votes, k as u32, r as u32));
                    }
                }
            }
        }
    }
}

/// Whether no neighbour has more votes, and none that comes first as many.
fn is_peak(votes: &Accumulator, k: usize, r: usize) -> bool {
    let own = votes.row(k)[r];
    (-1..=1).all(|dk| {
        let (row, mirrored) = neighbour(votes, k, dk);
        let mid = if mirrored { 2 * votes.reach - r } else { r };
        (-1isize..=1).all(|dr| {
            let Some(other) = mid
                .checked_add_signed(dr)
                .filter(|&other| other <= 2 * votes.reach)
            else {
                return true;
            };
            let theirs = votes.row(row)[other];
            theirs < own || (theirs == own && (row, other) >= (k, r))
        })
    })
}

/// The angle dk from angle k, and whether rho is negated there.
fn neighbour(votes: &Accumulator, k: usize, dk: isize) -> (usize, bool) {
    let angles = votes.angles as isize;
    let row = k as isize + dk;
    (
        row.rem_euclid(angles) as usize,
        row.div_euclid(angles) % 2 != 0,
    )
}

/// The line of a peak, between the bins.
///
/// Beside its own angle a line's votes spread over a length of rho in proportion to the angle's error, so
/// the peak's height falls with `1 / sqrt(w^2 + error^2)`: its inverse square is a parabola, and three
/// heights give the angle. Rho is the mean of the bins about the peak.
fn refined(votes: &Accumulator, k: usize, r: usize) -> Line {
    let (height, rho) = crest(votes.row(k), r, 0);
    // farthest that a peak moves from one angle to the next
    let step = PI / votes.angles as f64;
    let window = (votes.reach as f64 * step).ceil() as usize + 1;
    let beside = [-1, 1].map(|dk| {
        let (row, mirrored) = neighbour(votes, k, dk);
        let mid = if mirrored { 2 * votes.reach - r } else { r };
        let (height, rho) = crest(votes.row(row), mid, window);
        (height, if mirrored { -rho } else { rho })
    });
    let inverse = |height: f64| 1.0 / (height * height).max(1e-3);
    let (before, own, after) = (inverse(beside[0].0), inverse(height), inverse(beside[1].0));
    let bend = before - 2.0 * own + after;
    let shift = if votes.angles < 3 || bend <= 0.0 {
        0.0
    } else {
        (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
    };
    let slope = if shift < 0.0 {
        rho - beside[0].1
    } else {
        beside[1].1 - rho
    };
    let (theta, rho) = (
        (k as f64 + shift) * step,
        (rho + shift * slope) * votes.rho_px,
    );
    let own_votes = u32::from(votes.row(k)[r]);
    let (theta, rho) = if theta < 0.0 {
        (theta + PI, -rho)
    } else if theta >= PI {
        (theta - PI, -rho)
    } else {
        (theta, rho)
    };
    Line {
        rho,
        theta,
        votes: own_votes,
    }
}

/// The highest sum of three bins of a row within `window` of bin r, and the mean of rho there [bins].
fn crest(row: &[u16], r: usize, window: usize) -> (f64, f64) {
    let reach = row.len() / 2;
    let sum = |i: usize| {
        let bins = &row[i.saturating_sub(1)..(i + 2).min(row.len())];
        bins.iter().map(|&votes| u32::from(votes)).sum::<u32>()
    };
    let (first, last) = (r.saturating_sub(window), (r + window).min(row.len() - 1));
    let mut best = (r, sum(r));
    for i in first..=last {
        let nearer = i.abs_diff(r) < best.0.abs_diff(r);
        let sum = sum(i);
        if sum > best.1 || (sum == best.1 && nearer) {
            best = (i, sum);
        }
    }
    let (i, sum) = best;
    let at = |i: Option<usize>| {
        i.and_then(|i| row.get(i))
            .map_or(0.0, |&votes| f64::from(votes))
    };
    let lean = (at(i.checked_add(1)) - at(i.checked_sub(1))) / f64::from(sum.max(1));
    (f64::from(sum), i as f64 - reach as f64 + lean)
}
