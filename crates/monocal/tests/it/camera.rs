//! Error bars of floor points.

use monocal::{FloorCamera, FloorHomography, PixelPoint};

use crate::pinhole::Pinhole;

#[test]
fn nothing_near_the_horizon_has_error_bars() {
    let truth = Pinhole::paper();
    let camera = FloorCamera::exact(FloorHomography::new(truth.pixel_to_floor()).unwrap());
    let noise = [[0.25, 0.0], [0.0, 0.25]];
    let horizon = truth.center[1] - truth.focal * truth.tilt.tan();
    let at = |below: f64| camera.floor_estimate(PixelPoint::new(100.0, horizon + below), noise);
    assert!(at(-1.0).is_none());
    assert!(at(1.49).is_none(), "three sigmas of 0.5 px");
    let estimate = at(1.51).unwrap();
    assert!(estimate.covariance[0][0] > 1.0);
}

#[test]
fn pixel_noise_grows_with_the_square_of_the_distance() {
    let truth = Pinhole::paper();
    let camera = FloorCamera::exact(FloorHomography::new(truth.pixel_to_floor()).unwrap());
    for x in [2.0, 4.0, 6.0] {
        let [u, v] = truth.pixel([x, 0.0]).unwrap();
        let estimate = camera
            .floor_estimate(PixelPoint::new(u, v), [[0.25, 0.0], [0.0, 0.25]])
            .unwrap();
        // dx/dv = (x^2 + h^2) / (h f) cos^2 of the ray's angle to the axis
        let angle = (1.0 / x).atan() - truth.tilt;
        let expected = 0.5 * (x * x + 1.0) / truth.focal * angle.cos().powi(2);
        let sigma = estimate.covariance[0][0].sqrt();
        assert!((sigma - expected).abs() < 1e-9, "{x} m: {sigma} {expected}");
    }
}
