//! The line of an edge by definition.

use image::GrayImage;

use crate::Segment;

/// Half the width of the window [px].
const REACH: f64 = 3.5;

/// Where a row of gray levels crosses an edge, near a place: the p at which the gray-level differences about p,
/// weighted by Tukey's biweight times the distance, sum to 0. `None` where the window leaves the row or no sign
/// changes within 1 px.
#[must_use]
pub fn place(levels: &[f64], near: f64) -> Option<f64> {
    let sum = |p: f64| -> f64 {
        let term = |(k, pair): (usize, &[f64])| {
            let t = k as f64 + 0.5 - p;
            let inside = (1.0 - (t / REACH).powi(2)).max(0.0);
            t * inside * inside * (pair[1] - pair[0])
        };
        levels.windows(2).enumerate().map(term).sum()
    };
    if near < 3.0 || near + 4.0 >= levels.len() as f64 {
        return None;
    }
    let (mut low, mut high) = (near - 1.0, near + 1.0);
    let rising = sum(low);
    if rising * sum(high) > 0.0 {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if sum(middle) * rising > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}

/// The least-squares line (rho, theta) through the places at which the rows or columns between a segment's ends
/// cross its edge; theta from 0 to below pi. `None` for fewer than two.
#[must_use]
pub fn line(image: &GrayImage, segment: &Segment) -> Option<[f64; 2]> {
    let [du, dv] = [0, 1].map(|i| segment.end[i] - segment.start[i]);
    let along_u = du.abs() > dv.abs();
    let (from, to, across) = if along_u {
        (segment.start[0], segment.end[0], image.height())
    } else {
        (segment.start[1], segment.end[1], image.width())
    };
    let (sin, cos) = segment.theta.sin_cos();
    let mut points = Vec::new();
    for t in from.min(to).round() as u32..=from.max(to).round() as u32 {
        let level = |m: u32| {
            let [u, v] = if along_u { [t, m] } else { [m, t] };
            f64::from(image.get_pixel(u, v).0[0])
        };
        let levels: Vec<f64> = (0..across).map(level).collect();
        let near = if along_u {
            (segment.rho - f64::from(t) * cos) / sin
        } else {
            (segment.rho - f64::from(t) * sin) / cos
        };
        points.extend(place(&levels, near).map(|m| [f64::from(t), m]));
    }
    // the outer four at either end of a line of 24 or more are another edge's too
    let ends = if points.len() >= 24 { 4 } else { 0 };
    let points = &points[ends..points.len() - ends];
    let count = points.len() as f64;
    let [t, m] = [0, 1].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / count);
    let spread: f64 = points.iter().map(|p| (p[0] - t).powi(2)).sum();
    let slope = points.iter().map(|p| (p[0] - t) * (p[1] - m)).sum::<f64>() / spread;
    let normal = if along_u {
        [-slope, 1.0]
    } else {
        [1.0, -slope]
    };
    let point = if along_u { [t, m] } else { [m, t] };
    let mut theta = normal[1].atan2(normal[0]);
    let length = slope.hypot(1.0);
    let mut rho = (normal[0] * point[0] + normal[1] * point[1]) / length;
    if theta < 0.0 {
        (rho, theta) = (-rho, theta + std::f64::consts::PI);
    }
    rho.is_finite().then_some([rho, theta])
}
