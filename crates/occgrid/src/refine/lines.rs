//! Walls go on straight: what is known of a place on a wall, told to the places farther along.
//!
//! For each turn the lattice falls into lines of cells along the wall. On a line, wall and no wall alternate as a
//! Markov chain, and its forward and backward messages tell each cell what the others on the line make of it.

use crate::MapFrame;

use super::RefineParams;
use super::lattice::index_of;
use super::turns::{Evidence, NOTHING, TURNS, Turns};

/// Odds of a cell to be wall that are no more told on, relative to the prior.
const SLIGHT: f64 = 0.02;

/// The chain of one line, in odds relative to the prior.
#[derive(Debug, Clone, Copy)]
struct Chain {
    /// Odds of a wall before anything is known.
    prior: f64,
    /// Probability that a wall ends with a cell.
    end: f64,
    /// Probability that one begins.
    begin: f64,
}

impl Chain {
    /// What a cell of these odds says of the next one.
    fn pass(self, odds: f64) -> f64 {
        if (odds - 1.0).abs() < SLIGHT {
            return 1.0;
        }
        let odds = odds * self.prior;
        let next = (odds * (1.0 - self.end) + self.begin) / (odds * self.end + 1.0 - self.begin);
        next / self.prior
    }
}

/// What the other cells on each line say [log-odds].
pub(super) fn along_walls(
    frame: &MapFrame,
    sums: &[Evidence],
    turns: &Turns,
    params: &RefineParams,
) -> Vec<Evidence> {
    let mut said = vec![NOTHING; sums.len()];
    let (mut line, mut forward) = (Vec::new(), Vec::new());
    for turn in 0..TURNS {
        // along the wall, not across it
        let (cos, sin) = turns.normal(turn).sin_cos();
        let (dx, dy) = (-cos, sin);
        let flat = dx.abs() >= dy.abs();
        let (length, count, slope) = if flat {
            (frame.width(), frame.height(), dy / dx)
        } else {
            (frame.height(), frame.width(), dx / dy)
        };
        let step = frame.resolution() * (1.0 + slope * slope).sqrt();
        let end = (step / params.wall_length).min(0.5);
        let prior = params.walls / (1.0 - params.walls);
        let chain = Chain {
            prior,
            end,
            begin: (end * prior).min(0.5),
        };
        let spread = (slope.abs() * f64::from(length)).ceil() as i64 + 1;
        for start in -spread..i64::from(count) + spread {
            line.clear();
            line.extend((0..i64::from(length)).filter_map(|i| {
                let j = start + (slope * i as f64).round() as i64;
                let (col, row) = if flat { (i, j) } else { (j, i) };
                index_of(frame, col, row)
            }));
            tell(
                &line,
                turn,
                sums,
                &mut said,
                (chain, params.straight),
                &mut forward,
            );
        }
    }
    said
}

/// Tells every cell of a line what the others on it say, both ways.
fn tell(
    line: &[u32],
    turn: usize,
    sums: &[Evidence],
    said: &mut [Evidence],
    (chain, strength): (Chain, f64),
    forward: &mut Vec<[f64; 2]>,
) {
    forward.clear();
    let mut odds = 1.0;
    for &at in line {
        let sum = f64::from(sums[at as usize][turn]);
        let own = if sum == 0.0 { 1.0 } else { sum.exp() };
        forward.push([odds, own]);
        odds = chain.pass(odds * own);
    }
    odds = 1.0;
    for (&at, &[from, own]) in line.iter().zip(forward.iter()).rev() {
        let both = from * odds;
        if (both - 1.0).abs() > f64::EPSILON {
            said[at as usize][turn] = (strength * both.ln()) as f32;
        }
        odds = chain.pass(odds * own);
    }
}
