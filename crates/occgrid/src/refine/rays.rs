//! The shots of a log as the refinement uses them: in canonical order, weighted, thinned to the work allowed.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use crate::{GridError, Pose2, Reading, Shot, SonarModel};

use super::RefineParams;
use super::beam::PARTS;

/// Directions of a full turn that are told apart when overlap is counted, per beam width.
const BINS_PER_BEAM: f64 = 8.0;

/// One shot that is evidence, and its hidden state.
#[derive(Debug, Clone)]
pub(super) struct Ray {
    /// Index in the log.
    pub(super) shot: usize,
    pub(super) beam: Pose2,
    pub(super) echo: bool,
    /// Of the echo, or listened to [m].
    pub(super) range: f64,
    /// How many independent shots it counts for.
    pub(super) weight: f64,
    /// Probability that the reading means what it says; 0 before the first pass, so that it has said nothing.
    pub(super) trust: f64,
    /// Share of its evidence of hitting that counts: 1, or less if it repeats the reading before.
    pub(super) fresh: f64,
    /// Probability that each part of the arc reflected.
    pub(super) shares: [f32; PARTS],
}

/// The rays of a log, in an order that does not depend on the log's.
pub(super) fn prepare(
    shots: &[Shot],
    model: &SonarModel,
    params: &RefineParams,
    resolution: f64,
) -> Result<Vec<Ray>, GridError> {
    let mut rays = Vec::new();
    for (index, shot) in shots.iter().enumerate() {
        if let Some(ray) = ray_of(index, shot, model)? {
            rays.push(ray);
        }
    }
    rays.sort_by(|a, b| {
        canonical(a)
            .partial_cmp(&canonical(b))
            .unwrap_or(a.shot.cmp(&b.shot))
    });
    mark_repeats(&mut rays, shots, model, params);
    weigh(&mut rays, model, params);
    Ok(thin(rays, model, params, resolution))
}

fn ray_of(index: usize, shot: &Shot, model: &SonarModel) -> Result<Option<Ray>, GridError> {
    let (echo, range) = match shot.reading {
        Reading::Echo { range } => (true, range),
        Reading::NoEcho { listened } => (false, listened),
        Reading::TooClose | Reading::Fault => (false, 0.0),
    };
    let Pose2 { x, y, theta } = shot.map_from_base;
    let finite = [x, y, theta, shot.bearing, range]
        .iter()
        .all(|v| v.is_finite());
    if !finite || range < 0.0 {
        return Err(GridError::Shot { stamp: shot.stamp });
    }
    Ok(model.is_evidence(shot.reading).then(|| {
        let mut beam = model.map_from_beam(shot);
        beam.theta = beam.theta.rem_euclid(TAU);
        Ray {
            shot: index,
            beam,
            echo,
            range: range.min(model.max_range),
            weight: 1.0,
            trust: 0.0,
            fresh: 1.0,
            shares: [0.0; PARTS],
        }
    }))
}

fn canonical(ray: &Ray) -> [f64; 5] {
    let kind = if ray.echo { 0.0 } else { 1.0 };
    [ray.beam.x, ray.beam.y, ray.beam.theta, kind, ray.range]
}

/// Ranges that differ by less are the same value [m].
const SAME_RANGE: f64 = 1e-6;

/// Finds the echoes that repeat the last value while the sonar turns on the spot. One thing answers over no more than
/// a beam width; a sensor that goes on saying the same has lost its echo and holds the value. That nothing nearer
/// answered is true all the same, so only the evidence of hitting fades, with the overlap of the beam with the one
/// that first read this value.
fn mark_repeats(rays: &mut [Ray], shots: &[Shot], model: &SonarModel, params: &RefineParams) {
    let stamp = |ray: &Ray| shots[ray.shot].stamp;
    let mut order: Vec<usize> = (0..rays.len()).collect();
    order.sort_by(|&a, &b| {
        let by_time = stamp(&rays[a]).total_cmp(&stamp(&rays[b]));
        by_time.then(a.cmp(&b))
    });
    let mut turned = 0.0;
    for pair in order.windows(2) {
        let (last, ray) = (&rays[pair[0]], &rays[pair[1]]);
        let moved = (last.beam.x - ray.beam.x).hypot(last.beam.y - ray.beam.y);
        let same = (last.range - ray.range).abs() < SAME_RANGE;
        let turn = (ray.beam.theta - last.beam.theta + PI).rem_euclid(TAU) - PI;
        turned = if last.echo && ray.echo && same && moved < params.same_place {
            turned + turn.abs()
        } else {
            0.0
        };
        let overlap = 1.0 - turned / model.beam_width;
        rays[pair[1]].fresh = overlap.max(params.hit_if_held);
    }
}

/// Place and direction, quantised.
type Bin = ([i64; 2], i64);

/// Gives every ray its weight: 1 / (number of shots from about here whose beams overlap its own), to the
/// power of [`RefineParams::redundancy`]. Overlap falls linearly to 0 at one beam width, and as a Gaussian with
/// the distance between the places.
fn weigh(rays: &mut [Ray], model: &SonarModel, params: &RefineParams) {
    let bins = (TAU / model.beam_width * BINS_PER_BEAM).ceil() as i64;
    let step = TAU / bins as f64;
    let place = 0.5 * params.same_place;
    let bin = |ray: &Ray| -> Bin {
        let q = |v: f64| (v / place).floor() as i64;
        let direction = (ray.beam.theta / step).floor() as i64 % bins;
        ([q(ray.beam.x), q(ray.beam.y)], direction)
    };
    let mut counts: BTreeMap<[i64; 2], Vec<f64>> = BTreeMap::new();
    for ray in rays.iter() {
        let (at, direction) = bin(ray);
        let row = counts.entry(at).or_insert_with(|| vec![0.0; bins as usize]);
        row[direction as usize] += 1.0;
    }
    let near: Vec<([i64; 2], f64)> = (-5..=5)
        .flat_map(|dx: i64| (-5..=5).map(move |dy: i64| [dx, dy]))
        .map(|d| (d, (-0.125 * (d[0] * d[0] + d[1] * d[1]) as f64).exp()))
        .collect();
    let reach = (BINS_PER_BEAM.ceil() as i64).min((bins - 1) / 2);
    let mut known: BTreeMap<Bin, f64> = BTreeMap::new();
    for ray in rays {
        let key = bin(ray);
        let overlapping = *known.entry(key).or_insert_with(|| {
            let mut sum = 0.0;
            for &(d, kernel) in &near {
                let Some(row) = counts.get(&[key.0[0] + d[0], key.0[1] + d[1]]) else {
                    continue;
                };
                for k in -reach..=reach {
                    let overlap = 1.0 - (k.abs() as f64 * step / model.beam_width).min(1.0);
                    sum += kernel * overlap * row[(key.1 + k).rem_euclid(bins) as usize];
                }
            }
            sum
        });
        ray.weight = overlapping.max(1.0).powf(-params.redundancy);
    }
}

/// Visits to cells of one pass.
pub(super) fn work(
    rays: &[Ray],
    model: &SonarModel,
    params: &RefineParams,
    resolution: f64,
) -> f64 {
    let surface = PARTS as f64 * 6.0 * (params.patch + 2.0 * params.patch_tail) / resolution;
    let visits = |ray: &Ray| {
        let opening = if ray.echo { params.hearing } else { 1.0 } * model.beam_width;
        let cone = 0.5 * opening * (ray.range / resolution).powi(2);
        cone + 3.0 * ray.range / resolution + surface
    };
    rays.iter().map(visits).sum()
}

/// Merges rays that are alike, coarser and coarser, until the work fits.
fn thin(
    mut rays: Vec<Ray>,
    model: &SonarModel,
    params: &RefineParams,
    resolution: f64,
) -> Vec<Ray> {
    let mut steps = [
        0.25 * resolution,
        model.beam_width / 32.0,
        0.25 * model.sigma,
    ];
    for _ in 0..24 {
        let work = work(&rays, model, params, resolution);
        if work * f64::from(params.iterations) <= params.max_visits {
            break;
        }
        let mut first: BTreeMap<[i64; 5], usize> = BTreeMap::new();
        let mut kept: Vec<Ray> = Vec::new();
        for ray in rays {
            let q = |v: f64, step: f64| (v / step).floor() as i64;
            let key = [
                q(ray.beam.x, steps[0]),
                q(ray.beam.y, steps[0]),
                q(ray.beam.theta, steps[1]),
                i64::from(ray.echo),
                q(ray.range, steps[2]),
            ];
            let at = *first.entry(key).or_insert(kept.len());
            match kept.get_mut(at) {
                Some(like) => like.weight += ray.weight,
                None => kept.push(ray),
            }
        }
        rays = kept;
        for step in &mut steps {
            *step *= 2.0;
        }
    }
    rays
}
