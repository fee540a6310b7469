//! Directions of gradients, fast enough for every edge pixel of a frame.

use std::f32::consts::{FRAC_PI_2, PI};

/// The angle of (gx, gy), as `atan2(gy, gx)`, within 2e-6 rad: -pi to pi, 0 for (0, 0).
///
/// Minimax polynomial of odd powers (Hastings 1955, Approximations for Digital Computers, sheet 13);
/// branchless, so that loops over it vectorise.
#[inline(always)]
pub(crate) fn direction(gx: f32, gy: f32) -> f32 {
    let (across, along) = (gx.abs(), gy.abs());
    let (small, large) = if across < along {
        (across, along)
    } else {
        (along, across)
    };
    let t = small / large.max(f32::MIN_POSITIVE);
    let t2 = t * t;
    let mut angle = -0.011_721_2_f32;
    for coefficient in [
        0.052_653_32,
        -0.116_432_87,
        0.193_543_46,
        -0.332_623_47,
        0.999_977_26,
    ] {
        angle = angle * t2 + coefficient;
    }
    angle *= t;
    angle = if across < along {
        FRAC_PI_2 - angle
    } else {
        angle
    };
    angle = if gx < 0.0 { PI - angle } else { angle };
    if gy < 0.0 { -angle } else { angle }
}

#[cfg(test)]
mod tests {
    use super::direction;

    #[test]
    fn all_gradients_have_their_angle() {
        let mut worst = 0f64;
        for gx in -1020i16..=1020 {
            for gy in (-1020i16..=1020).step_by(3).chain([0]) {
                let exact = f64::from(gy).atan2(f64::from(gx));
                let ours = f64::from(direction(f32::from(gx), f32::from(gy)));
                worst = worst.max((ours - exact).abs());
            }
        }
        assert!(worst < 2e-6, "{worst}");
        assert!(direction(0.0, 0.0).abs() < 1e-9);
    }
}
