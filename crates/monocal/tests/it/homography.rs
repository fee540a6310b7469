//! The homography against the pinhole camera's rays.

use monocal::{FloorHomography, GroundPoint, HomographyError, PixelPoint, paper};
use proptest::prelude::*;

use crate::pinhole::Pinhole;

fn cameras() -> impl Strategy<Value = Pinhole> {
    let angles = (0.05..1.5f64, -3.1..3.1f64, -0.5..0.5f64);
    (angles, 100.0..2000.0f64, 0.1..3.0f64, -2.0..2.0f64).prop_map(
        |((tilt, yaw, roll), focal, height, x)| Pinhole {
            focal,
            center: [320.0, 240.0],
            height,
            tilt,
            yaw,
            roll,
            foot: [x, -x / 2.0],
        },
    )
}

proptest! {
    #[test]
    fn floor_points_are_where_rays_meet_the_floor(
        camera in cameras(), u in -10.0..650.0f64, v in -10.0..490.0f64, scale in prop_oneof![-1e6..-1e-6, 1e-6..1e6f64],
    ) {
        let scaled = camera.pixel_to_floor().map(|row| row.map(|entry| entry * scale));
        let homography = FloorHomography::new(scaled).unwrap();
        let truth = camera.floor([u, v]);
        let found = homography.floor_point(PixelPoint::new(u, v));
        prop_assert_eq!(truth.is_some(), found.is_some(), "one side of the horizon");
        if let (Some(truth), Some(found)) = (truth, found) {
            let size = truth[0].hypot(truth[1]).max(1.0);
            prop_assume!(size < 1e4);
            prop_assert!(found.distance(truth.into()) < 1e-9 * size * size, "{:?} {:?}", truth, found);
            let back = homography.pixel_of(found).unwrap();
            prop_assert!((back.u - u).hypot(back.v - v) < 1e-6 * size);
        }
    }

    #[test]
    fn derivatives_are_those_of_small_steps(camera in cameras(), x in 0.5..4.0f64, y in -1.0..1.0f64) {
        let homography = FloorHomography::new(camera.pixel_to_floor()).unwrap();
        let Some([u, v]) = camera.pixel([x, y]) else { return Ok(()) };
        prop_assume!(u.abs() < 3000.0 && v.abs() < 3000.0);
        let jacobian = homography.jacobian(PixelPoint::new(u, v)).unwrap();
        let e = 1e-4;
        let step = |du: f64, dv: f64| camera.floor([u + du, v + dv]).unwrap();
        let [right, left, below, above] = [step(e, 0.0), step(-e, 0.0), step(0.0, e), step(0.0, -e)];
        for k in 0..2 {
            let by_u = (right[k] - left[k]) / (2.0 * e);
            let by_v = (below[k] - above[k]) / (2.0 * e);
            let size = jacobian[k][0].abs() + jacobian[k][1].abs();
            prop_assert!((jacobian[k][0] - by_u).abs() < 1e-5 * size, "{:?} {}", jacobian, by_u);
            prop_assert!((jacobian[k][1] - by_v).abs() < 1e-5 * size, "{:?} {}", jacobian, by_v);
        }
        let back = homography.pixel_jacobian(GroundPoint::new(x, y)).unwrap();
        for (r, c) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let product = jacobian[r][0] * back[0][c] + jacobian[r][1] * back[1][c];
            prop_assert!((product - f64::from(u8::from(r == c))).abs() < 1e-8, "inverse of each other");
        }
    }

    #[test]
    fn the_horizon_is_where_level_rays_go(camera in cameras(), u in 0.0..640.0f64) {
        prop_assume!(camera.tilt < 1.4);
        let homography = FloorHomography::new(camera.pixel_to_floor()).unwrap();
        let [a, b, c] = homography.horizon().unwrap();
        let v = -(a * u + c) / b;
        prop_assert!((a.hypot(b) - 1.0).abs() < 1e-12);
        let side = b.signum();
        prop_assert!(camera.floor([u, v + 0.01 * side]).is_some());
        prop_assert!(camera.floor([u, v - 0.01 * side]).is_none());
    }
}

#[test]
fn one_pixel_covers_what_the_paper_s_formula_says() {
    let [a, b, c] = paper::PRINTED[0];
    let [d, e, f] = paper::PRINTED[1];
    let [g, h, i] = paper::PRINTED[2];
    let homography = paper::homography().unwrap();
    for (column, row) in [(10.0, 5.0), (240.0, 100.0), (470.0, 210.0)] {
        let (x, y): (f64, f64) = (column, -row);
        let depth = g * x + h * y + i;
        let left = ((a * h - b * g) * y + (a * i - c * g)) / (depth * (depth + g));
        let ahead = ((e * g - h * d) * x + (e * i - h * f)) / (depth * (depth + h));
        let ours = homography.resolution(PixelPoint::new(column, row)).unwrap();
        // the paper steps up a row (its y grows upwards), ours down: one row lower, the same two rows
        let above = homography
            .resolution(PixelPoint::new(column, row - 1.0))
            .unwrap();
        assert!((ours.dy - left.abs() / 100.0).abs() < 1e-12);
        assert!(
            (above.dx - ahead.abs() / 100.0).abs() < 1e-12,
            "{ours:?} {ahead}"
        );
    }
}

#[test]
fn the_paper_s_matrix_sees_its_region() {
    let homography = paper::homography().unwrap();
    let far = homography.floor_point(PixelPoint::new(240.0, 0.0)).unwrap();
    let near = homography
        .floor_point(PixelPoint::new(240.0, 220.0))
        .unwrap();
    assert!((far.x - 6.25).abs() < 0.01, "{far:?}");
    assert!((near.x - 1.91).abs() < 0.01, "{near:?}");
    let left = homography.floor_point(PixelPoint::new(0.0, 110.0)).unwrap();
    assert!(left.y > 0.5, "{left:?}");
}

#[test]
fn unusable_matrices_are_refused() {
    let mut matrix = Pinhole::paper().pixel_to_floor();
    matrix[1][2] = f64::NAN;
    assert!(matches!(
        FloorHomography::new(matrix),
        Err(HomographyError::NotFinite {
            row: 1,
            column: 2,
            ..
        })
    ));
    for rank_two in [
        [[0.0; 3]; 3],
        [[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [0.0, 0.0, 1.0]],
    ] {
        assert!(matches!(
            FloorHomography::new(rank_two),
            Err(HomographyError::Singular { .. })
        ));
    }
    let huge = Pinhole::paper()
        .pixel_to_floor()
        .map(|row| row.map(|e| e * 1e300));
    assert!(FloorHomography::new(huge).is_ok());
}

#[test]
fn a_camera_that_looks_straight_down_has_no_horizon() {
    let homography =
        FloorHomography::new([[0.0, -0.01, 2.4], [-0.01, 0.0, 3.2], [0.0, 0.0, 1.0]]).unwrap();
    assert_eq!(homography.horizon(), None);
    let seen = homography
        .floor_point(PixelPoint::new(320.0, 240.0))
        .unwrap();
    assert!(seen.distance(GroundPoint::new(0.0, 0.0)) < 1e-12);
}
