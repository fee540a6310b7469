//! The cells of one beam: those that the pulse passed, and the surfaces that may have reflected it.

use crate::footprint::Footprint;
use crate::{MapFrame, SonarModel};

use super::RefineParams;
use super::lattice::index_of;
use super::rays::Ray;

/// Parts of an arc that may have reflected, each a surface tangent to the arc at its middle.
pub(super) const PARTS: usize = 11;
/// The range of a surface is blurred by its Gaussian at three places: offset [sigma] and weight, 1 in the middle: where
/// shots agree on a surface, they are to find a wall however large their sigma is.
const BLUR: [(f64, f32); 3] = [(-1.22, 0.33), (0.0, 1.0), (1.22, 0.33)];
/// How much weaker the beam is at its edge than on its axis, as 1 - this.
const EDGE_LOSS: f64 = 0.9;
const NOWHERE: u32 = u32::MAX;

/// What one shot says about one cell, before trust and cover.
#[derive(Debug, Clone, Copy)]
struct Entry {
    index: u32,
    /// Evidence of having been passed, as occupancy below 0.5.
    passed: f32,
    /// Evidence of being hit if wholly covered, as occupancy above 0.5.
    hit: f32,
    /// Weight of the cell as an obstacle in the way.
    in_the_way: f32,
    /// Share of the reflecting surface's possible places that cover the cell.
    cover: f32,
    /// Log-odds by all other shots.
    others: f32,
}

/// Reused buffers for one beam at a time.
#[derive(Debug)]
pub(super) struct Scratch {
    frame: MapFrame,
    beam_width: f64,
    sigma: f64,
    blanking: f64,
    params: RefineParams,
    /// Samples along a surface: distance from its middle [m] and weight.
    profile: Vec<(f64, f32)>,
    entries: Vec<Entry>,
    /// Entry of a cell, or NOWHERE.
    slots: Vec<u32>,
    /// Entries and weights of all parts of the arc, one part after the other.
    surface: Vec<(u32, f32)>,
    ends: [usize; PARTS],
}

impl Scratch {
    pub(super) fn new(frame: MapFrame, model: &SonarModel, params: &RefineParams) -> Self {
        Self {
            frame,
            beam_width: model.beam_width,
            sigma: model.sigma,
            blanking: model.blanking,
            params: *params,
            profile: profile(params, frame.resolution()),
            entries: Vec::new(),
            slots: vec![NOWHERE; frame.cell_count()],
            surface: Vec::new(),
            ends: [0; PARTS],
        }
    }

    /// Lists the cells of a beam.
    pub(super) fn collect(&mut self, ray: &Ray) {
        for entry in &self.entries {
            self.slots[entry.index as usize] = NOWHERE;
        }
        self.entries.clear();
        self.surface.clear();
        let sigma = self.sigma.hypot(self.params.relative_sigma * ray.range);
        self.collect_passed(ray, sigma);
        if ray.echo {
            for part in 0..PARTS {
                self.collect_surface(ray, sigma, part);
                self.ends[part] = self.surface.len();
            }
        }
    }

    fn collect_passed(&mut self, ray: &Ray, sigma: f64) {
        let p = &self.params;
        let res = self.frame.resolution();
        let hit = ray.fresh * (p.hit - 0.5);
        let reach = if ray.echo {
            ray.range + 3.0 * sigma
        } else {
            ray.range
        };
        let footprint = Footprint::new(self.frame.origin(), res, ray.beam, self.beam_width, reach);
        let Some(bounds) = footprint.bounds() else {
            return;
        };
        let [ax, ay] = footprint.apex();
        let heading = ray.beam.theta - self.frame.origin().theta;
        let (sin, cos) = heading.sin_cos();
        let half = 0.5 * self.beam_width;
        let occupancy = if ray.echo {
            p.passed
        } else {
            p.passed_in_silence
        };
        let edge = (1.0 - 2.0 * p.passed_at_edge).min(1.0);
        let (width, height) = (
            i64::from(self.frame.width()),
            i64::from(self.frame.height()),
        );
        for j in bounds.rows.start.max(0)..bounds.rows.end.min(height) {
            let spans = footprint.row(j);
            let dy = j as f64 + 0.5 - ay;
            for span in [spans.cone, spans.axis[0].clone(), spans.axis[1].clone()] {
                for i in span.start.max(0)..span.end.min(width) {
                    let dx = i as f64 + 0.5 - ax;
                    let r = (dx * dx + dy * dy).sqrt() * res;
                    if r < self.blanking || r > reach + res {
                        continue;
                    }
                    let side = (cos * dy - sin * dx) * res / (r.max(0.5 * res) * half.sin());
                    let u2 = (side * side).min(1.0);
                    let front = if ray.echo {
                        below((ray.range - p.late - r - 0.5 * res) / sigma)
                    } else {
                        1.0
                    };
                    let fade = (-r / p.passed_reach).exp() * (1.0 - u2 * (1.0 - edge));
                    let share = (res / (r.max(res) * self.beam_width)).min(1.0);
                    let index = ((height - 1 - j) * width + i) as u32;
                    self.slots[index as usize] = self.entries.len() as u32;
                    self.entries.push(Entry {
                        index,
                        passed: (front * (0.5 - occupancy) * fade) as f32,
                        hit: ((1.0 - front) * hit) as f32,
                        in_the_way: (p.blocking * front * lobe(u2) * share) as f32,
                        cover: 0.0,
                        others: 0.0,
                    });
                }
            }
        }
    }

    /// Samples one tangent surface, at three ranges, and lists the cells that it covers.
    fn collect_surface(&mut self, ray: &Ray, sigma: f64, part: usize) {
        let p = &self.params;
        let per_meter = 1.0 / self.frame.resolution();
        let origin = self.frame.origin().inverse();
        let beam = origin.compose(ray.beam);
        let (sin, cos) = (beam.theta + part_offset(part) * 0.5 * self.beam_width).sin_cos();
        let hit = (ray.fresh * (p.hit - 0.5)) as f32;
        for (offset, weight) in BLUR {
            let range = ray.range + offset * sigma - 0.5 * p.late;
            let mut last = NOWHERE;
            for &(along, profile) in &self.profile {
                let (x, y) = (
                    beam.x + range * cos - along * sin,
                    beam.y + range * sin + along * cos,
                );
                // truncation is the floor of what lies inside the frame
                if x < 0.0 || y < 0.0 {
                    continue;
                }
                let cell = [(x * per_meter) as i64, (y * per_meter) as i64];
                let Some(index) = index_of(&self.frame, cell[0], cell[1]) else {
                    continue;
                };
                let mut slot = self.slots[index as usize];
                if slot == NOWHERE {
                    slot = self.entries.len() as u32;
                    self.slots[index as usize] = slot;
                    self.entries.push(Entry {
                        index,
                        passed: 0.0,
                        hit,
                        in_the_way: 0.0,
                        cover: 0.0,
                        others: 0.0,
                    });
                }
                if slot == last {
                    if let Some((_, w)) = self.surface.last_mut() {
                        *w = w.max(profile * weight);
                    }
                } else {
                    self.surface.push((slot, profile * weight));
                    last = slot;
                }
            }
        }
    }

    fn part(&self, part: usize) -> std::ops::Range<usize> {
        let start = if part == 0 { 0 } else { self.ends[part - 1] };
        start..self.ends[part]
    }

    /// Spreads the shares of the parts over the cells that they cover.
    pub(super) fn cover(&mut self, shares: &[f32; PARTS]) {
        if self.surface.is_empty() {
            return;
        }
        for entry in &mut self.entries {
            entry.cover = 0.0;
        }
        for (part, &share) in shares.iter().enumerate() {
            for &(slot, weight) in &self.surface[self.part(part)] {
                self.entries[slot as usize].cover += share * weight;
            }
        }
    }

    /// Cells and what the shot says about them, trusted as given [log-odds].
    pub(super) fn messages(&self, trust: f64) -> impl Iterator<Item = (u32, f32)> {
        let trust = trust as f32;
        self.entries
            .iter()
            .map(move |entry| (entry.index, message(entry, trust)))
    }

    /// Takes this shot's own last message out of the sums.
    pub(super) fn beliefs_of_others(&mut self, sums: &[f64], trust: f64, weight: f64) {
        let (trust, weight) = (trust as f32, weight as f32);
        for entry in &mut self.entries {
            entry.others = sums[entry.index as usize] as f32 - weight * message(entry, trust);
        }
    }

    /// How surely something known stands in the way: the expected number of times that it fills the beam.
    pub(super) fn blocked(&self, prior: f64) -> f64 {
        let prior = prior as f32;
        let base = 1.0 / (1.0 + (-prior).exp());
        let mut sum = 0.0;
        for entry in &self.entries {
            if entry.in_the_way > 1e-3 && entry.others > 0.0 {
                let occupied = 1.0 / (1.0 + (-(entry.others + prior)).exp());
                sum += entry.in_the_way * (occupied - base) / (1.0 - base);
            }
        }
        f64::from(sum)
    }

    /// How well the arc can have reflected [log-odds against an unknown arc], and the share of every part.
    pub(super) fn explain_arc(&self, limit: f32) -> (f64, [f32; PARTS]) {
        let mut shares = [0.0_f32; PARTS];
        let (mut sum, mut base) = (0.0_f64, 0.0_f64);
        for (part, share) in shares.iter_mut().enumerate() {
            let (mut belief, mut weights) = (0.0_f32, 1e-9_f32);
            for &(slot, weight) in &self.surface[self.part(part)] {
                belief += weight * self.entries[slot as usize].others.clamp(-limit, limit);
                weights += weight;
            }
            let strength = lobe(part_offset(part).powi(2));
            let score = strength * f64::from((belief / weights).exp());
            *share = score as f32;
            sum += score;
            base += strength;
        }
        for share in &mut shares {
            *share /= sum as f32;
        }
        ((sum / base).ln(), shares)
    }
}

/// Samples closer than a cell along a surface: full weight on the patch, then fading.
fn profile(params: &RefineParams, resolution: f64) -> Vec<(f64, f32)> {
    let length = params.patch + 2.0 * params.patch_tail;
    let steps = (length / (0.7 * resolution)).ceil().max(1.0) as i64;
    let sample = |step: i64| {
        let along = step as f64 / steps as f64 * length;
        let past = (along.abs() - params.patch).max(0.0);
        (along, (-past / params.patch_tail).exp() as f32)
    };
    (-steps..=steps).map(sample).collect()
}

/// Log-odds of a cell by one shot: 0.5 mixed with what the shot says, by its trust.
fn message(entry: &Entry, trust: f32) -> f32 {
    let e = trust * (entry.cover.min(1.0) * entry.hit - entry.passed);
    ((0.5 + e) / (0.5 - e)).ln()
}

/// Middle of a part, from -1 at the right edge of the beam to 1 at the left.
fn part_offset(part: usize) -> f64 {
    (2 * part + 1) as f64 / PARTS as f64 - 1.0
}

/// Strength of the beam at the squared offset from its axis, the edge being 1.
fn lobe(u2: f64) -> f64 {
    1.0 - EDGE_LOSS * u2
}

/// Probability that a normal variable lies below `u`, by its logistic approximation.
fn below(u: f64) -> f64 {
    1.0 / (1.0 + (-1.702 * u).exp())
}
