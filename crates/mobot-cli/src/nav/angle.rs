//! Angles on the circle.

/// Into -pi..=pi.
pub(crate) fn wrap(angle: f64) -> f64 {
    let turns = (angle / std::f64::consts::TAU).round();
    angle - turns * std::f64::consts::TAU
}
