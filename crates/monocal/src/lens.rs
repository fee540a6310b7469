//! Lens distortion by ROS's models, and its removal.
//!
//! Source: OpenCV's documentation of `calib3d` and `fisheye`, whose formulas ROS's `camera_info` names. The
//! inverse is found by a bracketed search along the radius, then Newton's method in the plane, and only inside
//! the range in which the model is one to one: further out, polynomials fold the picture over.

use nalgebra::{Matrix2, Vector2};
use thiserror::Error;

use crate::PixelPoint;

/// A pinhole camera's matrix [px].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraMatrix {
    /// Focal length along `u` [px], above 0.
    pub fx: f64,
    /// Focal length along `v` [px], above 0.
    pub fy: f64,
    /// Column of the principal point [px].
    pub cx: f64,
    /// Row of the principal point [px].
    pub cy: f64,
}

/// The distortion models, by ROS's names.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Distortion {
    /// `plumb_bob`: k1, k2, p1, p2, k3.
    PlumbBob([f64; 5]),
    /// `rational_polynomial`: k1, k2, p1, p2, k3, k4, k5, k6.
    RationalPolynomial([f64; 8]),
    /// `equidistant`, a fisheye: k1, k2, k3, k4.
    Equidistant([f64; 4]),
}

/// A lens that cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum LensError {
    /// A focal length is zero, negative or not finite.
    #[error("expected a focal length above 0 px, found {found}")]
    Focal {
        /// The focal length [px].
        found: f64,
    },
    /// A number is NaN or infinite.
    #[error("expected finite numbers, found {found}")]
    NotFinite {
        /// The number.
        found: f64,
    },
    /// The distortion folds the picture over right at its centre.
    #[error(
        "expected distortion that is one to one about the centre, found none beyond {reach} of the focal length"
    )]
    Folded {
        /// Largest radius in which the model is one to one, over the focal length.
        reach: f64,
    },
}

/// A camera matrix and what the lens does to its picture.
///
/// The undistorted picture is that of a pinhole with the same camera matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    matrix: CameraMatrix,
    distortion: Distortion,
    /// Largest undistorted radius in which the model is one to one, over the focal length.
    reach: f64,
}

/// Undistorted radii are searched up to this, over the focal length: 86 degrees off the axis.
const WIDEST: f64 = 14.0;

/// Steps of the search for where a model stops being one to one.
const REACH_STEPS: u32 = 2000;

/// A lens that is one to one over less than this is refused, over the focal length.
const LEAST_REACH: f64 = 0.01;

impl Lens {
    /// A lens from its camera matrix and distortion.
    ///
    /// # Errors
    /// [`LensError`] for numbers that no lens has.
    pub fn new(matrix: CameraMatrix, distortion: Distortion) -> Result<Self, LensError> {
        for found in [matrix.fx, matrix.fy] {
            if !(found.is_finite() && found > 0.0) {
                return Err(LensError::Focal { found });
            }
        }
        let numbers = [matrix.cx, matrix.cy];
        let mut numbers = numbers.iter().chain(distortion.coefficients());
        if let Some(&found) = numbers.find(|n| !n.is_finite()) {
            return Err(LensError::NotFinite { found });
        }
        let reach = distortion.reach();
        if reach < LEAST_REACH {
            return Err(LensError::Folded { reach });
        }
        Ok(Self {
            matrix,
            distortion,
            reach,
        })
    }

    /// The camera matrix.
    #[must_use]
    pub const fn matrix(&self) -> CameraMatrix {
        self.matrix
    }

    /// The distortion.
    #[must_use]
    pub const fn distortion(&self) -> Distortion {
        self.distortion
    }

    /// Whether it bends nothing: a pinhole's picture.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        !matches!(self.distortion, Distortion::Equidistant(_))
            && self.distortion.coefficients().iter().all(|&k| k == 0.0)
    }

    /// The pinhole whose picture the undistorted one is.
    #[must_use]
    pub fn without_distortion(&self) -> Self {
        let distortion = Distortion::PlumbBob([0.0; 5]);
        Self {
            matrix: self.matrix,
            distortion,
            reach: distortion.reach(),
        }
    }

    /// Where the pixel would be without distortion; `None` for pixels that the model cannot have produced
    /// or that look 86 degrees and more away from the axis.
    #[must_use]
    pub fn undistort(&self, pixel: PixelPoint) -> Option<PixelPoint> {
        self.inverse(pixel).map(|ideal| self.projected(ideal))
    }

    /// Where a pixel of the undistorted picture is in the real one; `None` outside the range in which the
    /// model is one to one.
    #[must_use]
    pub fn distort(&self, ideal: PixelPoint) -> Option<PixelPoint> {
        let ideal = self.normalised(ideal);
        (ideal.norm() <= self.reach).then(|| self.projected(self.distortion.apply(ideal)))
    }

    /// How the undistorted pixel moves with the picture's: `[[du'/du, du'/dv], [dv'/du, dv'/dv]]`; `None`
    /// where [`undistort`](Self::undistort) is.
    #[must_use]
    pub fn undistort_jacobian(&self, pixel: PixelPoint) -> Option<[[f64; 2]; 2]> {
        let inverse = self
            .distortion
            .jacobian(self.inverse(pixel)?)
            .try_inverse()?;
        let CameraMatrix { fx, fy, .. } = self.matrix;
        Some([
            [inverse[(0, 0)], inverse[(0, 1)] * fx / fy],
            [inverse[(1, 0)] * fy / fx, inverse[(1, 1)]],
        ])
    }

    fn normalised(&self, p: PixelPoint) -> Vector2<f64> {
        let CameraMatrix { fx, fy, cx, cy } = self.matrix;
        Vector2::new((p.u - cx) / fx, (p.v - cy) / fy)
    }

    fn projected(&self, p: Vector2<f64>) -> PixelPoint {
        let CameraMatrix { fx, fy, cx, cy } = self.matrix;
        PixelPoint::new(fx * p.x + cx, fy * p.y + cy)
    }

    /// The undistorted place of a pixel, over the focal length.
    fn inverse(&self, pixel: PixelPoint) -> Option<Vector2<f64>> {
        let seen = self.normalised(pixel);
        if self.is_plain() {
            return (seen.norm() <= self.reach).then_some(seen);
        }
        let mut ideal = self.along_radius(seen)?;
        for _ in 0..20 {
            let step = self.distortion.jacobian(ideal).try_inverse()?
                * (seen - self.distortion.apply(ideal));
            ideal += step;
            if step.norm() <= 1e-15 * (1.0 + ideal.norm()) {
                break;
            }
        }
        let off = (self.distortion.apply(ideal) - seen).norm();
        (off <= 1e-9 * (1.0 + seen.norm()) && ideal.norm() <= self.reach).then_some(ideal)
    }

    /// The undistorted place if there were no tangential distortion.
    fn along_radius(&self, seen: Vector2<f64>) -> Option<Vector2<f64>> {
        let target = seen.norm();
        if !target.is_finite() {
            return None;
        }
        if target < 1e-12 {
            return Some(seen);
        }
        let radius = |r: f64| self.distortion.radius(r);
        let (mut low, mut high) = (0.0, self.reach);
        // tangential distortion may bring in pixels from just outside
        if target > 1.05 * radius(high) {
            return None;
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if radius(middle) < target {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(seen * (0.5 * (low + high) / target))
    }
}

impl Distortion {
    /// The model's name in `camera_info`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::PlumbBob(_) => "plumb_bob",
            Self::RationalPolynomial(_) => "rational_polynomial",
            Self::Equidistant(_) => "equidistant",
        }
    }

    /// The coefficients, in ROS's order.
    #[must_use]
    pub const fn coefficients(&self) -> &[f64] {
        match self {
            Self::PlumbBob(k) => k,
            Self::RationalPolynomial(k) => k,
            Self::Equidistant(k) => k,
        }
    }

    /// The factor on the radius and its derivative by the squared radius, both at `s = r^2`; of the fisheye
    /// the factor on the angle, by the squared angle.
    fn factor(&self, s: f64) -> (f64, f64) {
        let cubic = |[a, b, c]: [f64; 3]| {
            (
                1.0 + s * (a + s * (b + s * c)),
                a + s * (2.0 * b + s * 3.0 * c),
            )
        };
        match *self {
            Self::PlumbBob([k1, k2, _, _, k3]) => cubic([k1, k2, k3]),
            Self::RationalPolynomial([k1, k2, _, _, k3, k4, k5, k6]) => {
                let (top, top_rate) = cubic([k1, k2, k3]);
                let (bottom, bottom_rate) = cubic([k4, k5, k6]);
                if bottom <= 0.0 {
                    return (f64::NAN, f64::NAN);
                }
                let factor = top / bottom;
                (factor, (top_rate - factor * bottom_rate) / bottom)
            }
            Self::Equidistant([k1, k2, k3, k4]) => (
                1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4))),
                k1 + s * (2.0 * k2 + s * (3.0 * k3 + s * 4.0 * k4)),
            ),
        }
    }

    /// The distorted radius of an undistorted one, without tangential distortion.
    fn radius(&self, r: f64) -> f64 {
        match self {
            Self::Equidistant(_) => {
                let angle = r.atan();
                angle * self.factor(angle * angle).0
            }
            _ => r * self.factor(r * r).0,
        }
    }

    /// Where the distorted radius stops growing.
    fn reach(&self) -> f64 {
        let rate = |t: f64| {
            let (factor, by_square) = self.factor(t * t);
            factor + 2.0 * t * t * by_square
        };
        let widest = WIDEST.atan();
        // steps of equal angle off the axis
        let at = |k: u32| {
            let angle = widest * f64::from(k) / f64::from(REACH_STEPS);
            match self {
                Self::Equidistant(_) => angle,
                _ => angle.tan(),
            }
        };
        // NaN is no growth either
        let folds = |k: &u32| {
            let rate = rate(at(*k));
            rate.is_nan() || rate <= 0.0
        };
        let last = (0..=REACH_STEPS)
            .find(folds)
            .map_or(REACH_STEPS, |k| k.saturating_sub(1));
        match self {
            Self::Equidistant(_) => at(last).tan(),
            _ => at(last),
        }
    }

    fn apply(&self, p: Vector2<f64>) -> Vector2<f64> {
        let s = p.norm_squared();
        match *self {
            Self::Equidistant(_) => {
                let r = s.sqrt();
                if r < 1e-12 {
                    return p;
                }
                p * (self.radius(r) / r)
            }
            Self::PlumbBob([_, _, p1, p2, _]) | Self::RationalPolynomial([_, _, p1, p2, ..]) => {
                let both = 2.0 * p.x * p.y;
                p * self.factor(s).0
                    + Vector2::new(
                        p1 * both + p2 * (s + 2.0 * p.x * p.x),
                        p2 * both + p1 * (s + 2.0 * p.y * p.y),
                    )
            }
        }
    }

    fn jacobian(&self, p: Vector2<f64>) -> Matrix2<f64> {
        let s = p.norm_squared();
        match *self {
            Self::Equidistant(_) => {
                let r = s.sqrt();
                if r < 1e-9 {
                    return Matrix2::identity();
                }
                let angle = r.atan();
                let (factor, by_square) = self.factor(angle * angle);
                let along = (factor + 2.0 * angle * angle * by_square) / (1.0 + s);
                let across = angle * factor / r;
                let unit = p / r;
                Matrix2::identity() * across + unit * unit.transpose() * (along - across)
            }
            Self::PlumbBob([_, _, p1, p2, _]) | Self::RationalPolynomial([_, _, p1, p2, ..]) => {
                let (factor, by_square) = self.factor(s);
                let mixed = 2.0 * (p1 * p.x + p2 * p.y);
                Matrix2::identity() * factor
                    + p * p.transpose() * (2.0 * by_square)
                    + Matrix2::new(
                        2.0 * p1 * p.y + 6.0 * p2 * p.x,
                        mixed,
                        mixed,
                        2.0 * p2 * p.x + 6.0 * p1 * p.y,
                    )
            }
        }
    }
}
