//! The map between picture and floor: a 3 x 3 homography that knows which side of the horizon it is on.

use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

use crate::{GroundPoint, PixelPoint};

/// A matrix that no camera over a floor can have.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum HomographyError {
    /// An entry is NaN or infinite.
    #[error("row {row}, column {column}: expected a finite number, found {found}")]
    NotFinite {
        /// 0-based.
        row: usize,
        /// 0-based.
        column: usize,
        /// The entry.
        found: f64,
    },
    /// The matrix cannot be inverted: all pixels would see one line or one point.
    #[error(
        "expected a matrix that can be inverted, found determinant {determinant:e} at unit norm"
    )]
    Singular {
        /// Of the matrix scaled to unit Frobenius norm.
        determinant: f64,
    },
}

/// The least determinant of the unit rows: that of a picture of 4000 x 4000 px is about 1e-7, rounding
/// alone leaves about 1e-16.
const LEAST_DETERMINANT: f64 = 1e-14;

/// The homography between undistorted pixels and the floor (Choi, Ryu, Kim 1999, section 3.1).
///
/// `[X, Y, D] = pixel_to_floor [u, v, 1]`, floor point `(X / D, Y / D)` in `base_link` axes [m]. The matrix is
/// kept at unit Frobenius norm with a negative determinant: pixels are right-handed as seen along the view,
/// floor axes as seen from above, so exactly then `D > 0` says that a pixel is on the floor's side of the
/// horizon. Points above the horizon, and floor points behind the camera, have no counterpart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloorHomography {
    pixel_to_floor: [[f64; 3]; 3],
    floor_to_pixel: [[f64; 3]; 3],
}

impl FloorHomography {
    /// A homography from its matrix, row-major, at any scale and of either sign.
    ///
    /// # Errors
    /// [`HomographyError`] for entries that are not finite and matrices that cannot be inverted.
    pub fn new(pixel_to_floor: [[f64; 3]; 3]) -> Result<Self, HomographyError> {
        for (row, entries) in pixel_to_floor.iter().enumerate() {
            for (column, &found) in entries.iter().enumerate() {
                if !found.is_finite() {
                    return Err(HomographyError::NotFinite { row, column, found });
                }
            }
        }
        let raw = matrix(&pixel_to_floor);
        // in two steps, so that neither huge nor tiny entries overflow their squares
        let scaled = raw / raw.amax();
        let mut unit = scaled / scaled.norm();
        let determinant = unit.determinant();
        if determinant > 0.0 {
            unit = -unit;
        }
        let of_unit_rows = determinant.abs() / unit.row_iter().map(|r| r.norm()).product::<f64>();
        let singular = HomographyError::Singular {
            determinant: of_unit_rows,
        };
        if of_unit_rows.is_nan() || of_unit_rows < LEAST_DETERMINANT {
            return Err(singular);
        }
        let inverse = unit.try_inverse().ok_or(singular)?;
        Ok(Self {
            pixel_to_floor: rows(&unit),
            floor_to_pixel: rows(&(inverse / inverse.norm())),
        })
    }

    /// The matrix, row-major, at unit Frobenius norm with `D > 0` below the horizon.
    #[must_use]
    pub const fn pixel_to_floor(&self) -> [[f64; 3]; 3] {
        self.pixel_to_floor
    }

    /// Its inverse, row-major, at unit Frobenius norm with a positive third component before the camera.
    #[must_use]
    pub const fn floor_to_pixel(&self) -> [[f64; 3]; 3] {
        self.floor_to_pixel
    }

    /// The floor point that a pixel sees; `None` on and above the horizon.
    #[must_use]
    pub fn floor_point(&self, pixel: PixelPoint) -> Option<GroundPoint> {
        let [x, y] = divided(apply(&self.pixel_to_floor, pixel.u, pixel.v))?;
        Some(GroundPoint { x, y })
    }

    /// The pixel that sees a floor point; `None` for points beside or behind the camera.
    #[must_use]
    pub fn pixel_of(&self, point: GroundPoint) -> Option<PixelPoint> {
        let [u, v] = divided(apply(&self.floor_to_pixel, point.x, point.y))?;
        Some(PixelPoint { u, v })
    }

    /// How the floor point moves with the pixel: `[[dx/du, dx/dv], [dy/du, dy/dv]]` [m/px]; `None` on and
    /// above the horizon.
    #[must_use]
    pub fn jacobian(&self, pixel: PixelPoint) -> Option<[[f64; 2]; 2]> {
        jacobian(&self.pixel_to_floor, pixel.u, pixel.v)
    }

    /// How the pixel moves with the floor point: `[[du/dx, du/dy], [dv/dx, dv/dy]]` [px/m]; `None` for points
    /// beside or behind the camera.
    #[must_use]
    pub fn pixel_jacobian(&self, point: GroundPoint) -> Option<[[f64; 2]; 2]> {
        jacobian(&self.floor_to_pixel, point.x, point.y)
    }

    /// What one whole pixel covers on the floor, exactly (the paper's finite differences); `None` where the
    /// pixel or its neighbour to the right or below is on or above the horizon.
    #[must_use]
    pub fn resolution(&self, pixel: PixelPoint) -> Option<Resolution> {
        let at = self.floor_point(pixel)?;
        let right = self.floor_point(PixelPoint::new(pixel.u + 1.0, pixel.v))?;
        let below = self.floor_point(PixelPoint::new(pixel.u, pixel.v + 1.0))?;
        Some(Resolution {
            dx: (below.x - at.x).abs(),
            dy: (right.y - at.y).abs(),
        })
    }

    /// `D` of a pixel: above zero on the floor's side of the horizon.
    pub(crate) fn depth(&self, pixel: PixelPoint) -> f64 {
        apply(&self.pixel_to_floor, pixel.u, pixel.v).z
    }

    /// The horizon `[a, b, c]`: `a u + b v + c` is a pixel's distance from it [px], positive on the floor's
    /// side; `None` for a camera that looks straight down and has no horizon.
    #[must_use]
    pub fn horizon(&self) -> Option<[f64; 3]> {
        let [g, h, i] = self.pixel_to_floor[2];
        let length = g.hypot(h);
        let line = [g / length, h / length, i / length];
        line.iter().all(|v| v.is_finite()).then_some(line)
    }
}

/// The size of one pixel on the floor (Choi, Ryu, Kim 1999, section 3.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Change of `x`, forward, from a row of the picture to the next [m].
    pub dx: f64,
    /// Change of `y`, to the left, from a column of the picture to the next [m].
    pub dy: f64,
}

pub(crate) fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|r, c| rows[r][c])
}

pub(crate) fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|r| std::array::from_fn(|c| matrix[(r, c)]))
}

fn apply(m: &[[f64; 3]; 3], a: f64, b: f64) -> Vector3<f64> {
    Vector3::from_fn(|r, _| m[r][0] * a + m[r][1] * b + m[r][2])
}

fn divided(h: Vector3<f64>) -> Option<[f64; 2]> {
    if h.z.is_nan() || h.z <= 0.0 {
        return None;
    }
    let point = [h.x / h.z, h.y / h.z];
    point.iter().all(|c| c.is_finite()).then_some(point)
}

fn jacobian(m: &[[f64; 3]; 3], a: f64, b: f64) -> Option<[[f64; 2]; 2]> {
    let d = apply(m, a, b).z;
    let [x, y] = divided(apply(m, a, b))?;
    let row = |value: f64, r: usize| {
        [
            (m[r][0] - value * m[2][0]) / d,
            (m[r][1] - value * m[2][1]) / d,
        ]
    };
    Some([row(x, 0), row(y, 1)])
}
