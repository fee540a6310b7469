//! Sets of points that cannot determine a homography, whatever is fitted: fewer than four places, all on a
//! line, all but one on a line.

use nalgebra::Vector2;

use super::{CalibrateError, Side};

/// Refuses points that leave a homography open, judged to within a tolerance.
///
/// `indices[k]` is the number of the pair that `points[k]` belongs to. Time is quadratic in the number of
/// different places.
pub(super) fn check(
    side: Side,
    points: &[Vector2<f64>],
    indices: &[usize],
    tolerance: f64,
) -> Result<(), CalibrateError> {
    let places = places(points, tolerance);
    if places.len() < 4 {
        return Err(CalibrateError::FewPlaces {
            side,
            found: places.len(),
        });
    }
    let all: Vec<Vector2<f64>> = places.iter().map(|&k| points[k]).collect();
    if on_a_line(&all, None, tolerance) {
        return Err(CalibrateError::Collinear { side });
    }
    match (0..all.len()).find(|&off| on_a_line(&all, Some(off), tolerance)) {
        None => Ok(()),
        // three of four are on a line for each choice of the fourth only where all are
        Some(off) => Err(CalibrateError::CollinearButOne {
            side,
            off: indices[places[off]],
        }),
    }
}

/// The first point of every place: points within the tolerance of it are the same place.
fn places(points: &[Vector2<f64>], tolerance: f64) -> Vec<usize> {
    let mut places: Vec<usize> = Vec::new();
    for (k, p) in points.iter().enumerate() {
        if places
            .iter()
            .all(|&other| (points[other] - p).norm() > tolerance)
        {
            places.push(k);
        }
    }
    places
}

/// All points, or all but one, are within the tolerance of their total least-squares line.
fn on_a_line(points: &[Vector2<f64>], without: Option<usize>, tolerance: f64) -> bool {
    let chosen = || {
        points
            .iter()
            .enumerate()
            .filter(|(k, _)| Some(*k) != without)
            .map(|(_, p)| p)
    };
    let count = chosen().count() as f64;
    let center = chosen().sum::<Vector2<f64>>() / count;
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for p in chosen() {
        let d = p - center;
        xx += d.x * d.x;
        xy += d.x * d.y;
        yy += d.y * d.y;
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let normal = Vector2::new(-angle.sin(), angle.cos());
    chosen().all(|p| normal.dot(&(p - center)).abs() <= tolerance)
}
