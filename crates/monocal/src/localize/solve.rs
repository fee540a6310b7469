//! From readings to a fix: each reading's most probable unknowns, whether they differ, and what was measured.

use nalgebra::{Cholesky, Matrix2, Matrix3, SymmetricEigen, Vector3};
use occgrid::Pose2;

use super::associate::{DOUBT, Reading, Readings, clutter};
use super::belief::{Belief, Spread, UNKNOWNS, Unknowns};
use super::doubt::doubted;
use super::feature::{Feature, Kind};
use super::landmarks::Landmarks;
use super::model::{Model, Prediction};
use super::{FixStatus, LocateParams, Observed, PoseFix, PositionAxis, Prior};

/// Gauss-Newton steps at most; three are the rule.
const STEPS: usize = 8;
/// A feature's weight falls with its squared distance beyond this [chi-square of 2, 95 %].
const PLAIN: f64 = 6.0;
/// A feature that keeps less than this of its weight is not what it was taken for.
const LEAST_TRUST: f64 = 0.2;
/// Steps below this end the iteration [m, rad].
const SMALL: f64 = 1e-7;
/// Readings whose poses differ by less than these are one place [m, rad], sigmas aside.
const SAME_PLACE: [f64; 2] = [0.01, 0.003];
/// One sigma of a position or heading of which the frame says nothing [m, rad].
const UNMEASURED: f64 = 1e3;

/// Where the likeliest reading takes a smaller share of what is seen for something in the plan, by confidence,
/// what is seen contradicts the prior: some feature fits by chance anywhere.
const LEAST_EXPLAINED: f64 = 0.25;

/// A reading with its most probable unknowns.
struct Solution {
    mean: Unknowns,
    /// Inverse covariance of the unknowns without the pose's prior.
    measured: Spread,
    covariance: Spread,
    score: f64,
}

pub(super) fn unchanged(prior: &Prior, status: FixStatus) -> PoseFix {
    let none = |direction| PositionAxis {
        direction,
        sigma: UNMEASURED,
        observed: false,
    };
    PoseFix {
        status,
        pose: prior.pose,
        covariance: prior.covariance,
        observed: Observed::default(),
        axes: [none([1.0, 0.0]), none([0.0, 1.0])],
        matched: Vec::new(),
        pitch: 0.0,
    }
}

pub(super) fn fix(
    model: &Model<'_>,
    features: &[Feature],
    landmarks: &Landmarks,
    start: &Belief,
    readings: &Readings,
    params: &LocateParams,
) -> PoseFix {
    let solve = |choice: &[Option<usize>], from: &Unknowns| {
        solved(model, features, landmarks, start, choice, from)
    };
    let mut best: Option<(&Reading, Solution)> = None;
    let mut rivals: Vec<(&Reading, Solution)> = Vec::new();
    for reading in &readings.likely {
        // readings that differ in what does not move the robot need no second look
        if best
            .as_ref()
            .is_some_and(|(_, s)| !elsewhere(s, &reading.mean))
        {
            continue;
        }
        let Some(solution) = solve(&reading.choice, &reading.mean) else {
            continue;
        };
        match &mut best {
            Some((_, place)) if place.score >= solution.score => rivals.push((reading, solution)),
            Some(place) => rivals.push(std::mem::replace(place, (reading, solution))),
            None => best = Some((reading, solution)),
        }
    }
    let told = best
        .as_ref()
        .map_or(0.0, |(r, _)| explained(&r.choice, features));
    if told < LEAST_EXPLAINED && !features.is_empty() && model.in_view(landmarks, &start.mean) > 0 {
        return described_prior(start, FixStatus::Lost);
    }
    let mut ambiguous = !readings.complete;
    let mut choice = vec![None; features.len()];
    if let (Some((reading, place)), true) = (&best, readings.complete) {
        choice.clone_from(&reading.choice);
        rivals.retain(|(_, rival)| {
            rival.score > place.score - params.margin && elsewhere(place, &rival.mean)
        });
        rivals.retain(|(rival, _)| contradicts(&rival.choice, &reading.choice, features));
        ambiguous = !rivals.is_empty() || strained(place, start);
        for (rival, _) in &rivals {
            for (mine, other) in choice.iter_mut().zip(&rival.choice) {
                if mine != other {
                    *mine = None;
                }
            }
        }
    }
    let from = match &best {
        Some((_, place)) if !ambiguous => place.mean,
        _ => start.mean,
    };
    let mut solution = solve(&choice, &from);
    if let Some(first) = &solution {
        let mut misfits = false;
        for (feature, choice) in features.iter().zip(&mut choice) {
            if choice.is_some_and(|c| !fits(model, feature, landmarks, c, &first.mean)) {
                *choice = None;
                misfits = true;
            }
        }
        if misfits {
            solution = solve(&choice, &first.mean).or(solution);
        }
    }
    match solution {
        Some(mut solution) => {
            let Solution {
                mean, covariance, ..
            } = &solution;
            let counted = doubted(model, features, landmarks, &choice, mean, covariance);
            if let Some((mean, covariance)) = counted {
                (solution.mean, solution.covariance) = (mean, covariance);
            }
            let matched = choice
                .iter()
                .zip(features)
                .filter_map(|(choice, feature)| Some(model.named(feature, landmarks, (*choice)?)));
            let mut fix = described(&solution, params);
            fix.matched = matched.collect();
            fix.status = if ambiguous {
                FixStatus::Ambiguous
            } else if !fix.matched.is_empty() {
                fix.status
            } else {
                FixStatus::NoMatch
            };
            fix
        }
        None => described_prior(start, FixStatus::NoMatch),
    }
}

fn described_prior(start: &Belief, status: FixStatus) -> PoseFix {
    let pose = Pose2::new(start.mean[0], start.mean[1], start.mean[2]);
    let covariance = std::array::from_fn(|r| std::array::from_fn(|c| start.spread[(r, c)]));
    unchanged(&Prior { pose, covariance }, status)
}

/// The share of the features' confidence that a reading takes for something in the plan.
fn explained(choice: &[Option<usize>], features: &[Feature]) -> f64 {
    let all: f64 = features.iter().map(|f| f.confidence).sum();
    let matched = features.iter().zip(choice).filter(|(_, c)| c.is_some());
    matched.map(|(f, _)| f.confidence).sum::<f64>() / all.max(f64::MIN_POSITIVE)
}

/// Beyond so many sigmas, a nod or roll is a wrong reading's rather than the camera's.
const STRAINED: f64 = 2.5;

/// Whether a reading needs the camera to nod or roll as it hardly does.
fn strained(place: &Solution, start: &Belief) -> bool {
    (3..5).any(|k| place.mean[k].powi(2) > STRAINED * STRAINED * start.spread[(k, k)])
}

/// Whether a reading takes a feature for something else, or does without a corner: with fewer walls the same
/// place is only known less well.
fn contradicts(rival: &[Option<usize>], best: &[Option<usize>], features: &[Feature]) -> bool {
    let differs = |((rival, best), feature): ((&Option<usize>, &Option<usize>), &Feature)| {
        let dropped = rival.is_none() && matches!(feature.kind, Kind::Edge(_));
        rival != best && !dropped
    };
    rival.iter().zip(best).zip(features).any(differs)
}

/// Whether two readings put the robot in different places, by more than the first is uncertain.
fn elsewhere(place: &Solution, other: &Unknowns) -> bool {
    let d = other - place.mean;
    let moved = d[0].hypot(d[1]);
    let sigma = (place.covariance[(0, 0)] + place.covariance[(1, 1)]).sqrt();
    let turned = d[2].abs();
    moved > SAME_PLACE[0] + sigma || turned > SAME_PLACE[1] + place.covariance[(2, 2)].sqrt()
}

/// The most probable unknowns of one reading: Gauss-Newton on features and priors together.
fn solved(
    model: &Model<'_>,
    features: &[Feature],
    landmarks: &Landmarks,
    start: &Belief,
    choice: &[Option<usize>],
    from: &Unknowns,
) -> Option<Solution> {
    let prior = Cholesky::new(start.spread)?.inverse();
    let mut mean = *from;
    let mut information = prior;
    let mut score = 0.0;
    for _ in 0..STEPS {
        information = prior;
        let view = model.view(&mean)?;
        let off = start.mean - mean;
        let mut pull = prior * off;
        score = -0.5 * off.dot(&pull);
        for (feature, choice) in features.iter().zip(choice) {
            let Some(choice) = *choice else {
                let none =
                    (1.0 - feature.confidence.clamp(DOUBT, 1.0 - DOUBT)) * clutter(feature.kind);
                score += none.ln();
                continue;
            };
            let seen = model.predict(feature, landmarks, choice, &view)?;
            let weight = seen.noise.try_inverse()?;
            let distance = seen.residual.dot(&(weight * seen.residual));
            let weighted = seen.rows.transpose() * weight * trust(&seen)?;
            information += weighted * seen.rows;
            pull -= weighted * seen.residual;
            score -=
                0.5 * distance + (std::f64::consts::TAU * seen.noise.determinant().sqrt()).ln();
            score += feature.confidence.clamp(DOUBT, 1.0 - DOUBT).ln();
        }
        let step = Cholesky::new(information)?.solve(&pull);
        mean += step;
        if step.fixed_rows::<5>(0).amax() < SMALL {
            break;
        }
    }
    let factor = Cholesky::new(information)?;
    // Laplace: how much room the unknowns keep
    score -= factor
        .l_dirty()
        .diagonal()
        .iter()
        .map(|d| d.ln())
        .sum::<f64>();
    let mut measured = information;
    for r in 0..3 {
        for c in 0..3 {
            measured[(r, c)] -= prior[(r, c)];
        }
    }
    Some(Solution {
        mean,
        measured,
        covariance: factor.inverse(),
        score,
    })
}

/// Whether a feature has kept its weight: one that was taken early, from far off, may not fit the rest.
fn fits(
    model: &Model<'_>,
    feature: &Feature,
    landmarks: &Landmarks,
    choice: usize,
    at: &Unknowns,
) -> bool {
    let view = model.view(at);
    let seen = view.and_then(|view| model.predict(feature, landmarks, choice, &view));
    seen.and_then(|seen| trust(&seen))
        .is_some_and(|trust| trust >= LEAST_TRUST)
}

/// The weight of a feature: what no constant tells of its noise, its residual does.
pub(super) fn trust(seen: &Prediction) -> Option<f64> {
    let distance = seen
        .residual
        .dot(&(seen.noise.try_inverse()? * seen.residual));
    Some((PLAIN / distance).min(1.0))
}

/// A fix without its matches; its status says only what was observed.
fn described(solution: &Solution, params: &LocateParams) -> PoseFix {
    let mean = &solution.mean;
    let alone = measured_alone(&solution.measured);
    let block = Matrix2::from_fn(|r, c| alone[(r, c)]);
    let eigen = SymmetricEigen::new(block);
    let axis = |k: usize| {
        let sigma = eigen.eigenvalues[k].max(0.0).sqrt();
        PositionAxis {
            direction: [eigen.eigenvectors[(0, k)], eigen.eigenvectors[(1, k)]],
            sigma,
            observed: sigma <= params.observed_position,
        }
    };
    let best = usize::from(eigen.eigenvalues[1] < eigen.eigenvalues[0]);
    let within = |k: usize, most: f64| alone[(k, k)].max(0.0).sqrt() <= most;
    let observed = Observed {
        x: within(0, params.observed_position),
        y: within(1, params.observed_position),
        theta: within(2, params.observed_heading),
    };
    let axes = [axis(best), axis(1 - best)];
    let all = observed.x && observed.y && observed.theta;
    let covariance = &solution.covariance;
    PoseFix {
        status: if all {
            FixStatus::Ok
        } else {
            FixStatus::Partial
        },
        pose: Pose2::new(mean[0], mean[1], mean[2].sin().atan2(mean[2].cos())),
        covariance: std::array::from_fn(|r| std::array::from_fn(|c| covariance[(r, c)])),
        observed,
        axes,
        matched: Vec::new(),
        pitch: mean[3],
    }
}

/// Covariance of the pose from the frame alone, the nuisances' priors included.
fn measured_alone(information: &Spread) -> Matrix3<f64> {
    let pose = information.fixed_view::<3, 3>(0, 0).into_owned();
    let mixed = information
        .fixed_view::<3, { UNKNOWNS - 3 }>(0, 3)
        .into_owned();
    let rest = information.fixed_view::<{ UNKNOWNS - 3 }, { UNKNOWNS - 3 }>(3, 3);
    let kept = match Cholesky::new(rest.into_owned()) {
        Some(rest) => pose - mixed * rest.solve(&mixed.transpose()),
        None => Matrix3::zeros(),
    };
    // about the robot and along the eigenvectors, so that a direction without information stays apart
    let floor = UNMEASURED.powi(-2);
    let eigen = SymmetricEigen::new(0.5 * (kept + kept.transpose()));
    let spread = Vector3::from_fn(|k, _| 1.0 / eigen.eigenvalues[k].max(floor));
    eigen.eigenvectors * Matrix3::from_diagonal(&spread) * eigen.eigenvectors.transpose()
}
