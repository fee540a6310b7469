//! What moves a line of the floor besides noise.

use crate::Segment;

/// What moves lines of one kind, from the residuals of lines in rendered corridors against their truth.
pub(super) struct Disturbance {
    /// How much gray levels drift across an edge besides its step: shading, blurred neighbours.
    drift_levels: f64,
    /// What stands at the end of a line moves that end by so much [px^2 over its length]: it is seen on a few
    /// pixels, whatever the length.
    end_px2: f64,
}

pub(super) const FLOOR_EDGE: Disturbance = Disturbance {
    drift_levels: 1.36,
    end_px2: 2.1,
};
pub(super) const VERTICAL: Disturbance = Disturbance {
    drift_levels: 0.6,
    end_px2: 1.1,
};
/// A texture's gray levels are independent of each other at this distance [px].
const GRAIN_PX: f64 = 8.0;

/// The segment, its covariance with what moves it as a whole (by drift over contrast) and at either end.
/// `texture` is one sigma of the gray levels along it.
pub(super) fn disturbed(segment: &Segment, by: &Disturbance, texture: f64) -> Segment {
    let length = segment.length_px().max(1.0);
    let drift = by.drift_levels.powi(2) + texture * texture * (GRAIN_PX / length).min(1.0);
    let whole = drift / segment.contrast.powi(2).max(1.0);
    let end = (by.end_px2 / length).powi(2);
    // about the middle, ends that move independently shift and turn independently
    let (shift, turn) = (whole + 0.5 * end, 2.0 * end / (length * length));
    let (cos, sin) = (segment.theta.cos(), segment.theta.sin());
    let along = |p: [f64; 2]| p[1] * cos - p[0] * sin;
    let middle = 0.5 * (along(segment.start) + along(segment.end));
    let mut covariance = segment.covariance;
    covariance[0][0] += shift + middle * middle * turn;
    covariance[0][1] += middle * turn;
    covariance[1][0] += middle * turn;
    covariance[1][1] += turn;
    Segment {
        covariance,
        ..*segment
    }
}
