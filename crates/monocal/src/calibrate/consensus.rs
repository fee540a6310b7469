//! Which pairs agree with each other: a robust start, then every pair judged by the fit to the others.
//!
//! From eight pairs up the noise itself is measured: of fits through four pairs each the one with the least
//! median error is concentrated on its better half, then grown until no further pair fits (least median of
//! squares: P. Rousseeuw, Journal of the American Statistical Association, 1984). Below eight a median says
//! little; there the expected noise decides, and with five pairs there is no telling which is wrong.
//! No randomness is used beyond a fixed sequence.

use super::problem::{Fit, Problem};
use super::{CalibrateError, CalibrateParams};

/// The pairs that agree, in order, and their fit.
#[derive(Debug)]
pub(super) struct Consensus {
    pub(super) inliers: Vec<usize>,
    pub(super) fit: Fit,
}

/// From this many pairs up the noise is measured.
pub(super) const MANY: usize = 8;

/// Subsets of four are tried exhaustively up to this number, else this many of them.
const MOST_SUBSETS: usize = 500;

/// A set of which every pair is right is cut by a pair once in this many.
const FALSE_ALARM: f64 = 1e-3;

/// The noise of a pair is not taken for less than this, over the expected: pairs written with few digits.
const LEAST_SIGMA: f64 = 0.02;

/// Fewer pairs than [`MANY`] agree up to this RMS error [sigmas of the expected noise].
const FEW_AGREE: f64 = 4.0;

/// One of fewer pairs than [`MANY`] is at fault where the others agree up to this RMS error [sigmas].
const FEW_CLEAN: f64 = 3.0;

/// A fit is none beyond this RMS error, over the RMS distance of the pixels from their centre.
const LEAST_AGREEMENT: f64 = 0.05;

/// Finds the pairs that agree.
pub(super) fn find(
    problem: &Problem,
    params: &CalibrateParams,
) -> Result<Consensus, CalibrateError> {
    let all: Vec<usize> = (0..problem.len()).collect();
    let spread = problem.pixel_spread(&all);
    if let Some(map) = problem.linear(&all)
        && problem.rms_pixel(&map, &all) <= LEAST_AGREEMENT * spread
        && let Some(&index) = problem.behind(&map, &all).first()
    {
        return Err(CalibrateError::BeyondHorizon { index });
    }
    let found = match problem.len() {
        4 => four(problem, &all)?,
        5..MANY => few(problem, &all)?,
        _ => many(problem, &all, params)?,
    };
    let rms = problem.rms_pixel(&found.fit.map, &found.inliers);
    if rms.is_nan() || rms > LEAST_AGREEMENT * problem.pixel_spread(&found.inliers) {
        return Err(inconsistent(problem, Some(&found.fit)));
    }
    Ok(found)
}

fn inconsistent(problem: &Problem, fit: Option<&Fit>) -> CalibrateError {
    let all: Vec<usize> = (0..problem.len()).collect();
    CalibrateError::Inconsistent {
        pairs: problem.len(),
        rms_px: fit.map_or(f64::INFINITY, |fit| problem.rms_pixel(&fit.map, &all)),
    }
}

/// Four pairs determine a map exactly; it may still be none of a camera.
fn four(problem: &Problem, all: &[usize]) -> Result<Consensus, CalibrateError> {
    let map = problem.linear(all).ok_or(CalibrateError::Undetermined)?;
    let fit = problem
        .refine(&map, all)
        .ok_or(CalibrateError::Undetermined)?;
    Ok(Consensus {
        inliers: all.to_vec(),
        fit,
    })
}

fn few(problem: &Problem, all: &[usize]) -> Result<Consensus, CalibrateError> {
    let rms = |fit: &Fit, pairs: usize| (fit.cost / degrees(pairs)).sqrt();
    let whole = problem.solve(all);
    if let Some(fit) = &whole
        && rms(fit, all.len()) <= FEW_AGREE
    {
        return Ok(Consensus {
            inliers: all.to_vec(),
            fit: fit.clone(),
        });
    }
    let mut cured = Vec::new();
    if all.len() > 5 {
        for &suspect in all {
            let rest: Vec<usize> = all.iter().copied().filter(|&i| i != suspect).collect();
            if let Some(fit) = problem.solve(&rest) {
                let error = rms(&fit, rest.len());
                cured.push((error, Consensus { inliers: rest, fit }));
            }
        }
    }
    cured.retain(|(error, _)| *error <= FEW_AGREE);
    match cured.pop() {
        Some((error, only)) if cured.is_empty() && error <= FEW_CLEAN => Ok(only),
        _ => Err(inconsistent(problem, whole.as_ref())),
    }
}

fn many(
    problem: &Problem,
    all: &[usize],
    params: &CalibrateParams,
) -> Result<Consensus, CalibrateError> {
    let mut best: Option<(f64, Fit)> = None;
    for subset in subsets(all.len()) {
        let Some(map) = problem.through(subset) else {
            continue;
        };
        let median = median(problem, &map, all);
        if median < best.as_ref().map_or(f64::INFINITY, |b| b.0)
            && let Some(fit) = problem.refine(&map, &subset)
        {
            best = Some((median, fit));
        }
    }
    let (_, mut fit) = best.ok_or_else(|| inconsistent(problem, problem.solve(all).as_ref()))?;
    // concentration: fit to the better half, a few times
    let half = all.len() / 2 + 3;
    let mut inliers = Vec::new();
    for _ in 0..5 {
        inliers = ranked(problem, &fit.map, all)[..half]
            .iter()
            .map(|r| r.1)
            .collect();
        fit = match problem.refine(&fit.map, &inliers) {
            Some(better) => better,
            None => return Err(inconsistent(problem, Some(&fit))),
        };
    }
    // the median of a squared error in two dimensions is 2 ln 2 variances
    let median = median(problem, &fit.map, all);
    let spare = 1.0 + 5.0 / (all.len() as f64 - 4.0);
    let mut noise = if params.estimate_sigma {
        NoiseScale::Robust(median / (2.0 * std::f64::consts::LN_2) * spare * spare)
    } else {
        NoiseScale::Given
    };
    for _ in 0..20 {
        let grown = fitting(problem, &fit, all, &inliers, noise);
        if grown.len() < all.len() / 2 + 2 {
            return Err(inconsistent(problem, Some(&fit)));
        }
        let settled = grown == inliers;
        inliers = grown;
        fit = match problem.refine(&fit.map, &inliers) {
            Some(better) => better,
            None => return Err(inconsistent(problem, Some(&fit))),
        };
        if params.estimate_sigma {
            noise = NoiseScale::OfOthers;
        }
        if settled {
            break;
        }
    }
    Ok(Consensus { inliers, fit })
}

/// What a pair's error is measured by.
#[derive(Debug, Clone, Copy)]
enum NoiseScale {
    /// The expected variances.
    Given,
    /// The expected variances times this.
    Robust(f64),
    /// The expected variances times what the errors of the other pairs in the fit say.
    OfOthers,
}

/// The pairs whose error is no surprise, each judged by the fit to the others.
fn fitting(
    problem: &Problem,
    fit: &Fit,
    all: &[usize],
    inliers: &[usize],
    noise: NoiseScale,
) -> Vec<usize> {
    let chance = FALSE_ALARM / all.len() as f64;
    let fits = |i: &usize| {
        let inside = inliers.binary_search(i).is_ok();
        let surprise = problem.squared_surprise(fit, *i, inside);
        // without a pair that is inside, cost and degrees are those of the others
        let (own, spare) = if inside { (surprise, 2.0) } else { (0.0, 0.0) };
        let spare = degrees(inliers.len()) - spare;
        let scale = match noise {
            NoiseScale::Given => return surprise <= -2.0 * chance.ln(),
            NoiseScale::Robust(scale) => scale,
            NoiseScale::OfOthers => (fit.cost - own) / spare,
        };
        // twice the quantile of F(2, spare)
        let limit = spare * (chance.powf(-2.0 / spare) - 1.0);
        surprise <= limit * scale.max(LEAST_SIGMA * LEAST_SIGMA)
    };
    all.iter().copied().filter(fits).collect()
}

/// Residual degrees of freedom.
pub(super) fn degrees(pairs: usize) -> f64 {
    2.0 * pairs as f64 - 8.0
}

/// The median squared error.
fn median(problem: &Problem, map: &nalgebra::Matrix3<f64>, all: &[usize]) -> f64 {
    let mut errors: Vec<f64> = all.iter().map(|&i| problem.squared_error(map, i)).collect();
    *errors
        .select_nth_unstable_by(all.len() / 2, f64::total_cmp)
        .1
}

/// Squared errors with their pairs, least first.
fn ranked(problem: &Problem, map: &nalgebra::Matrix3<f64>, all: &[usize]) -> Vec<(f64, usize)> {
    let mut ranked: Vec<(f64, usize)> = all
        .iter()
        .map(|&i| (problem.squared_error(map, i), i))
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    ranked
}

/// Subsets of four: all of them, or a fixed pseudo-random choice.
fn subsets(count: usize) -> Vec<[usize; 4]> {
    let mut subsets = Vec::new();
    if count <= 11 {
        for a in 0..count {
            for b in a + 1..count {
                for c in b + 1..count {
                    subsets.extend((c + 1..count).map(|d| [a, b, c, d]));
                }
            }
        }
        return subsets;
    }
    let mut state = 1999_u64;
    let mut draw = || {
        // SplitMix64 (G. Steele, D. Lea, C. Flood, OOPSLA 2014)
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % count as u64) as usize
    };
    while subsets.len() < MOST_SUBSETS {
        let four = [draw(), draw(), draw(), draw()];
        let different = (0..4).all(|k| four[..k].iter().all(|other| *other != four[k]));
        if different {
            subsets.push(four);
        }
    }
    subsets
}
