//! Votes by definition.

use std::f64::consts::PI;

use crate::direction::direction;
use crate::{EdgeMap, HoughParams, Voting};

/// The votes of `edges`: by angle, then by bin of rho from -reach to reach.
///
/// # Panics
/// If the widths of the bins are not positive.
#[must_use]
pub fn votes(edges: &EdgeMap, params: &HoughParams) -> Vec<Vec<u16>> {
    let far = f64::from(edges.width().saturating_sub(1))
        .hypot(f64::from(edges.height().saturating_sub(1)));
    let angles = (PI / params.theta).round() as usize;
    let reach = (far / params.rho_px).ceil() as usize + 1;
    let mut digits = 30;
    while (1 << (30 - digits)) < reach + 32 {
        digits -= 1;
    }
    let one = f64::from(1 << digits);
    let mut votes = vec![vec![0u16; 2 * reach + 1]; angles];
    for (k, row) in votes.iter_mut().enumerate() {
        let theta = k as f64 * PI / angles as f64;
        let cos = (theta.cos() * (one / params.rho_px)).round() as i64;
        let sin = (theta.sin() * (one / params.rho_px)).round() as i64;
        for pixel in edges.pixels() {
            let counts = match params.voting {
                Voting::AllDirections => true,
                Voting::NearGradient { spread } => {
                    let half = (spread / PI * angles as f64).round().max(0.0) as i64;
                    let angle = direction(f32::from(pixel.gx), f32::from(pixel.gy));
                    let per_radian = angles as f32 / std::f32::consts::PI;
                    let nearest = (angle * per_radian).round_ties_even() as i64;
                    let turn = (k as i64 - nearest).rem_euclid(angles as i64);
                    turn.min(angles as i64 - turn) <= half
                }
            };
            let sum = i64::from(pixel.u) * cos + i64::from(pixel.v) * sin;
            let bin = (sum + (1 << digits) / 2) >> digits;
            let votes = &mut row[(bin + reach as i64) as usize];
            *votes = if counts {
                votes.saturating_add(1)
            } else {
                *votes
            };
        }
    }
    votes
}
