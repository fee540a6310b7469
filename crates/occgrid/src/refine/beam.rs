//! The cells of one beam: those that the pulse passed, and the surfaces that may have reflected it.

use std::f64::consts::PI;

use crate::footprint::Footprint;
use crate::{MapFrame, SonarModel};

use super::RefineParams;
use super::lattice::index_of;
use super::rays::Ray;
use super::turns::{Evidence, NOTHING, Turns};

/// Parts of an arc that may have reflected, each a surface along the nearest of the walls' turns.
pub(super) const PARTS: usize = 11;
/// The range of a surface is blurred by its Gaussian at three places: offset [sigma] and weight, 1 in the middle: where
/// shots agree on a surface, they are to find a wall however large their sigma is.
const BLUR: [(f64, f32); 3] = [(-1.22, 0.33), (0.0, 1.0), (1.22, 0.33)];
/// Half the width of the way to one place on the arc: what stands or passes there counts for it [rad].
const WAY: f64 = 0.1;
/// How fast the beam weakens off its axis: exp(-LOBE) at its nominal edge.
const LOBE: f64 = 1.8;
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
    /// How surely a wall of each turn would have answered from here.
    answers: Evidence,
    /// Place across the beam, in parts.
    across: f32,
    /// How near the way to what reflected passes, 0 to 1.
    near: f32,
    /// Share of the reflecting surface's possible places that cover the cell, by turn.
    cover: Evidence,
    /// Log-odds by all other shots and along walls.
    others: Evidence,
}

/// Reused buffers for one beam at a time.
#[derive(Debug)]
pub(super) struct Scratch {
    frame: MapFrame,
    model: SonarModel,
    params: RefineParams,
    turns: Turns,
    /// Samples along a surface: distance from its middle [m] and weight.
    profile: Vec<(f64, f32)>,
    entries: Vec<Entry>,
    /// Entry of a cell, or NOWHERE.
    slots: Vec<u32>,
    /// Entries and weights of all parts of the arc, one part after the other.
    surface: Vec<(u32, f32)>,
    ends: [usize; PARTS],
    /// Turn of every part, and how far the part is from it [rad].
    facing: [(usize, f64); PARTS],
}

impl Scratch {
    pub(super) fn new(frame: MapFrame, model: &SonarModel, params: &RefineParams) -> Self {
        Self {
            frame,
            model: *model,
            params: *params,
            turns: Turns::new(0.0, params.slant),
            profile: profile(params, frame.resolution()),
            entries: Vec::new(),
            slots: vec![NOWHERE; frame.cell_count()],
            surface: Vec::new(),
            ends: [0; PARTS],
            facing: [(0, 0.0); PARTS],
        }
    }

    /// Walls stand square and parallel to this direction, mostly.
    pub(super) fn face(&mut self, turns: Turns) {
        self.turns = turns;
    }

    /// Half the angle over which a surface square to the sonar may answer [rad].
    fn half(&self) -> f64 {
        (0.5 * self.model.beam_width * self.params.hearing).min(0.5 * PI)
    }

    /// Lists the cells of a beam.
    pub(super) fn collect(&mut self, ray: &Ray) {
        for entry in &self.entries {
            self.slots[entry.index as usize] = NOWHERE;
        }
        self.entries.clear();
        self.surface.clear();
        let sigma = (self.model.sigma).hypot(self.params.relative_sigma * ray.range);
        self.collect_passed(ray, sigma);
        if ray.echo {
            for part in 0..PARTS {
                self.collect_surface(ray, sigma, part);
                self.ends[part] = self.surface.len();
            }
        }
    }

    fn collect_passed(&mut self, ray: &Ray, sigma: f64) {
        let res = self.frame.resolution();
        let (width, reach) = if ray.echo {
            (2.0 * self.half(), ray.range + 3.0 * sigma)
        } else {
            (self.model.beam_width, ray.range)
        };
        let footprint = Footprint::new(self.frame.origin(), res, ray.beam, width, reach);
        let Some(bounds) = footprint.bounds() else {
            return;
        };
        let [ax, ay] = footprint.apex();
        let (columns, lines) = (
            i64::from(self.frame.width()),
            i64::from(self.frame.height()),
        );
        for j in bounds.rows.start.max(0)..bounds.rows.end.min(lines) {
            let spans = footprint.row(j);
            let dy = (j as f64 + 0.5 - ay) * res;
            for span in [spans.cone, spans.axis[0].clone(), spans.axis[1].clone()] {
                for i in span.start.max(0)..span.end.min(columns) {
                    let dx = (i as f64 + 0.5 - ax) * res;
                    let r = dx.hypot(dy);
                    if r >= self.model.blanking && r <= reach + res {
                        let index = ((lines - 1 - j) * columns + i) as u32;
                        let entry = self.passed(ray, sigma, index, [dx, dy, r]);
                        self.slots[index as usize] = self.entries.len() as u32;
                        self.entries.push(entry);
                    }
                }
            }
        }
    }

    /// What a shot says of the cell at (dx, dy) from the sonar, at the distance r.
    fn passed(&self, ray: &Ray, sigma: f64, index: u32, [dx, dy, r]: [f64; 3]) -> Entry {
        let p = &self.params;
        let res = self.frame.resolution();
        let (sin, cos) = (ray.beam.theta - self.frame.origin().theta).sin_cos();
        let left = cos * dy - sin * dx;
        let edge = (0.5 * self.model.beam_width).sin();
        let u2 = (left / (r.max(0.5 * res) * edge)).powi(2).min(1.0);
        let (occupancy, front) = if ray.echo {
            let behind = (ray.range - p.late - r - 0.5 * res) / sigma;
            (p.passed, below(behind))
        } else {
            (p.passed_in_silence, 1.0)
        };
        let fade = (-r / p.passed_reach).exp() * (1.0 - 2.0 * u2 * p.passed_at_edge);
        let way = (res / (r.max(res) * 2.0 * WAY)).min(1.0);
        let angle = (left / r.max(1e-9)).clamp(-1.0, 1.0).asin();
        let across = (angle / self.half() + 1.0) * 0.5 * PARTS as f64 - 0.5;
        Entry {
            index,
            passed: (front * (0.5 - occupancy) * fade) as f32,
            hit: ((1.0 - front) * ray.fresh * (p.hit - 0.5)) as f32,
            in_the_way: (p.blocking * front * way) as f32,
            answers: self.turns.answers([dx, dy]),
            across: across.clamp(0.0, PARTS as f64 - 1.0) as f32,
            near: 1.0,
            cover: NOTHING,
            others: NOTHING,
        }
    }

    /// Samples one surface, at three ranges, and lists the cells that it covers.
    fn collect_surface(&mut self, ray: &Ray, sigma: f64, part: usize) {
        let p = self.params;
        let per_meter = 1.0 / self.frame.resolution();
        let beam = self.frame.origin().inverse().compose(ray.beam);
        let direction = beam.theta + part_offset(part) * self.half();
        let (sin, cos) = direction.sin_cos();
        let (turn, off) = self.turns.nearest(direction);
        self.facing[part] = (turn, off);
        let (normal_sin, normal_cos) = (direction + off).sin_cos();
        let hit = (ray.fresh * (p.hit - 0.5)) as f32;
        for (offset, weight) in BLUR {
            let range = ray.range + offset * sigma - 0.5 * p.late;
            let (x, y) = (beam.x + range * cos, beam.y + range * sin);
            let mut last = NOWHERE;
            for k in 0..self.profile.len() {
                let (along, profile) = self.profile[k];
                let (x, y) = (x - along * normal_sin, y + along * normal_cos);
                // truncation is the floor of what lies inside the frame
                if x < 0.0 || y < 0.0 {
                    continue;
                }
                let cell = [(x * per_meter) as i64, (y * per_meter) as i64];
                let Some(index) = index_of(&self.frame, cell[0], cell[1]) else {
                    continue;
                };
                let slot = self.slot(index, hit);
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

    /// The entry of a cell, made if it is not there.
    fn slot(&mut self, index: u32, hit: f32) -> u32 {
        let slot = &mut self.slots[index as usize];
        if *slot == NOWHERE {
            *slot = self.entries.len() as u32;
            self.entries.push(Entry {
                index,
                passed: 0.0,
                hit,
                in_the_way: 0.0,
                answers: NOTHING,
                across: -1.0,
                near: 0.0,
                cover: NOTHING,
                others: NOTHING,
            });
        }
        *slot
    }

    fn part(&self, part: usize) -> std::ops::Range<usize> {
        let start = if part == 0 { 0 } else { self.ends[part - 1] };
        start..self.ends[part]
    }

    /// Width of a part [rad].
    fn part_width(&self) -> f64 {
        2.0 * self.half() / PARTS as f64
    }

    /// Spreads the shares of the parts over the cells that they cover, and over the ways to them.
    pub(super) fn cover(&mut self, shares: &[f32; PARTS]) {
        if self.surface.is_empty() {
            return;
        }
        let width = self.part_width() / WAY;
        let near: [f32; PARTS] = std::array::from_fn(|k| {
            let weight = |part: usize| (-0.5 * ((k as f64 - part as f64) * width).powi(2)).exp();
            (0..PARTS).map(|p| shares[p] * weight(p) as f32).sum()
        });
        let aside = self.params.passed_aside as f32;
        for entry in &mut self.entries {
            entry.cover = NOTHING;
            if entry.across >= 0.0 {
                entry.near = (aside + near[(entry.across + 0.5) as usize]).min(1.0);
            }
        }
        for (part, &share) in shares.iter().enumerate() {
            let turn = self.facing[part].0;
            for &(slot, weight) in &self.surface[self.part(part)] {
                self.entries[slot as usize].cover[turn] += share * weight;
            }
        }
    }

    /// Cells and what the shot says about them, trusted as given [log-odds].
    pub(super) fn messages(&self, trust: f64) -> impl Iterator<Item = (u32, Evidence)> {
        let trust = trust as f32;
        self.entries
            .iter()
            .map(move |entry| (entry.index, message(entry, trust)))
    }

    /// Takes this shot's own last message out of the sums, and adds what goes along walls.
    pub(super) fn beliefs_of_others(
        &mut self,
        sums: &[Evidence],
        along: &[Evidence],
        trust: f64,
        weight: f64,
    ) {
        let (trust, weight) = (trust as f32, weight as f32);
        for entry in &mut self.entries {
            let own = message(entry, trust);
            let (sum, along) = (&sums[entry.index as usize], &along[entry.index as usize]);
            entry.others = std::array::from_fn(|k| sum[k] - weight * own[k] + along[k]);
        }
    }

    /// How surely something known stands in the way to each part: the expected number of times that it fills it.
    pub(super) fn blocked(&self) -> [f64; PARTS] {
        let prior = self.params.prior as f32;
        let base = 1.0 / (1.0 + (-prior).exp());
        let reach = (WAY / self.part_width()).max(0.5) as f32;
        let mut sums = [0.0_f64; PARTS];
        let known = |e: &&Entry| e.in_the_way > 1e-3 && e.others.iter().any(|&o| o > 0.0);
        for entry in self.entries.iter().filter(known) {
            let others = self.turns.any(&entry.others);
            if others > 0.0 {
                let occupied = 1.0 / (1.0 + (-(others + prior)).exp());
                let known = f64::from(entry.in_the_way * (occupied - base) / (1.0 - base));
                for (part, sum) in sums.iter_mut().enumerate() {
                    if (part as f32 - entry.across).abs() <= reach {
                        *sum += known;
                    }
                }
            }
        }
        sums
    }

    /// How well the arc can have reflected [log-odds against an unknown arc], and the share of every part.
    pub(super) fn explain_arc(&self, limit: f64, blocked: &[f64; PARTS]) -> (f64, [f32; PARTS]) {
        let mut shares = [0.0_f32; PARTS];
        let (mut sum, mut base) = (0.0_f64, 0.0_f64);
        for (part, share) in shares.iter_mut().enumerate() {
            let (turn, off) = self.facing[part];
            let (mut belief, mut weights) = (0.0_f32, 1e-9_f32);
            for &(slot, weight) in &self.surface[self.part(part)] {
                let others = self.entries[slot as usize].others[turn];
                belief += weight * others.clamp(-limit as f32, limit as f32);
                weights += weight;
            }
            let aside = part_offset(part) * self.params.hearing;
            let strength = self.turns.strength(turn, off) * (-LOBE * aside * aside).exp();
            let score = strength * (f64::from(belief / weights) - blocked[part].min(limit)).exp();
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

/// Log-odds of a cell by one shot, for a wall of each turn: 0.5 mixed with what the shot says, by its trust.
fn message(entry: &Entry, trust: f32) -> Evidence {
    std::array::from_fn(|k| {
        let passed = entry.passed * entry.near * entry.answers[k];
        let e = trust * (entry.cover[k].min(1.0) * entry.hit - passed);
        log_odds_of(2.0 * e)
    })
}

/// ln((1 + x) / (1 - x)), by its series where that is exact to 1e-7.
fn log_odds_of(x: f32) -> f32 {
    let x2 = x * x;
    if x2 < 0.04 {
        x * (2.0 + x2 * (2.0 / 3.0 + x2 * (2.0 / 5.0 + x2 * (2.0 / 7.0))))
    } else {
        ((1.0 + x) / (1.0 - x)).ln()
    }
}

/// Middle of a part, from -1 at the right end of the arc to 1 at the left.
fn part_offset(part: usize) -> f64 {
    (2 * part + 1) as f64 / PARTS as f64 - 1.0
}

/// Probability that a normal variable lies below `u`, by its logistic approximation.
fn below(u: f64) -> f64 {
    if u > 12.0 {
        return 1.0;
    }
    1.0 / (1.0 + (-1.702 * u).exp())
}
