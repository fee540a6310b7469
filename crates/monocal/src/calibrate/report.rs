//! What a calibration says of itself: errors of the pairs, and warnings.

use nalgebra::{Matrix2, SMatrix, Vector2};

use super::problem::Measured;
use super::{CalibrateParams, Noise, Side, VarianceScale, consensus};
use crate::{FloorCamera, FloorHomography, GroundPoint, PixelPoint};

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

pub(super) fn report(
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
