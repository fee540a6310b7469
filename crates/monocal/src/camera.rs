//! A calibrated camera: its homography, how sure that is, its picture's size and its lens.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, SMatrix};

use crate::chart;
use crate::{FloorHomography, GroundPoint, Lens, PixelPoint, Resolution};

/// Degrees of freedom of a homography.
pub const DEGREES_OF_FREEDOM: usize = 8;

/// A camera that looks at a floor.
///
/// All methods take and give pixels of the picture as it is; the lens is undone inside.
#[derive(Debug, Clone, PartialEq)]
pub struct FloorCamera {
    /// From undistorted pixels to the floor.
    pub homography: FloorHomography,
    /// Covariance of the homography's 8 degrees of freedom in the chart of the
    /// crate's documentation (changes of the unit 9-vector of entries, by a Householder basis); zeros for
    /// a homography that is taken as exact.
    pub covariance: [[f64; DEGREES_OF_FREEDOM]; DEGREES_OF_FREEDOM],
    /// How well pixels are read, one sigma of each coordinate [px].
    pub pixel_sigma_px: f64,
    /// Width and height of the picture [px], where known.
    pub image_size: Option<[u32; 2]>,
    /// The lens, where known; without it pixels are taken as undistorted.
    pub lens: Option<Lens>,
}

/// A floor point and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloorEstimate {
    /// Where.
    pub point: GroundPoint,
    /// Covariance of (x, y) from the pixel's noise and the calibration's [m^2].
    pub covariance: [[f64; 2]; 2],
    /// What one pixel covers there; `None` where its neighbour is above the horizon.
    pub resolution: Option<Resolution>,
}

/// A pixel is refused as too near the horizon where its depth `D` is not this many sigmas above zero: there
/// a floor point has no useful covariance.
const HORIZON_SIGMAS: f64 = 3.0;

impl FloorCamera {
    /// A camera whose homography is exact, with pixels read to half a pixel, a picture of unknown size and no
    /// lens distortion.
    #[must_use]
    pub const fn exact(homography: FloorHomography) -> Self {
        Self {
            homography,
            covariance: [[0.0; 8]; 8],
            pixel_sigma_px: 0.5,
            image_size: None,
            lens: None,
        }
    }

    /// The floor point that a pixel sees; `None` on and above the horizon.
    #[must_use]
    pub fn floor_point(&self, pixel: PixelPoint) -> Option<GroundPoint> {
        self.homography.floor_point(self.undistort(pixel)?)
    }

    /// The pixel that sees a floor point; `None` where the camera cannot see it. The picture's edge is not
    /// looked at.
    #[must_use]
    pub fn pixel_of(&self, point: GroundPoint) -> Option<PixelPoint> {
        let ideal = self.homography.pixel_of(point)?;
        match &self.lens {
            Some(lens) => lens.distort(ideal),
            None => Some(ideal),
        }
    }

    /// The floor point of a pixel with its covariance, from the pixel's own covariance [px^2] and the
    /// calibration's; `None` above the horizon and so near to it that the covariance would mean nothing.
    #[must_use]
    pub fn floor_estimate(
        &self,
        pixel: PixelPoint,
        pixel_covariance: [[f64; 2]; 2],
    ) -> Option<FloorEstimate> {
        let ideal = self.undistort(pixel)?;
        let point = self.homography.floor_point(ideal)?;
        let mut noise = square(&pixel_covariance);
        if let Some(lens) = &self.lens {
            let j = square(&lens.undistort_jacobian(pixel)?);
            noise = j * noise * j.transpose();
        }
        let spread = self.spread(ideal, &noise)?;
        let depth_sigma = spread[(2, 2)].sqrt();
        if self.homography.depth(ideal) <= HORIZON_SIGMAS * depth_sigma {
            return None;
        }
        Some(FloorEstimate {
            point,
            covariance: [
                [spread[(0, 0)], spread[(0, 1)]],
                [spread[(0, 1)], spread[(1, 1)]],
            ],
            resolution: self.homography.resolution(ideal),
        })
    }

    /// Covariance of (x, y, D) at an undistorted pixel with this noise.
    fn spread(&self, ideal: PixelPoint, noise: &Matrix2<f64>) -> Option<Matrix3<f64>> {
        let by_chart = chart::by_entries(&self.homography, ideal)? * chart::basis(&self.homography);
        let parameters = SMatrix::<f64, 8, 8>::from_fn(|r, c| self.covariance[r][c]);
        let [row_x, row_y] = self.homography.jacobian(ideal)?;
        let [g, h, _] = self.homography.pixel_to_floor()[2];
        let by_pixel = Matrix3x2::new(row_x[0], row_x[1], row_y[0], row_y[1], g, h);
        Some(by_chart * parameters * by_chart.transpose() + by_pixel * noise * by_pixel.transpose())
    }

    fn undistort(&self, pixel: PixelPoint) -> Option<PixelPoint> {
        match &self.lens {
            Some(lens) => lens.undistort(pixel),
            None => Some(pixel),
        }
    }
}

fn square(rows: &[[f64; 2]; 2]) -> Matrix2<f64> {
    Matrix2::new(rows[0][0], rows[0][1], rows[1][0], rows[1][1])
}
