//! Which feature is which landmark: depth-first over joint readings of the frame, weighed by probability.

use super::LocateParams;
use super::belief::{Belief, Unknowns};
use super::feature::{Feature, Kind};
use super::landmarks::Landmarks;
use super::model::{Model, Prediction};
use super::update::Update;
use super::view::View;

/// A reading of the frame: of each feature, which landmark it is, if any.
#[derive(Clone, PartialEq)]
pub(super) struct Reading {
    pub(super) choice: Vec<Option<usize>>,
    /// Log of its probability, up to a constant shared by all readings.
    pub(super) score: f64,
    /// The unknowns, from one linear step a feature.
    pub(super) mean: Unknowns,
}

/// The likely readings, best first, and whether all were looked at.
pub(super) struct Readings {
    pub(super) likely: Vec<Reading>,
    pub(super) complete: bool,
}

/// 99.9 % of chi-square with 2 degrees of freedom.
const GATE: f64 = 13.8;
/// Gates are opened so far before a step is taken again.
const FAR: f64 = 4.0;
/// While fewer features than this are taken, steps are taken again.
const LONG_STEPS: usize = 5;
/// A robot is placed at this sigma [m].
const PLACED: f64 = 0.02;
/// Of a placed robot, features are seen this near to where they are predicted [px].
const PLACED_REACH_PX: f64 = 15.0;
/// Of each kind, so many of the most confident features are used.
const MOST_FEATURES: usize = 10;
/// Confidences are kept this far from certainty.
pub(super) const DOUBT: f64 = 0.02;
/// Readings kept.
const MOST_READINGS: usize = 64;
/// How densely features lie that are none [1/px^2]: other lines run along with the floor edges, and other
/// verticals end on them.
pub(super) fn clutter(kind: Kind) -> f64 {
    match kind {
        Kind::Edge(_) => 1e-4,
        Kind::Corner(_) => 1.2e-4,
    }
}

pub(super) fn readings(
    model: &Model<'_>,
    features: &[Feature],
    landmarks: &Landmarks,
    parts: &[Belief],
    params: &LocateParams,
) -> Readings {
    let mut all = Readings {
        likely: Vec::new(),
        complete: true,
    };
    for part in parts {
        let mut search = Search {
            model,
            features,
            landmarks,
            steps: params.most_steps,
            margin: params.margin + 2.0,
            order: Vec::new(),
            found: Readings {
                likely: Vec::new(),
                complete: true,
            },
        };
        search.order = search.candidates(part);
        let choice = vec![None; features.len()];
        search.descend(0, part.clone(), choice, 0.0, 0.0);
        all.complete &= search.found.complete;
        all.likely.extend(search.found.likely);
    }
    all
}

/// A feature with what it may be, seen from the prior alone.
struct Candidates {
    feature: usize,
    choices: Vec<usize>,
    /// Log of the weight of being a given one of the landmarks, and of being none of them.
    any: f64,
    none: f64,
    /// The most that it can add to a score.
    most: f64,
}

struct Search<'a> {
    model: &'a Model<'a>,
    features: &'a [Feature],
    landmarks: &'a Landmarks,
    steps: u32,
    margin: f64,
    order: Vec<Candidates>,
    found: Readings,
}

impl Search<'_> {
    /// Features that may be something in the plan, the most telling first.
    fn candidates(&self, start: &Belief) -> Vec<Candidates> {
        let mut out = Vec::new();
        let Some(view) = self.model.view(&start.mean) else {
            return out;
        };
        for (index, feature) in self.features.iter().enumerate() {
            let (mut choices, mut sharpest) = (Vec::new(), f64::NEG_INFINITY);
            for choice in 0..self.model.choices(feature, self.landmarks) {
                let seen = self.model.predict(feature, self.landmarks, choice, &view);
                let Some(seen) = seen.filter(|seen| wide_gate(seen, start)) else {
                    continue;
                };
                if !self
                    .model
                    .hidden(feature, self.landmarks, choice, &view, start)
                {
                    choices.push(choice);
                    sharpest = sharpest
                        .max(-(std::f64::consts::TAU * seen.noise.determinant().sqrt()).ln());
                }
            }
            if choices.is_empty() {
                continue;
            }
            let confidence = feature.confidence.clamp(DOUBT, 1.0 - DOUBT);
            let any = match feature.kind {
                Kind::Edge(_) => (confidence / choices.len() as f64).ln(),
                Kind::Corner(_) => confidence.ln(),
            };
            let none = ((1.0 - confidence) * clutter(feature.kind)).ln();
            out.push(Candidates {
                feature: index,
                choices,
                any,
                none,
                most: (any + sharpest).max(none),
            });
        }
        // edges hold heading and the distance to walls, so they come first and narrow the rest
        let rank = |c: &Candidates| {
            let f = &self.features[c.feature];
            let corner = matches!(f.kind, Kind::Corner(_));
            let length = (f.places[1] - f.places[0]).norm();
            let choices = if corner { c.choices.len() as f64 } else { 1.0 };
            (corner, f.confidence * (1.0 + length) / choices)
        };
        out.sort_by(|a, b| {
            let ((ka, wa), (kb, wb)) = (rank(a), rank(b));
            ka.cmp(&kb)
                .then(wb.total_cmp(&wa))
                .then(a.feature.cmp(&b.feature))
        });
        let mut count = [0; 2];
        out.retain(|c| {
            let count = &mut count[usize::from(rank(c).0)];
            *count += 1;
            *count <= MOST_FEATURES
        });
        out
    }

    fn descend(
        &mut self,
        depth: usize,
        belief: Belief,
        choice: Vec<Option<usize>>,
        score: f64,
        distance: f64,
    ) {
        let Some(here) = self.order.get(depth) else {
            self.keep(Reading {
                choice,
                score,
                mean: belief.mean,
            });
            return;
        };
        let rest: f64 = self.order[depth..].iter().map(|c| c.most).sum();
        let best = self
            .found
            .likely
            .first()
            .map_or(f64::NEG_INFINITY, |r| r.score);
        if score + rest < best - self.margin {
            return;
        }
        let (feature, any, none) = (here.feature, here.any, here.none);
        let taken = matched(&choice);
        let placed = belief.spread[(0, 0)] + belief.spread[(1, 1)] < PLACED * PLACED;
        let reach = if placed {
            PLACED_REACH_PX
        } else {
            f64::INFINITY
        };
        let model = self.model;
        let Some(view) = model.view(&belief.mean) else {
            return;
        };
        let mut branches: Vec<(f64, f64, usize, Update)> = Vec::new();
        for &landmark in &here.choices {
            let f = &self.features[feature];
            if !model.close(f, self.landmarks, landmark, &view, reach) {
                continue;
            }
            if self.steps == 0 {
                self.found.complete = false;
                break;
            }
            self.steps -= 1;
            let used = self.order[..depth].iter().any(|c| {
                choice[c.feature] == Some(landmark)
                    && self.excludes(&self.features[c.feature], f, landmark, &view)
            });
            let Some(update) = self.update(feature, landmark, &belief, &view, taken) else {
                continue;
            };
            let joint = distance + update.distance;
            if !used && update.distance <= GATE && joint <= joint_gate(2 * (taken + 1)) {
                branches.push((any + update.log_density, joint, landmark, update));
            }
        }
        branches.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.2.cmp(&b.2)));
        // once the robot is placed, the rest cannot put it elsewhere: the likeliest will do
        if placed {
            branches.truncate(1);
            branches.retain(|branch| branch.0 > none);
        }
        let alone = placed && !branches.is_empty();
        for (gain, joint, landmark, update) in branches {
            let mut next = choice.clone();
            next[feature] = Some(landmark);
            self.descend(
                depth + 1,
                update.applied(&belief),
                next,
                score + gain,
                joint,
            );
        }
        if !alone {
            self.descend(depth + 1, belief, choice, score + none, distance);
        }
    }

    /// Whether two features cannot both be this landmark: a corner is one corner, and a stretch of wall one
    /// edge, though a wall may be seen in several.
    fn excludes(&self, a: &Feature, b: &Feature, landmark: usize, view: &View<'_>) -> bool {
        match (a.kind, b.kind) {
            (Kind::Corner(_), Kind::Corner(_)) => true,
            (Kind::Edge(_), Kind::Edge(_)) => {
                let wall = self.landmarks.walls[landmark].1;
                let places = [a, b].map(|edge| view.on_wall(edge, wall));
                let [Some(a), Some(b)] = places.map(|p| p.map(|[s, t]| [s.min(t), s.max(t)]))
                else {
                    return false;
                };
                let both = a[1].min(b[1]) - a[0].max(b[0]);
                both > 0.5 * (a[1] - a[0]).min(b[1] - b[0])
            }
            _ => false,
        }
    }

    /// The step for one feature; while few are taken the steps are long, so it is taken again from where it
    /// led (an iterated Kalman update).
    fn update(
        &self,
        feature: usize,
        landmark: usize,
        belief: &Belief,
        view: &View<'_>,
        taken: usize,
    ) -> Option<Update> {
        let feature = &self.features[feature];
        let at = |view: &View<'_>, mean: &Unknowns| {
            let seen = self
                .model
                .predict(feature, self.landmarks, landmark, view)?;
            Update::new(&seen, belief, mean)
        };
        let mut update = at(view, &belief.mean)?;
        if taken < LONG_STEPS && update.distance <= FAR * GATE {
            for _ in 0..2 {
                let mean = update.moved(belief);
                update = at(&self.model.view(&mean)?, &mean)?;
            }
        }
        Some(update)
    }

    fn keep(&mut self, reading: Reading) {
        let likely = &mut self.found.likely;
        let at = likely.partition_point(|r| r.score >= reading.score);
        likely.insert(at, reading);
        likely.truncate(MOST_READINGS);
        let least = likely[0].score - self.margin;
        likely.retain(|r| r.score >= least);
    }
}

fn matched(choice: &[Option<usize>]) -> usize {
    choice.iter().flatten().count()
}

/// About 99.9 % of chi-square (Wilson, Hilferty 1931).
fn joint_gate(degrees: usize) -> f64 {
    let n = degrees as f64;
    let part = 2.0 / (9.0 * n);
    n * (1.0 - part + 3.09 * part.sqrt()).powi(3)
}

/// Whether a landmark can be the feature at all: the gate, opened for what the linear step gets wrong from
/// an uncertain prior.
fn wide_gate(seen: &Prediction, start: &Belief) -> bool {
    Update::new(seen, start, &start.mean).is_some_and(|update| update.distance <= FAR * GATE)
}
