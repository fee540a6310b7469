//! The main direction of a room: where its walls stand square to one another, most of them share it.
//!
//! Echoes from different places that come from one wall agree on how far the wall is along its normal (the Hough
//! transform of sonar: Tardós, Neira, Newman and Leonard, "Robust mapping and localization in indoor environments
//! using sonar data", Int. J. Robotics Research 21, 2002).

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::SonarModel;

use super::RefineParams;
use super::rays::Ray;

/// Directions of a right angle that are compared.
const BINS: usize = 45;
/// Candidates are this many directions apart.
const APART: usize = 4;
/// Share of a place's votes for itself that does not count.
const OWN: f64 = 0.9;
/// Distances that differ by less than this (and sigma) are the same [m].
const SAME_DISTANCE: f64 = 0.02;

/// Directions that could be the main one [rad, 0 to pi/2], best first, and how much more they are agreed on than the
/// mean direction is.
pub(super) fn candidates(
    rays: &[Ray],
    model: &SonarModel,
    params: &RefineParams,
    most: usize,
) -> Vec<(f64, f64)> {
    let direction = |k: usize| k as f64 / BINS as f64 * FRAC_PI_2;
    let scores: Vec<f64> = (0..BINS)
        .map(|k| {
            let normals = (0..4).map(|side| direction(k) + f64::from(side) * FRAC_PI_2);
            normals.map(|n| agreement(rays, n, model, params)).sum()
        })
        .collect();
    let mean = scores.iter().sum::<f64>() / BINS as f64 + 1e-9;
    let mut order: Vec<usize> = (0..BINS).collect();
    order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]).then(a.cmp(&b)));
    let mut kept: Vec<usize> = Vec::new();
    for k in order {
        let is_apart = |&other: &usize| {
            let between = k.abs_diff(other);
            between.min(BINS - between) >= APART
        };
        if kept.len() < most && kept.iter().all(is_apart) {
            kept.push(k);
        }
    }
    kept.iter()
        .map(|&k| (direction(k), (scores[k] / mean).max(1e-3)))
        .collect()
}

/// How much echoes from different places agree on walls of one normal: the sum over distances along it of the
/// products of what each two places say.
fn agreement(rays: &[Ray], normal: f64, model: &SonarModel, params: &RefineParams) -> f64 {
    let bin = model.sigma.max(SAME_DISTANCE);
    let (sin, cos) = normal.sin_cos();
    let mut votes: BTreeMap<(i64, [i64; 2]), f64> = BTreeMap::new();
    for ray in rays.iter().filter(|ray| ray.echo) {
        let off = (normal - ray.beam.theta + PI).rem_euclid(TAU) - PI;
        let aside = off / (0.5 * model.beam_width);
        if aside.abs() >= 1.0 {
            continue;
        }
        let weight = ray.weight * ray.fresh * (1.0 - aside * aside);
        let distance = (ray.beam.x * cos + ray.beam.y * sin + ray.range) / bin;
        let place = [ray.beam.x, ray.beam.y].map(|v| (0.5 * v / params.same_place).round() as i64);
        for step in -3..=3_i64 {
            let at = distance.floor() as i64 + step;
            let u = (at as f64 + 0.5 - distance) / 1.2;
            *votes.entry((at, place)).or_insert(0.0) += weight * (-0.5 * u * u).exp();
        }
    }
    let (mut score, mut sum, mut own) = (0.0, 0.0_f64, 0.0_f64);
    let mut last = None;
    for (&(at, _), &vote) in &votes {
        if last != Some(at) {
            score += sum * sum - OWN * own;
            (sum, own, last) = (0.0, 0.0, Some(at));
        }
        let vote = vote.min(1.0);
        sum += vote;
        own += vote * vote;
    }
    score + sum * sum - OWN * own
}
