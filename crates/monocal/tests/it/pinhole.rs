//! A pinhole camera over a floor, written down from its geometry: the truth that tests compare with. It
//! shares nothing with the crate's homographies.

/// A camera above the origin of the floor, looking forward and down.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pinhole {
    pub(crate) focal: f64,
    pub(crate) center: [f64; 2],
    /// Above the floor [m].
    pub(crate) height: f64,
    /// Of the optical axis below the horizontal [rad].
    pub(crate) tilt: f64,
    /// To the left [rad].
    pub(crate) yaw: f64,
    /// About the optical axis, the picture turning clockwise [rad].
    pub(crate) roll: f64,
    /// Foot of the camera on the floor [m].
    pub(crate) foot: [f64; 2],
}

impl Pinhole {
    /// The paper's camera: 480 x 220, f 450 px, 1.0 m high, 24 degrees down.
    pub(crate) fn paper() -> Self {
        Self {
            focal: 450.0,
            center: [239.5, 109.5],
            height: 1.0,
            tilt: 24f64.to_radians(),
            yaw: 0.0,
            roll: 0.0,
            foot: [0.0, 0.0],
        }
    }

    /// Right, down and forward of the camera in floor axes (x forward, y left, z up).
    fn axes(&self) -> [[f64; 3]; 3] {
        let (st, ct) = self.tilt.sin_cos();
        let (sy, cy) = self.yaw.sin_cos();
        let (sr, cr) = self.roll.sin_cos();
        let forward = [cy * ct, sy * ct, -st];
        let right = [sy, -cy, 0.0];
        let down = [-cy * st, -sy * st, -ct];
        let mix = |a: f64, b: f64| std::array::from_fn(|k| a * right[k] + b * down[k]);
        [mix(cr, sr), mix(-sr, cr), forward]
    }

    /// The pixel of a floor point, where it is before the camera.
    pub(crate) fn pixel(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let to = [x - self.foot[0], y - self.foot[1], -self.height];
        let [right, down, ahead] = self
            .axes()
            .map(|axis| axis.iter().zip(&to).map(|(a, b)| a * b).sum::<f64>());
        (ahead > 0.0).then(|| {
            [
                self.center[0] + self.focal * right / ahead,
                self.center[1] + self.focal * down / ahead,
            ]
        })
    }

    /// The floor point that a pixel sees, by its ray.
    pub(crate) fn floor(&self, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let [right, down, forward] = self.axes();
        let (a, b) = (
            (u - self.center[0]) / self.focal,
            (v - self.center[1]) / self.focal,
        );
        let ray: [f64; 3] = std::array::from_fn(|k| a * right[k] + b * down[k] + forward[k]);
        let reach = self.height / -ray[2];
        (ray[2] < 0.0).then(|| [self.foot[0] + reach * ray[0], self.foot[1] + reach * ray[1]])
    }

    /// Pixel to floor, row-major: the ray's crossing with the floor is linear in homogeneous pixels.
    pub(crate) fn pixel_to_floor(&self) -> [[f64; 3]; 3] {
        let [right, down, forward] = self.axes();
        let ray = |k: usize| {
            [
                right[k] / self.focal,
                down[k] / self.focal,
                forward[k] - (self.center[0] * right[k] + self.center[1] * down[k]) / self.focal,
            ]
        };
        let [rx, ry, rz] = [ray(0), ray(1), ray(2)];
        let along =
            |r: [f64; 3], foot: f64| std::array::from_fn(|k| self.height * r[k] - foot * rz[k]);
        [
            along(rx, self.foot[0]),
            along(ry, self.foot[1]),
            rz.map(|z| -z),
        ]
    }
}
