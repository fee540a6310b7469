//! From pixel-to-floor pairs to a camera with error bars (Choi, Ryu, Kim 1999, section 3.1).

mod consensus;
mod degenerate;
mod problem;

use nalgebra::{Matrix2, SMatrix, Vector2};
use thiserror::Error;

use crate::{FloorCamera, FloorHomography, GroundPoint, Lens, PixelPoint};
use consensus::{Consensus, degrees};
use problem::{Fit, Measured, Problem};

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

/// The picture or the floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Pixels.
    Picture,
    /// Floor points.
    Floor,
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Picture => "pixels",
            Self::Floor => "floor points",
        })
    }
}

/// Why pairs determine no camera over a floor. Pairs are numbered from 0.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// Fewer than four pairs.
    #[error("expected at least 4 pairs, found {found}")]
    TooFew {
        /// Number of pairs.
        found: usize,
    },
    /// More than [`MOST_PAIRS`].
    #[error("expected at most {most} pairs, found {found}")]
    TooMany {
        /// [`MOST_PAIRS`].
        most: usize,
        /// Number of pairs.
        found: usize,
    },
    /// A coordinate is NaN, infinite or beyond a million pixels or metres.
    #[error("pair {index}: expected {side} within a million, found ({a}, {b})")]
    OutOfRange {
        /// The pair.
        index: usize,
        /// Where.
        side: Side,
        /// First coordinate.
        a: f64,
        /// Second coordinate.
        b: f64,
    },
    /// Two pairs are the same.
    #[error("pair {second}: expected another pair than {first}, found the same")]
    Duplicate {
        /// The first of the two.
        first: usize,
        /// The second of the two.
        second: usize,
    },
    /// The lens model cannot have produced this pixel.
    #[error("pair {index}: expected a pixel within the lens model's range, found ({u}, {v})")]
    OutsideLens {
        /// The pair.
        index: usize,
        /// Column [px].
        u: f64,
        /// Row [px].
        v: f64,
    },
    /// An expected sigma is not a number above zero.
    #[error("{name}: expected a number above 0, found {found}")]
    Sigma {
        /// Of the parameter.
        name: &'static str,
        /// Its value.
        found: f64,
    },
    /// Marks were read several times each, but there are too few of them.
    #[error("{side}: expected at least 4 different places, found {found}")]
    FewPlaces {
        /// Where.
        side: Side,
        /// Number of different places.
        found: usize,
    },
    /// All points are on a line, to within the expected noise.
    #[error("{side}: expected points on more than one line, found all on one")]
    Collinear {
        /// Where.
        side: Side,
    },
    /// All points but one are on a line, to within the expected noise; of four, three.
    #[error(
        "{side}: expected two points and more off any line, found all but that of pair {off} on one"
    )]
    CollinearButOne {
        /// Where.
        side: Side,
        /// The pair that is off the line.
        off: usize,
    },
    /// The pairs only fit a camera behind which some of its own floor points lie.
    #[error(
        "pair {index}: expected a floor point before the camera, found one beyond the horizon of the others"
    )]
    BeyondHorizon {
        /// One of the pairs beyond.
        index: usize,
    },
    /// The pairs show the floor in a mirror: an axis points the wrong way.
    #[error(
        "expected x forward and y to the left, u to the right and v down, found a mirrored floor"
    )]
    Mirrored,
    /// The pairs do not agree on any homography.
    #[error(
        "expected pairs that agree, found {pairs} with errors of {rms_px:.1} px (RMS) at the best"
    )]
    Inconsistent {
        /// Number of pairs.
        pairs: usize,
        /// RMS distance of all pixels from where the best fit puts them [px].
        rms_px: f64,
    },
    /// The pairs hardly determine a homography, for no reason that has a name above.
    #[error(
        "expected pairs that determine all 8 degrees of freedom, found them all but degenerate"
    )]
    Undetermined,
}

/// What to look at before trusting a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum CalibrateWarning {
    /// Fewer than eight pairs fit: little is left over to measure the noise by, and a wrong pair may hide.
    FewPairs {
        /// Number of pairs that fit.
        found: usize,
    },
    /// The points are spread out much less in one direction than in the other.
    PoorSpread {
        /// Where.
        side: Side,
        /// Sigma across over sigma along.
        ratio: f64,
    },
    /// A direction of the homography hangs on one pair: without it the rest is degenerate.
    HangsOn {
        /// The pair.
        index: usize,
    },
}

impl std::fmt::Display for CalibrateWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::FewPairs { found } => {
                write!(
                    f,
                    "only {found} pairs: the error bars rest on the expected noise, and a wrong pair may hide; take 8 or more"
                )
            }
            Self::PoorSpread { side, ratio } => write!(
                f,
                "the {side} are spread {ratio:.2} as wide across as along; spread the marks over the floor"
            ),
            Self::HangsOn { index } => {
                write!(
                    f,
                    "the fit hangs on pair {index}: without it the others are on a line"
                )
            }
        }
    }
}

/// Mean and largest of some distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorSummary {
    /// [m]
    pub mean: f64,
    /// [m]
    pub max: f64,
}

/// How a pair agrees with the calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairError {
    /// It took part in the fit.
    pub fits: bool,
    /// Floor point of its pixel less its floor point [m]; NaN where the pixel sees no floor.
    pub floor: [f64; 2],
    /// Its pixel less the pixel of its floor point, both undistorted [px]; NaN behind the camera.
    pub pixel: [f64; 2],
    /// Distance on the floor by the fit to the other pairs [m]; `None` where they determine none.
    pub held_out: Option<f64>,
}

/// A calibrated camera and how well the pairs agree with it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Calibration {
    /// The camera.
    pub camera: FloorCamera,
    /// One for each pair, in order.
    pub errors: Vec<PairError>,
    /// The pairs that do not fit, in order; they took no part in the fit.
    pub outliers: Vec<usize>,
    /// Distances on the floor of the pairs that fit, by the fit to all of them [m].
    pub residual: ErrorSummary,
    /// Distances on the floor of the pairs that fit, each by the fit to the others [m]; `None` where one of
    /// them cannot be left out.
    pub held_out: Option<ErrorSummary>,
    /// Noise of a pixel coordinate, measured or expected [px]; 0 where only the floor is noisy.
    pub pixel_sigma_px: f64,
    /// Noise of a floor coordinate, measured or expected [m]; 0 where only the pixels are noisy.
    pub floor_sigma: f64,
    /// What to look at before trusting it.
    pub warnings: Vec<CalibrateWarning>,
}

/// Points spread less across than along by more than this are warned of.
const POOR_SPREAD: f64 = 0.12;

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

fn report(
    measured: &[Measured],
    homography: FloorHomography,
    covariance: SMatrix<f64, 8, 8>,
    inliers: &[usize],
    held_out: &[Option<f64>],
    scale: VarianceScale,
    params: &CalibrateParams,
) -> Calibration {
    let errors: Vec<PairError> = (0..measured.len())
        .map(|i| {
            pair_error(
                &homography,
                &measured[i],
                inliers.binary_search(&i).ok().map(|k| held_out[k]),
            )
        })
        .collect();
    let of_fitting = errors
        .iter()
        .filter(|e| e.fits)
        .map(|e| e.floor[0].hypot(e.floor[1]));
    let sigma = scale.measured.sqrt();
    let (pixel_sigma_px, floor_sigma) = match params.noise {
        Noise::Pixel => (params.pixel_sigma_px * sigma, 0.0),
        Noise::Floor => (0.0, params.floor_sigma * sigma),
        Noise::Both => (params.pixel_sigma_px * sigma, params.floor_sigma * sigma),
    };
    Calibration {
        camera: FloorCamera {
            homography,
            covariance: std::array::from_fn(|r| std::array::from_fn(|c| covariance[(r, c)])),
            pixel_sigma_px: match params.noise {
                Noise::Floor => params.pixel_sigma_px,
                // of a pixel still to come: wider where the noise was measured from few residuals
                _ => params.pixel_sigma_px * scale.covariance.sqrt(),
            },
            image_size: params.image_size,
            lens: params.lens,
        },
        outliers: (0..errors.len()).filter(|&i| !errors[i].fits).collect(),
        residual: summary(of_fitting),
        held_out: held_out
            .iter()
            .copied()
            .collect::<Option<Vec<f64>>>()
            .map(|distances| summary(distances.into_iter())),
        errors,
        pixel_sigma_px,
        floor_sigma,
        warnings: warnings(measured, inliers, held_out),
    }
}

fn pair_error(
    homography: &FloorHomography,
    pair: &Measured,
    held_out: Option<Option<f64>>,
) -> PairError {
    let pixel = PixelPoint::new(pair.pixel.x, pair.pixel.y);
    let floor = GroundPoint::new(pair.floor.x, pair.floor.y);
    let on_floor = homography.floor_point(pixel);
    let in_picture = homography.pixel_of(floor);
    PairError {
        fits: held_out.is_some(),
        floor: on_floor.map_or([f64::NAN; 2], |p| [p.x - floor.x, p.y - floor.y]),
        pixel: in_picture.map_or([f64::NAN; 2], |p| [pixel.u - p.u, pixel.v - p.v]),
        held_out: held_out.flatten(),
    }
}

fn summary(distances: impl Iterator<Item = f64>) -> ErrorSummary {
    let (mut count, mut sum, mut max) = (0_u32, 0.0, 0.0_f64);
    for distance in distances {
        count += 1;
        sum += distance;
        max = max.max(distance);
    }
    ErrorSummary {
        mean: sum / f64::from(count.max(1)),
        max,
    }
}

fn warnings(
    measured: &[Measured],
    inliers: &[usize],
    held_out: &[Option<f64>],
) -> Vec<CalibrateWarning> {
    let mut warnings = Vec::new();
    if inliers.len() < consensus::MANY {
        warnings.push(CalibrateWarning::FewPairs {
            found: inliers.len(),
        });
    }
    let pixels: Vec<_> = inliers.iter().map(|&i| measured[i].pixel).collect();
    let floor: Vec<_> = inliers.iter().map(|&i| measured[i].floor).collect();
    for (side, points) in [(Side::Picture, pixels), (Side::Floor, floor)] {
        let ratio = spread(&points);
        if ratio < POOR_SPREAD {
            warnings.push(CalibrateWarning::PoorSpread { side, ratio });
        }
    }
    if inliers.len() > 4 {
        let alone = inliers
            .iter()
            .zip(held_out)
            .filter(|(_, error)| error.is_none());
        warnings.extend(alone.map(|(&index, _)| CalibrateWarning::HangsOn { index }));
    }
    warnings
}

/// Sigma across over sigma along of some points.
fn spread(points: &[Vector2<f64>]) -> f64 {
    let center = points.iter().sum::<Vector2<f64>>() / points.len() as f64;
    let moments: Matrix2<f64> = points
        .iter()
        .map(|p| (p - center) * (p - center).transpose())
        .sum();
    let values = moments.symmetric_eigenvalues();
    (values.min().max(0.0) / values.max()).sqrt()
}
