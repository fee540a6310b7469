//! Does the camera still look where it did when it was calibrated?
//!
//! A camera that was bumped sees lines bend that are straight and parallel, square or upright in the building.
//! What lines say is compared for a camera that has not turned and for one that has turned a little downwards
//! and about its axis since; turning about the vertical cannot be told from a robot that turned. Lines are
//! those of the undistorted picture. The calibration's own uncertainty is carried along.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, SVector, Vector3};

use crate::geometry::{CameraGeometry, Undetermined};
use crate::homography::{matrix, rows};
use crate::{FloorCamera, FloorHomography};

/// A straight line in the undistorted picture: `u cos(theta) + v sin(theta) = rho`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineObservation {
    /// Distance from pixel (0, 0), of either sign [px].
    pub rho: f64,
    /// Direction of the normal [rad].
    pub theta: f64,
    /// Covariance of (rho, theta).
    pub covariance: [[f64; 2]; 2],
}

/// What is known of lines, from the building.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum LineEvidence {
    /// Two lines on the floor that are parallel, as the two sides of a corridor.
    Parallel(LineObservation, LineObservation),
    /// Two lines on the floor at right angles, as the side and the end of a corridor.
    Perpendicular(LineObservation, LineObservation),
    /// Two parallel lines on the floor that are this far apart [m].
    Apart(LineObservation, LineObservation, f64),
    /// The picture of an upright edge, as a door's.
    Vertical(LineObservation),
}

/// How to judge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftParams {
    /// Turns smaller than this are let pass [rad], above 0. Half a degree moves a point 3 m ahead of a camera
    /// 1 m high by about 9 cm.
    pub tolerance: f64,
}

impl Default for DriftParams {
    fn default() -> Self {
        Self {
            tolerance: 0.5_f64.to_radians(),
        }
    }
}

/// The verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriftStatus {
    /// The camera looks where it did, to within the tolerance.
    Agrees,
    /// It was turned: calibrate again.
    Moved,
    /// The lines do not say: too few, too uncertain, or at odds with each other whatever the turn.
    NotDetermined,
}

/// What lines say about a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Drift {
    /// The verdict.
    pub status: DriftStatus,
    /// The camera now looks this much further down [rad].
    pub pitch: f64,
    /// One sigma [rad]; infinite where the lines say nothing.
    pub pitch_sigma: f64,
    /// The camera is now turned about its axis by this much, clockwise as it looks [rad].
    pub roll: f64,
    /// One sigma [rad]; infinite where the lines say nothing.
    pub roll_sigma: f64,
    /// Chi-square of the lines if it was not turned.
    pub chi_square: f64,
    /// Chi-square of the lines for the turn above.
    pub chi_square_turned: f64,
    /// Number of conditions, one for each piece of evidence.
    pub conditions: usize,
}

/// Sigma before any evidence: a camera is not turned by more than a few degrees unnoticed [rad].
const WIDEST_TURN: f64 = 0.5;

/// Chi-square with two degrees of freedom that chance exceeds once in a thousand times.
const SIGNIFICANT: f64 = 13.8;

const STEP: f64 = 1e-5;

/// Compares what lines say, of one frame or of many, with a camera's calibration.
///
/// # Errors
/// [`Undetermined`] for a camera whose mounting its homography does not tell.
pub fn check_drift(
    camera: &FloorCamera,
    evidence: &[LineEvidence],
    params: &DriftParams,
) -> Result<Drift, Undetermined> {
    let geometry = camera.geometry()?;
    let mut estimate = [0.0; 2];
    let mut solved = Solved::default();
    let still = Solved::of(camera, &geometry, evidence, [0.0; 2], false);
    // the conditions are nearly linear in small turns
    for _ in 0..3 {
        solved = Solved::of(camera, &geometry, evidence, estimate, true);
        estimate = solved.turn;
    }
    let pitch_known = solved.sigmas[0] <= params.tolerance;
    let spare = (evidence.len() as f64 - 2.0).max(1.0);
    let at_odds = solved.chi_square > limit(spare);
    let turned = estimate[0].abs().max(estimate[1].abs()) > params.tolerance;
    let significant = still.chi_square - solved.chi_square > SIGNIFICANT;
    let status = if at_odds || evidence.is_empty() {
        DriftStatus::NotDetermined
    } else if turned && significant {
        DriftStatus::Moved
    } else if pitch_known {
        DriftStatus::Agrees
    } else {
        DriftStatus::NotDetermined
    };
    let sigma = |k: usize| {
        if solved.sigmas[k] < 0.9 * WIDEST_TURN {
            solved.sigmas[k]
        } else {
            f64::INFINITY
        }
    };
    Ok(Drift {
        status,
        pitch: estimate[0],
        pitch_sigma: sigma(0),
        roll: estimate[1],
        roll_sigma: sigma(1),
        chi_square: still.chi_square,
        chi_square_turned: solved.chi_square,
        conditions: evidence.len(),
    })
}

/// Chi-square that chance exceeds once in a thousand times (Wilson and Hilferty's approximation).
fn limit(degrees: f64) -> f64 {
    let part = 2.0 / (9.0 * degrees);
    degrees * (1.0 - part + 3.09 * part.sqrt()).powi(3)
}

#[derive(Debug, Default)]
struct Solved {
    turn: [f64; 2],
    sigmas: [f64; 2],
    chi_square: f64,
}

impl Solved {
    /// Least squares over turn and calibration error together, each with what is known of it beforehand.
    fn of(
        camera: &FloorCamera,
        geometry: &CameraGeometry,
        evidence: &[LineEvidence],
        at: [f64; 2],
        may_turn: bool,
    ) -> Self {
        let steps = camera.one_sigma_steps();
        let view = |step: &SVector<f64, 8>| -> Option<View> {
            let moved = FloorCamera {
                homography: camera.moved(step)?,
                ..camera.clone()
            };
            // the lens or focal length stays as it is: its uncertainty is in the homography's
            Some(View {
                homography: moved.homography,
                geometry: *geometry,
            })
        };
        let here = View {
            homography: camera.homography,
            geometry: *geometry,
        };
        let around: Vec<[Option<View>; 2]> = steps
            .iter()
            .map(|s| [view(&(s * 1e-3)), view(&(s * -1e-3))])
            .collect();
        let unknowns = 2 + steps.len();
        let mut information = DMatrix::<f64>::identity(unknowns, unknowns);
        let mut pull = DVector::<f64>::zeros(unknowns);
        let mut squares = 0.0;
        let prior = if may_turn {
            1.0 / (WIDEST_TURN * WIDEST_TURN)
        } else {
            1e18
        };
        for k in 0..2 {
            information[(k, k)] = prior;
        }
        for piece in evidence {
            let Some(error) = here.error(piece, at) else {
                continue;
            };
            let Some(variance) = here.variance(piece, at).filter(|v| *v > 0.0) else {
                continue;
            };
            let mut row = DVector::<f64>::zeros(unknowns);
            for k in 0..2 {
                let (mut plus, mut minus) = (at, at);
                plus[k] += STEP;
                minus[k] -= STEP;
                if let Some((p, m)) = here.error(piece, plus).zip(here.error(piece, minus)) {
                    row[k] = (p - m) / (2.0 * STEP);
                }
            }
            for (k, [plus, minus]) in around.iter().enumerate() {
                let pair = plus.as_ref().zip(minus.as_ref());
                if let Some((p, m)) =
                    pair.and_then(|(p, m)| p.error(piece, at).zip(m.error(piece, at)))
                {
                    row[2 + k] = (p - m) / 2e-3;
                }
            }
            // linearised about `at`, the unknown turn is counted from zero
            let target = row[0] * at[0] + row[1] * at[1] - error;
            information += &row * row.transpose() / variance;
            pull += &row * (target / variance);
            squares += target * target / variance;
        }
        let Some(inverse) = information.try_inverse() else {
            return Self::default();
        };
        let solution = &inverse * &pull;
        let chi_square = squares - solution.dot(&pull);
        Self {
            turn: [solution[0], solution[1]],
            sigmas: [inverse[(0, 0)].sqrt(), inverse[(1, 1)].sqrt()],
            chi_square: chi_square.max(0.0),
        }
    }
}

/// A calibration that lines are looked at through.
struct View {
    homography: FloorHomography,
    geometry: CameraGeometry,
}

impl View {
    /// From rays of the camera as it is now, turned since, to rays as they were when it was calibrated.
    fn unturned([pitch, roll]: [f64; 2]) -> Rotation3<f64> {
        // the camera's axes are right, down, forward: looking further down turns about right, backwards
        Rotation3::from_axis_angle(&Vector3::x_axis(), -pitch)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), roll)
    }

    /// How far a piece of evidence is from being true, for a camera turned by this much.
    fn error(&self, piece: &LineEvidence, turn: [f64; 2]) -> Option<f64> {
        let cross = |a: Vector3<f64>, b: Vector3<f64>| a.x * b.y - a.y * b.x;
        match piece {
            LineEvidence::Parallel(a, b) => {
                let (a, b) = (self.on_floor(a, turn)?, self.on_floor(b, turn)?);
                Some(cross(a, b) * (a.x * b.x + a.y * b.y).signum())
            }
            LineEvidence::Perpendicular(a, b) => {
                let (a, b) = (self.on_floor(a, turn)?, self.on_floor(b, turn)?);
                Some((a.x * b.x + a.y * b.y) * cross(a, b).signum())
            }
            LineEvidence::Apart(a, b, apart) => {
                let (a, b) = (self.on_floor(a, turn)?, self.on_floor(b, turn)?);
                let side = (a.x * b.x + a.y * b.y).signum();
                Some((a.z - side * b.z).abs() - apart)
            }
            LineEvidence::Vertical(line) => {
                let plane = self.camera_matrix().transpose() * normal_form(line.rho, line.theta);
                let down = -matrix(&self.geometry.axes).column(2).into_owned();
                Some((Self::unturned(turn) * plane.normalize()).dot(&down))
            }
        }
    }

    /// A line on the floor `a x + b y + c = 0` with `a^2 + b^2 = 1`.
    fn on_floor(&self, line: &LineObservation, turn: [f64; 2]) -> Option<Vector3<f64>> {
        let k = self.camera_matrix();
        let warp = k * Self::unturned(turn).matrix() * k.try_inverse()?;
        let homography =
            FloorHomography::new(rows(&(matrix(&self.homography.pixel_to_floor()) * warp))).ok()?;
        let floor =
            matrix(&homography.floor_to_pixel()).transpose() * normal_form(line.rho, line.theta);
        let size = floor.x.hypot(floor.y);
        (size > 0.0).then(|| floor / size)
    }

    fn camera_matrix(&self) -> Matrix3<f64> {
        let m = self.geometry.matrix;
        Matrix3::new(m.fx, 0.0, m.cx, 0.0, m.fy, m.cy, 0.0, 0.0, 1.0)
    }

    /// Variance of a piece's error from the lines' own.
    fn variance(&self, piece: &LineEvidence, turn: [f64; 2]) -> Option<f64> {
        let moved = |which: usize, drho: f64, dtheta: f64| {
            let mut piece = *piece;
            let line = match &mut piece {
                LineEvidence::Parallel(_, b)
                | LineEvidence::Perpendicular(_, b)
                | LineEvidence::Apart(_, b, _)
                    if which == 1 =>
                {
                    b
                }
                LineEvidence::Parallel(a, _)
                | LineEvidence::Perpendicular(a, _)
                | LineEvidence::Apart(a, _, _)
                | LineEvidence::Vertical(a) => a,
            };
            line.rho += drho;
            line.theta += dtheta;
            self.error(&piece, turn)
        };
        let lines: &[&LineObservation] = match piece {
            LineEvidence::Parallel(a, b)
            | LineEvidence::Perpendicular(a, b)
            | LineEvidence::Apart(a, b, _) => &[a, b],
            LineEvidence::Vertical(a) => &[a],
        };
        let mut variance = 0.0;
        for (which, line) in lines.iter().enumerate() {
            let by_rho = (moved(which, 1e-3, 0.0)? - moved(which, -1e-3, 0.0)?) / 2e-3;
            let by_theta = (moved(which, 0.0, 1e-6)? - moved(which, 0.0, -1e-6)?) / 2e-6;
            let [[a, b], [_, d]] = line.covariance;
            variance += by_rho * by_rho * a + 2.0 * by_rho * by_theta * b + by_theta * by_theta * d;
        }
        Some(variance)
    }
}

fn normal_form(rho: f64, theta: f64) -> Vector3<f64> {
    Vector3::new(theta.cos(), theta.sin(), -rho)
}
