//! From pixel-to-floor pairs to a camera with error bars (Choi, Ryu, Kim 1999, section 3.1).

mod consensus;
mod degenerate;
mod error;
mod normal;
mod problem;
mod report;

use nalgebra::{Matrix2, Vector2};

use crate::{GroundPoint, Lens, PixelPoint};
use consensus::{Consensus, degrees};
pub use error::{CalibrateError, Side};
use problem::{Fit, Measured, Problem};
use report::report;
pub use report::{CalibrateWarning, Calibration, ErrorSummary, PairError};

/// A mark on the floor and where it is in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Where it is in the picture as the camera gives it, lens and all [px].
    pub pixel: PixelPoint,
    /// Where it is on the floor [m].
    pub floor: GroundPoint,
}

impl Pair {
    /// A pair from pixel `[u, v]` and floor point `[x, y]`.
    #[must_use]
    pub fn new(pixel: impl Into<PixelPoint>, floor: impl Into<GroundPoint>) -> Self {
        Self {
            pixel: pixel.into(),
            floor: floor.into(),
        }
    }
}

/// Which half of the pairs is measured with errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Noise {
    /// The marks are placed exactly, their pixels are read with errors.
    #[default]
    Pixel,
    /// The pixels are exact, the marks are measured on the floor with errors.
    Floor,
    /// Both have errors, in the ratio of the two sigmas.
    Both,
}

/// How to calibrate.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrateParams {
    /// What is noisy.
    pub noise: Noise,
    /// Expected error of a pixel coordinate, one sigma [px], above 0. Where `noise` is `Floor` it only says
    /// how well pixels will be read later.
    pub pixel_sigma_px: f64,
    /// Expected error of a floor coordinate, one sigma [m], above 0.
    pub floor_sigma: f64,
    /// Measure the noise from the residuals (from 8 pairs up; below, it is only ever raised above the
    /// expected). Without it the sigmas above are taken as they are.
    pub estimate_sigma: bool,
    /// Width and height of the picture [px], where known.
    pub image_size: Option<[u32; 2]>,
    /// The lens, undone before the fit.
    pub lens: Option<Lens>,
}

impl Default for CalibrateParams {
    fn default() -> Self {
        Self {
            noise: Noise::Pixel,
            pixel_sigma_px: 0.5,
            floor_sigma: 0.005,
            estimate_sigma: true,
            image_size: None,
            lens: None,
        }
    }
}

/// The most pairs that [`calibrate`] takes: each is left out once.
pub const MOST_PAIRS: usize = 1000;

/// A fit with a direction less certain than this is refused [rad of the unit 9-vector, normalised].
const WORST_SIGMA: f64 = 0.1;

/// Fits a camera to pixel-to-floor pairs, four and more.
///
/// Normalised linear solve, robust choice of the pairs that agree, Gauss-Newton on the error that is noisy,
/// covariance, and one fit for each pair left out. Deterministic. Time is quadratic in the number of pairs.
///
/// # Errors
/// [`CalibrateError`], with the reason, for pairs that determine no camera over a floor.
pub fn calibrate(pairs: &[Pair], params: &CalibrateParams) -> Result<Calibration, CalibrateError> {
    check(pairs, params)?;
    let measured = measured(pairs, params)?;
    let all: Vec<usize> = (0..pairs.len()).collect();
    check_shape(&measured, &all)?;
    let problem = Problem::new(&measured);
    let Consensus { inliers, fit } = consensus::find(&problem, params)?;
    if inliers.len() < pairs.len() {
        check_shape(&measured, &inliers)?;
    }
    if problem.is_mirrored(&fit.map) {
        return Err(CalibrateError::Mirrored);
    }
    let scale = variance_scale(&fit, inliers.len(), params);
    if fit.worst_sigma * scale.measured.sqrt() > WORST_SIGMA {
        return Err(CalibrateError::Undetermined);
    }
    let (homography, covariance) = problem
        .homography(&fit, scale.covariance)
        .ok_or(CalibrateError::Undetermined)?;
    let held_out = held_out(&problem, &fit, &measured, &inliers);
    Ok(report(
        &measured, homography, covariance, &inliers, &held_out, scale, params,
    ))
}

/// Refuses pairs and parameters that are wrong one by one.
fn check(pairs: &[Pair], params: &CalibrateParams) -> Result<(), CalibrateError> {
    for (name, found) in [
        ("pixel_sigma_px", params.pixel_sigma_px),
        ("floor_sigma", params.floor_sigma),
    ] {
        if !(found.is_finite() && found > 0.0) {
            return Err(CalibrateError::Sigma { name, found });
        }
    }
    let found = pairs.len();
    if found > MOST_PAIRS {
        return Err(CalibrateError::TooMany {
            most: MOST_PAIRS,
            found,
        });
    }
    for (index, pair) in pairs.iter().enumerate() {
        let sides = [
            (Side::Picture, pair.pixel.u, pair.pixel.v),
            (Side::Floor, pair.floor.x, pair.floor.y),
        ];
        for (side, a, b) in sides {
            if !(a.abs() <= 1e6 && b.abs() <= 1e6) {
                return Err(CalibrateError::OutOfRange { index, side, a, b });
            }
        }
        if let Some(first) = pairs[..index].iter().position(|other| other == pair) {
            return Err(CalibrateError::Duplicate {
                first,
                second: index,
            });
        }
    }
    if found < 4 {
        return Err(CalibrateError::TooFew { found });
    }
    Ok(())
}

/// The pairs without lens distortion, with the variances that are expected of them.
fn measured(pairs: &[Pair], params: &CalibrateParams) -> Result<Vec<Measured>, CalibrateError> {
    let (pixel_sigma, floor_sigma) = match params.noise {
        Noise::Pixel => (params.pixel_sigma_px, 0.0),
        Noise::Floor => (0.0, params.floor_sigma),
        Noise::Both => (params.pixel_sigma_px, params.floor_sigma),
    };
    let one = |(index, pair): (usize, &Pair)| {
        let PixelPoint { u, v } = pair.pixel;
        let outside = CalibrateError::OutsideLens { index, u, v };
        let (pixel, slope) = match &params.lens {
            None => (pair.pixel, Matrix2::identity()),
            Some(lens) => lens
                .undistort(pair.pixel)
                .zip(lens.undistort_jacobian(pair.pixel))
                .map(|(pixel, [a, b])| (pixel, Matrix2::new(a[0], a[1], b[0], b[1])))
                .ok_or(outside)?,
        };
        Ok(Measured {
            pixel: Vector2::new(pixel.u, pixel.v),
            pixel_noise: slope * slope.transpose() * pixel_sigma.powi(2),
            floor: Vector2::new(pair.floor.x, pair.floor.y),
            floor_noise: floor_sigma.powi(2),
        })
    };
    pairs.iter().enumerate().map(one).collect()
}

/// Points nearer to a line than this many sigmas of their noise are on it.
const LINE_SIGMAS: f64 = 3.0;

/// Points nearer to a line than this share of their extent are on it, however exact they are.
const LINE_SHARE: f64 = 1e-6;

fn check_shape(measured: &[Measured], chosen: &[usize]) -> Result<(), CalibrateError> {
    let pixels: Vec<_> = chosen.iter().map(|&i| measured[i].pixel).collect();
    let floor: Vec<_> = chosen.iter().map(|&i| measured[i].floor).collect();
    let noise = |variance: fn(&Measured) -> f64| {
        let largest = chosen
            .iter()
            .map(|&i| variance(&measured[i]))
            .fold(0.0, f64::max);
        LINE_SIGMAS * largest.sqrt()
    };
    let tolerance = noise(|m| m.pixel_noise.trace() / 2.0).max(LINE_SHARE * extent(&pixels));
    degenerate::check(Side::Picture, &pixels, chosen, tolerance)?;
    let tolerance = noise(|m| m.floor_noise).max(LINE_SHARE * extent(&floor));
    degenerate::check(Side::Floor, &floor, chosen, tolerance)
}

/// The largest distance from the first point.
fn extent(points: &[Vector2<f64>]) -> f64 {
    points
        .iter()
        .map(|p| (p - points[0]).norm())
        .fold(0.0, f64::max)
}

/// Chi-square with two degrees of freedom that chance keeps below 95 times in 100.
const CHI_SQUARE_95: f64 = 5.991_464_547;

/// Factors on the expected variances.
#[derive(Debug, Clone, Copy)]
struct VarianceScale {
    /// Of the noise.
    measured: f64,
    /// Of the parameters' covariance: larger where the noise itself is measured from few residuals.
    covariance: f64,
}

/// What the residuals say of the noise. An error over a measured sigma follows a t distribution, wider than
/// the normal one: the covariance is widened so that its ellipse at chi-square 5.991 holds 95 %, which
/// is the quantile of 2 F(2, n), `n` the residual degrees of freedom.
fn variance_scale(fit: &Fit, pairs: usize, params: &CalibrateParams) -> VarianceScale {
    let spare = degrees(pairs);
    let scale = if spare > 0.0 { fit.cost / spare } else { 1.0 };
    if !params.estimate_sigma {
        return VarianceScale {
            measured: 1.0,
            covariance: 1.0,
        };
    }
    if pairs < consensus::MANY {
        let measured = scale.max(1.0);
        return VarianceScale {
            measured,
            covariance: measured,
        };
    }
    VarianceScale {
        measured: scale,
        covariance: scale * spare * (0.05_f64.powf(-2.0 / spare) - 1.0) / CHI_SQUARE_95,
    }
}

/// The floor error of each pair that fits, by the fit to the others.
fn held_out(
    problem: &Problem,
    fit: &Fit,
    measured: &[Measured],
    inliers: &[usize],
) -> Vec<Option<f64>> {
    let without = |&left_out: &usize| {
        let rest: Vec<usize> = inliers.iter().copied().filter(|&i| i != left_out).collect();
        if rest.len() < 4 || check_shape(measured, &rest).is_err() {
            return None;
        }
        let fit = problem.refine(&fit.map, &rest)?;
        let (homography, _) = problem.homography(&fit, 1.0)?;
        let Measured { pixel, floor, .. } = measured[left_out];
        let seen = homography.floor_point(PixelPoint::new(pixel.x, pixel.y))?;
        Some(seen.distance(GroundPoint::new(floor.x, floor.y)))
    };
    inliers.iter().map(without).collect()
}
