//! How a camera is mounted, as far as its homography tells: focal length, height, tilt.
//!
//! A homography has eight numbers; a camera with square pixels and a known principal point has seven
//! (focal length, three angles, three of position), so it is determined and one number is left over to check
//! with. With a known lens the focal length is given.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use thiserror::Error;

use crate::chart::{self, Entries};
use crate::homography::rows;
use crate::{CameraMatrix, FloorCamera, FloorHomography, GroundPoint};

/// A camera's mounting and focal length, each with one sigma.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct CameraGeometry {
    /// The camera matrix of the undistorted picture [px].
    pub matrix: CameraMatrix,
    /// Focal length, the mean of both axes [px].
    pub focal_px: f64,
    /// One sigma of the focal length; 0 where the lens is given [px].
    pub focal_sigma_px: f64,
    /// Of the camera above the floor [m].
    pub height: f64,
    /// One sigma of the height [m].
    pub height_sigma: f64,
    /// Of the optical axis below the horizontal [rad].
    pub tilt: f64,
    /// One sigma of the tilt [rad].
    pub tilt_sigma: f64,
    /// About the optical axis; positive, the picture's right side is lower than its left [rad].
    pub roll: f64,
    /// Of the optical axis, to the left of x [rad]; of no meaning straight down.
    pub yaw: f64,
    /// The floor point below the camera.
    pub foot: GroundPoint,
    /// Vanishing point of the vertical, homogeneous, in undistorted pixels, of unit length; the third number
    /// is positive for a camera that looks down.
    pub nadir: [f64; 3],
    /// Right, down and forward of the camera, as rows, in floor axes (x forward, y left, z up).
    pub axes: [[f64; 3]; 3],
}

/// Why a homography does not tell how its camera is mounted.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum Undetermined {
    /// Neither the picture's size nor the lens is known, so neither is the principal point.
    #[error(
        "expected the picture's size or its lens, found neither: the principal point is unknown"
    )]
    Center,
    /// The focal length and the height cannot be told apart, as for a camera that looks straight down.
    #[error(
        "expected a view that separates focal length and height, found the focal length uncertain by {relative:.2} of itself"
    )]
    Focal {
        /// One sigma of the focal length over itself; infinite where it is not real.
        relative: f64,
    },
    /// The homography is that of no camera with square pixels and this principal point.
    #[error(
        "expected square pixels and a centred principal point, found {sigmas:.1} sigmas from it"
    )]
    NotCentered {
        /// How far off the remaining condition is.
        sigmas: f64,
    },
}

/// One sigma of a principal point that is only known to be at the centre, over the picture's width.
const CENTER_SIGMA: f64 = 0.02;

/// A focal length less certain than this is none [over itself].
const FOCAL_SIGMA: f64 = 0.25;

/// The condition left over is taken as broken beyond this [sigmas].
const MOST_SIGMAS: f64 = 5.0;

/// One sigma of how square pixels are, and of a lens's focal lengths against each other.
const SQUARE_SIGMA: f64 = 0.01;

/// Share of a sigma that derivatives are taken over.
const STEP: f64 = 1e-3;

impl FloorCamera {
    /// How the camera is mounted, where square pixels and the principal point determine it.
    ///
    /// The principal point is the lens's; without one, the picture's centre to within 2 % of its width.
    ///
    /// # Errors
    /// [`Undetermined`], with the reason.
    pub fn geometry(&self) -> Result<CameraGeometry, Undetermined> {
        let (given, center_sigma) = match (&self.lens, self.image_size) {
            (Some(lens), _) => (lens.matrix(), 0.0),
            (None, Some([width, height])) => {
                let matrix = CameraMatrix {
                    fx: 0.0,
                    fy: 0.0,
                    cx: (f64::from(width) - 1.0) / 2.0,
                    cy: (f64::from(height) - 1.0) / 2.0,
                };
                (matrix, CENTER_SIGMA * f64::from(width))
            }
            (None, None) => return Err(Undetermined::Center),
        };
        let lensless = self.lens.is_none();
        let solve = |homography: &FloorHomography, du: f64, dv: f64| {
            let matrix = CameraMatrix {
                cx: given.cx + du,
                cy: given.cy + dv,
                ..given
            };
            Mounting::of(homography, matrix, lensless)
        };
        let unreal = Undetermined::Focal {
            relative: f64::INFINITY,
        };
        let found = solve(&self.homography, 0.0, 0.0).ok_or(unreal)?;
        // variances of focal length, height, tilt and the condition left over
        let mut variances = SVector::<f64, 4>::zeros();
        let mut add = |plus: Option<Mounting>, minus: Option<Mounting>| -> Option<()> {
            let slope = (plus?.numbers() - minus?.numbers()) / (2.0 * STEP);
            variances += slope.component_mul(&slope);
            Some(())
        };
        for step in self.one_sigma_steps() {
            let at = |share: f64| self.moved(&(step * share));
            add(
                at(STEP).and_then(|h| solve(&h, 0.0, 0.0)),
                at(-STEP).and_then(|h| solve(&h, 0.0, 0.0)),
            )
            .ok_or(unreal)?;
        }
        if lensless {
            let d = STEP * center_sigma;
            add(
                solve(&self.homography, d, 0.0),
                solve(&self.homography, -d, 0.0),
            )
            .ok_or(unreal)?;
            add(
                solve(&self.homography, 0.0, d),
                solve(&self.homography, 0.0, -d),
            )
            .ok_or(unreal)?;
        }
        let sigmas = variances.map(f64::sqrt);
        let relative = sigmas[0] / found.focal;
        if relative.is_nan() || relative > FOCAL_SIGMA {
            return Err(Undetermined::Focal { relative });
        }
        let off = found.left_over.abs() / sigmas[3].hypot(SQUARE_SIGMA);
        if off > MOST_SIGMAS {
            return Err(Undetermined::NotCentered { sigmas: off });
        }
        Ok(found.geometry(sigmas))
    }

    /// The steps of the chart that make up its covariance: their outer products add up to it.
    pub(crate) fn one_sigma_steps(&self) -> Vec<SVector<f64, 8>> {
        let covariance = SMatrix::<f64, 8, 8>::from_fn(|r, c| self.covariance[r][c]);
        let eigen = covariance.symmetric_eigen();
        let step = |k: usize| eigen.eigenvectors.column(k) * eigen.eigenvalues[k].max(0.0).sqrt();
        (0..8).map(step).filter(|step| step.norm() > 0.0).collect()
    }

    /// The homography after a small step in the chart.
    pub(crate) fn moved(&self, step: &SVector<f64, 8>) -> Option<FloorHomography> {
        let entries: Entries =
            chart::entries(&self.homography) + chart::basis(&self.homography) * step;
        let matrix = Matrix3::from_fn(|r, c| entries[3 * r + c]);
        FloorHomography::new(rows(&matrix)).ok()
    }
}

/// A mounting without sigmas.
struct Mounting {
    matrix: CameraMatrix,
    focal: f64,
    /// Right, down and forward as rows.
    rotation: Matrix3<f64>,
    position: Vector3<f64>,
    /// What square pixels and the principal point leave over, 0 where they are right.
    left_over: f64,
}

impl Mounting {
    /// The mounting for a principal point; the focal length is sought or that of the matrix.
    fn of(homography: &FloorHomography, given: CameraMatrix, seek_focal: bool) -> Option<Self> {
        let mut matrix = given;
        if seek_focal {
            (matrix.fx, matrix.fy) = (1.0, 1.0);
        }
        let rays = ray_matrix(&matrix) * crate::homography::matrix(&homography.floor_to_pixel());
        let [x, y] = [rays.column(0).into_owned(), rays.column(1).into_owned()];
        // both floor axes are of equal length and at right angles: a s + b = 0 with s = 1 / f^2
        let a = [
            x.xy().dot(&y.xy()),
            (x.xy().norm_squared() - y.xy().norm_squared()) / 2.0,
        ];
        let b = [x.z * y.z, (x.z * x.z - y.z * y.z) / 2.0];
        let size = a[0] * a[0] + a[1] * a[1];
        let square = if seek_focal {
            -(a[0] * b[0] + a[1] * b[1]) / size
        } else {
            1.0
        };
        if square.is_nan() || square <= 0.0 || !square.is_finite() {
            return None;
        }
        let focal = 1.0 / square.sqrt();
        if seek_focal {
            (matrix.fx, matrix.fy) = (focal, focal);
        }
        let rays = ray_matrix(&matrix) * crate::homography::matrix(&homography.floor_to_pixel());
        let [x, y, t] = [0, 1, 2].map(|k| rays.column(k).into_owned());
        let length = (x.norm() * y.norm()).sqrt();
        let left_over = if seek_focal {
            (a[0] * b[1] - a[1] * b[0]) / (size * square)
        } else {
            let skew = x.dot(&y) / (length * length);
            let aspect = (x.norm() / y.norm()).ln();
            skew.hypot(aspect)
        };
        // the nearest rotation: symmetric orthonormalisation of the two axes
        let (sum, difference) = (
            (x.normalize() + y.normalize()),
            (x.normalize() - y.normalize()),
        );
        let (sum, difference) = (sum.normalize(), difference.normalize());
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (x, y) = ((sum + difference) * half, (sum - difference) * half);
        let rotation = Matrix3::from_columns(&[x, y, x.cross(&y)]);
        let position = -(rotation.transpose() * t) / length;
        let all = rotation.iter().chain(position.iter());
        all.copied().all(f64::is_finite).then_some(Self {
            focal: (matrix.fx * matrix.fy).sqrt(),
            matrix,
            rotation,
            position,
            left_over,
        })
    }

    fn tilt(&self) -> f64 {
        (-self.rotation[(2, 2)]).clamp(-1.0, 1.0).asin()
    }

    /// What sigmas are wanted of.
    fn numbers(&self) -> SVector<f64, 4> {
        SVector::from([self.focal, self.position.z, self.tilt(), self.left_over])
    }

    fn geometry(&self, sigmas: SVector<f64, 4>) -> CameraGeometry {
        let forward = self.rotation.row(2);
        let yaw = forward[1].atan2(forward[0]);
        let (sin, cos) = yaw.sin_cos();
        let right = self.rotation.row(0);
        // of a camera without roll
        let level = Vector3::new(sin, -cos, 0.0);
        let down = Vector3::new(forward[0], forward[1], forward[2]).cross(&level);
        let roll = right
            .transpose()
            .dot(&down)
            .atan2(right.transpose().dot(&level));
        let CameraMatrix { fx, fy, cx, cy } = self.matrix;
        let vertical = -self.rotation.column(2);
        let nadir = Vector3::new(
            fx * vertical.x + cx * vertical.z,
            fy * vertical.y + cy * vertical.z,
            vertical.z,
        )
        .normalize();
        CameraGeometry {
            matrix: self.matrix,
            focal_px: self.focal,
            focal_sigma_px: sigmas[0],
            height: self.position.z,
            height_sigma: sigmas[1],
            tilt: self.tilt(),
            tilt_sigma: sigmas[2],
            roll,
            yaw,
            foot: GroundPoint::new(self.position.x, self.position.y),
            nadir: [nadir.x, nadir.y, nadir.z],
            axes: rows(&self.rotation),
        }
    }
}

/// From homogeneous pixels to rays of the camera.
fn ray_matrix(m: &CameraMatrix) -> Matrix3<f64> {
    Matrix3::new(
        1.0 / m.fx,
        0.0,
        -m.cx / m.fx,
        0.0,
        1.0 / m.fy,
        -m.cy / m.fy,
        0.0,
        0.0,
        1.0,
    )
}
