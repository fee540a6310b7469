//! The simulated camera's own geometry: pinhole, lens, mount. Shares nothing with calibration code, so
//! that it can judge it.

use occgrid::{Point2, Pose2};
use thiserror::Error;

use crate::real::{Placed, acos, sin_cos};

/// How the lens bends rays; the coefficients mean what ROS `camera_info` and OpenCV mean by them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Distortion {
    /// A pinhole.
    #[default]
    None,
    /// Brown's model, ROS `plumb_bob`: radial k1, k2, k3 and tangential p1, p2.
    PlumbBob {
        /// `[k1, k2, p1, p2, k3]`, in the order of the files.
        coefficients: [f64; 5],
    },
    /// Kannala and Brandt's model, ROS `equidistant`, OpenCV `fisheye`:
    /// r = theta (1 + k1 theta^2 + k2 theta^4 + ..).
    Fisheye {
        /// `[k1, k2, k3, k4]`.
        coefficients: [f64; 4],
    },
}

/// A camera on the robot: what it sees of which direction.
///
/// Pixel centres are at integers, u to the right, v down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraModel {
    /// Columns [px], 1 to 8192.
    pub width: u32,
    /// Rows [px], 1 to 8192.
    pub height: u32,
    /// Focal length along u [px], above 0.
    pub fx: f64,
    /// Focal length along v [px], above 0.
    pub fy: f64,
    /// Principal point, u [px].
    pub cx: f64,
    /// Principal point, v [px].
    pub cy: f64,
    /// The lens.
    pub distortion: Distortion,
    /// Above the floor [m], above 0.
    pub mount_height: f64,
    /// Ahead of the base's origin [m].
    pub mount_x: f64,
    /// To the left of the base's origin [m].
    pub mount_y: f64,
    /// To the left of straight ahead [rad].
    pub yaw: f64,
    /// Down from the horizon [rad].
    pub tilt: f64,
    /// Clockwise about the optical axis, as seen from behind the camera [rad].
    pub roll: f64,
}

impl CameraModel {
    /// The camera of the paper, as its printed floor homography implies: 480 x 220 pixels, focal length
    /// 450 px, 1 m above the floor, 24 degrees down.
    #[must_use]
    pub fn paper() -> Self {
        Self::centred(480, 220, 450.0, 1.0, 24.0_f64.to_radians())
    }

    /// A webcam of 640 x 480 pixels on the same mount, 28 degrees down.
    #[must_use]
    pub fn vga() -> Self {
        Self::centred(640, 480, 560.0, 1.0, 28.0_f64.to_radians())
    }

    /// Square pixels, the principal point in the middle, no distortion, straight ahead.
    #[must_use]
    pub fn centred(width: u32, height: u32, focal_px: f64, mount_height: f64, tilt: f64) -> Self {
        Self {
            width,
            height,
            fx: focal_px,
            fy: focal_px,
            cx: (f64::from(width) - 1.0) / 2.0,
            cy: (f64::from(height) - 1.0) / 2.0,
            distortion: Distortion::None,
            mount_height,
            mount_x: 0.0,
            mount_y: 0.0,
            yaw: 0.0,
            tilt,
            roll: 0.0,
        }
    }

    /// The pixel at which a point of the map frame is seen, `height` [m] above the floor; `None` behind
    /// the camera, or where a lens does not image it. The pixel may lie outside the picture.
    #[must_use]
    pub fn pixel_of(&self, map_from_base: Pose2, point: Point2, height: f64) -> Option<[f64; 2]> {
        let p = self.map_from_foot(map_from_base).inward(point);
        let [forward, right, down] = self.axes();
        let offset = [p.x, p.y, height - self.mount_height];
        let dot = |axis: [f64; 3]| axis[0] * offset[0] + axis[1] * offset[1] + axis[2] * offset[2];
        self.project([dot(right), dot(down), dot(forward)])
    }

    /// The frame on the floor under the camera, x along its view.
    pub(crate) fn map_from_foot(&self, map_from_base: Pose2) -> Placed {
        Placed::at(map_from_base).compose(&Placed::at(Pose2::new(
            self.mount_x,
            self.mount_y,
            self.yaw,
        )))
    }

    /// Forward, right and down of the camera, in the frame under it.
    fn axes(&self) -> [[f64; 3]; 3] {
        let (st, ct) = sin_cos(self.tilt);
        let (sr, cr) = sin_cos(self.roll);
        let (right, down) = ([0.0, -1.0, 0.0], [-st, 0.0, -ct]);
        let mix = |a: f64, b: f64| std::array::from_fn(|i| a * right[i] + b * down[i]);
        [[ct, 0.0, -st], mix(cr, sr), mix(-sr, cr)]
    }

    /// The pixel of a direction given in optical axes (right, down, forward).
    fn project(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
        let [xd, yd] = match self.distortion {
            Distortion::Fisheye { coefficients } => fisheye(coefficients, x, y, z)?,
            Distortion::None if z > 0.0 => [x / z, y / z],
            Distortion::PlumbBob { coefficients } if z > 0.0 => {
                plumb_bob(&coefficients, x / z, y / z)?
            }
            _ => return None,
        };
        Some([self.fx * xd + self.cx, self.fy * yd + self.cy])
    }

    /// The direction that a pixel sees, in the frame under the camera; any length.
    ///
    /// # Errors
    /// [`CameraModelError::Lens`] where the lens gives the pixel to no direction.
    pub(crate) fn direction(&self, u: f64, v: f64) -> Result<[f64; 3], CameraModelError> {
        let (x, y) = ((u - self.cx) / self.fx, (v - self.cy) / self.fy);
        let ray = match self.distortion {
            Distortion::None => Some([x, y, 1.0]),
            Distortion::PlumbBob { coefficients } => {
                undo_plumb_bob(&coefficients, x, y).map(|[x, y]| [x, y, 1.0])
            }
            Distortion::Fisheye { coefficients } => undo_fisheye(coefficients, x, y),
        };
        let [r, d, f] = ray.ok_or(CameraModelError::Lens { u, v })?;
        let [forward, right, down] = self.axes();
        Ok(std::array::from_fn(|i| {
            f * forward[i] + r * right[i] + d * down[i]
        }))
    }

    pub(crate) fn check(&self) -> Result<(), CameraModelError> {
        let value = |name, value, ok| {
            if ok {
                return Ok(());
            }
            Err(CameraModelError::Value { name, found: value })
        };
        let side = |n: u32| (1..=8192).contains(&n);
        value("width", f64::from(self.width), side(self.width))?;
        value("height", f64::from(self.height), side(self.height))?;
        for (name, v) in [
            ("fx", self.fx),
            ("fy", self.fy),
            ("mount_height", self.mount_height),
        ] {
            value(name, v, v > 0.0 && v < 1e6)?;
        }
        for (name, v) in [
            ("cx", self.cx),
            ("cy", self.cy),
            ("mount_x", self.mount_x),
            ("mount_y", self.mount_y),
            ("yaw", self.yaw),
            ("tilt", self.tilt),
            ("roll", self.roll),
        ] {
            value(name, v, v.abs() < 1e6)?;
        }
        Ok(())
    }
}

/// Why a camera was refused.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraModelError {
    /// A parameter is out of range.
    #[error("camera {name}: out of range, found {found}")]
    Value {
        /// The field.
        name: &'static str,
        /// Its value.
        found: f64,
    },
    /// The lens model cannot be undone at a pixel of the picture.
    #[error("the lens distortion cannot be undone at pixel ({u}, {v})")]
    Lens {
        /// Column [px].
        u: f64,
        /// Row [px].
        v: f64,
    },
}

/// `None` past the radius where the radial polynomial turns back.
fn plumb_bob(k: &[f64; 5], x: f64, y: f64) -> Option<[f64; 2]> {
    let ([[xx, _], [_, yy]], at) = plumb_bob_slope(k, x, y);
    (xx > 0.0 && yy > 0.0 && rising(k, x * x + y * y)).then_some(at)
}

/// Whether r (1 + k1 r^2 + k2 r^4 + k3 r^6) grows all the way to this radius.
fn rising(k: &[f64; 5], r2: f64) -> bool {
    (1..=16).all(|i| {
        let s = r2 * f64::from(i) / 16.0;
        1.0 + s * (3.0 * k[0] + s * (5.0 * k[1] + s * 7.0 * k[4])) > 0.0
    })
}

/// The matrix of derivatives, and the distorted point.
fn plumb_bob_slope(k: &[f64; 5], x: f64, y: f64) -> ([[f64; 2]; 2], [f64; 2]) {
    let [k1, k2, p1, p2, k3] = *k;
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    let slope = k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3);
    let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
    let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
    let cross = 2.0 * (x * y * slope + p1 * x + p2 * y);
    let xx = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x;
    let yy = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
    ([[xx, cross], [cross, yy]], [xd, yd])
}

fn undo_plumb_bob(k: &[f64; 5], xd: f64, yd: f64) -> Option<[f64; 2]> {
    let (mut x, mut y) = (xd, yd);
    for _ in 0..50 {
        let ([[a, b], [c, d]], at) = plumb_bob_slope(k, x, y);
        let (ex, ey) = (at[0] - xd, at[1] - yd);
        let det = a * d - b * c;
        let (dx, dy) = ((d * ex - b * ey) / det, (a * ey - c * ex) / det);
        x -= dx;
        y -= dy;
        if dx * dx + dy * dy < 1e-26 {
            break;
        }
    }
    let again = plumb_bob(k, x, y)?;
    ((again[0] - xd).abs() < 1e-9 && (again[1] - yd).abs() < 1e-9).then_some([x, y])
}

fn fisheye(k: [f64; 4], x: f64, y: f64, z: f64) -> Option<[f64; 2]> {
    let across = (x * x + y * y).sqrt();
    if across < 1e-12 {
        return (z > 0.0).then_some([0.0, 0.0]);
    }
    let theta = acos((z / (across * across + z * z).sqrt()).clamp(-1.0, 1.0));
    let scale = bent(k, theta).0 / across;
    (1..=16)
        .all(|i| bent(k, theta * f64::from(i) / 16.0).1 > 0.0)
        .then_some([x * scale, y * scale])
}

/// Distorted radius of an angle, and its derivative.
fn bent(k: [f64; 4], theta: f64) -> (f64, f64) {
    let t = theta * theta;
    let r = theta * (1.0 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3]))));
    let slope = 1.0 + t * (3.0 * k[0] + t * (5.0 * k[1] + t * (7.0 * k[2] + t * 9.0 * k[3])));
    (r, slope)
}

fn undo_fisheye(k: [f64; 4], xd: f64, yd: f64) -> Option<[f64; 3]> {
    let r = (xd * xd + yd * yd).sqrt();
    if r < 1e-12 {
        return Some([0.0, 0.0, 1.0]);
    }
    let mut theta = r;
    for _ in 0..50 {
        let (at, slope) = bent(k, theta);
        let step = (at - r) / slope;
        theta -= step;
        if step.abs() < 1e-13 {
            break;
        }
    }
    let (again, slope) = bent(k, theta);
    let fits = (again - r).abs() < 1e-9 && slope > 0.0 && (0.0..3.1).contains(&theta);
    let (sin, cos) = sin_cos(theta);
    fits.then_some([xd / r * sin, yd / r * sin, cos])
}
