//! What moves a line of the floor besides noise.

use crate::Segment;

/// How much gray levels drift across an edge besides its step: shading, blurred neighbours.
const DRIFT_LEVELS: f64 = 2.4;
/// A texture's gray levels are independent of each other at this distance [px].
const GRAIN_PX: f64 = 8.0;
/// What stands at the end of a line moves that end by so much [px^2 over its length]: it is seen on a few
/// pixels, whatever the length.
const END_PX2: f64 = 2.4;

/// The segment, its covariance with what moves it as a whole (by drift over contrast) and at either end.
/// `texture` is one sigma of the gray levels along it.
pub(super) fn disturbed(segment: &Segment, texture: f64) -> Segment {
    let length = segment.length_px().max(1.0);
    let drift = DRIFT_LEVELS.powi(2) + texture * texture * (GRAIN_PX / length).min(1.0);
    let whole = drift / segment.contrast.powi(2).max(1.0);
    let end = (END_PX2 / length).powi(2);
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
