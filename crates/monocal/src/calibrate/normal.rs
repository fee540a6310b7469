//! Normalised coordinates, and where a map puts floor points in them.

use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2};

/// A shift and a scale: `normalised = (raw - shift) * scale`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scaling {
    shift: Vector2<f64>,
    pub(super) scale: f64,
}

impl Scaling {
    /// Centroid to 0, mean distance from it to the square root of 2.
    pub(super) fn of(points: impl Iterator<Item = Vector2<f64>> + Clone) -> Self {
        let count = points.clone().count().max(1) as f64;
        let shift = points.clone().sum::<Vector2<f64>>() / count;
        let mean = points.map(|p| (p - shift).norm()).sum::<f64>() / count;
        let scale = if mean > 0.0 {
            std::f64::consts::SQRT_2 / mean
        } else {
            1.0
        };
        Self { shift, scale }
    }

    pub(super) fn apply(&self, p: Vector2<f64>) -> Vector2<f64> {
        (p - self.shift) * self.scale
    }

    pub(super) fn matrix(&self) -> Matrix3<f64> {
        let s = self.scale;
        Matrix3::new(
            s,
            0.0,
            -s * self.shift.x,
            0.0,
            s,
            -s * self.shift.y,
            0.0,
            0.0,
            1.0,
        )
    }
}

/// The third component of a floor point's picture: above zero before the camera.
pub(super) fn depth(map: &Matrix3<f64>, floor: Vector2<f64>) -> f64 {
    map[(2, 0)] * floor.x + map[(2, 1)] * floor.y + map[(2, 2)]
}

/// Where a floor point is seen, and the slope there.
pub(super) fn image(map: &Matrix3<f64>, q: Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
    let h = map * q.push(1.0);
    if h.z.is_nan() || h.z <= 0.0 {
        return None;
    }
    let seen = h.xy() / h.z;
    let slope = Matrix2::from_fn(|r, c| (map[(r, c)] - seen[r] * map[(2, c)]) / h.z);
    Some((seen, slope))
}

/// How the seen pixel moves with the map's entries; `None` behind the camera.
pub(super) fn image_by_entries(map: &Matrix3<f64>, q: Vector2<f64>) -> Option<SMatrix<f64, 2, 9>> {
    let (seen, _) = image(map, q)?;
    let over_depth = q.push(1.0) / depth(map, q);
    let mut rows = SMatrix::zeros();
    for k in 0..3 {
        rows[(0, k)] = over_depth[k];
        rows[(1, 3 + k)] = over_depth[k];
        rows[(0, 6 + k)] = -seen.x * over_depth[k];
        rows[(1, 6 + k)] = -seen.y * over_depth[k];
    }
    Some(rows)
}
