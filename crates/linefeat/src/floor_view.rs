//! How the floor lies in the picture: what a calibrated camera tells this crate.

/// The floor as the camera sees it.
///
/// Floor points are in the base frame: x forward, y left [m].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FloorView {
    /// Homography from pixels to the floor, row-major, homogeneous, of the sign for which the third
    /// component is positive below the horizon.
    pub pixel_to_floor: [[f64; 3]; 3],
    /// Vanishing point of the vertical, homogeneous: where plumb lines meet in the picture, which is
    /// also where the floor right under the camera would be seen.
    pub nadir: [f64; 3],
}

impl FloorView {
    /// The floor point that a pixel sees [m]; `None` on the horizon or above it.
    #[must_use]
    pub fn floor_point(&self, pixel: [f64; 2]) -> Option<[f64; 2]> {
        let [x, y, w] = times(&self.pixel_to_floor, [pixel[0], pixel[1], 1.0]);
        let point = [x / w, y / w];
        (w > 0.0 && point.iter().all(|c| c.is_finite())).then_some(point)
    }

    /// The floor point right under the camera [m]: the foot of its plumb line.
    #[must_use]
    pub fn camera_foot(&self) -> [f64; 2] {
        let [x, y, w] = times(&self.pixel_to_floor, self.nadir);
        [x / w, y / w]
    }

    /// Homography from the floor to pixels, homogeneous, of any scale.
    pub(crate) fn floor_to_pixel(&self) -> [[f64; 3]; 3] {
        adjugate(&self.pixel_to_floor)
    }
}

pub(crate) fn times(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

pub(crate) fn product(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    a.map(|row| std::array::from_fn(|j| (0..3).map(|k| row[k] * b[k][j]).sum()))
}

/// The inverse times the determinant: all that a homogeneous matrix needs.
pub(crate) fn adjugate(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let minor = |r: usize, c: usize| {
        let (r0, r1) = ((r + 1) % 3, (r + 2) % 3);
        let (c0, c1) = ((c + 1) % 3, (c + 2) % 3);
        m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0]
    };
    std::array::from_fn(|i| std::array::from_fn(|j| minor(j, i)))
}
