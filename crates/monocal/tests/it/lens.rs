//! Lenses against OpenCV's.

use monocal::{CameraMatrix, Distortion, Lens, LensError, PixelPoint};
use proptest::prelude::*;

use crate::csv::{lines, numbers};

fn lens(model: &str, matrix: &[f64], k: &[f64]) -> Lens {
    let distortion = match model {
        "plumb_bob" => Distortion::PlumbBob(k[..5].try_into().expect("by construction")),
        "rational_polynomial" => {
            Distortion::RationalPolynomial(k.try_into().expect("by construction"))
        }
        _ => Distortion::Equidistant(k[..4].try_into().expect("by construction")),
    };
    let &[fx, fy, cx, cy] = matrix else {
        panic!("{matrix:?}")
    };
    Lens::new(CameraMatrix { fx, fy, cx, cy }, distortion).expect("by construction")
}

#[test]
fn pixels_are_where_opencv_puts_them() {
    let rows = lines("golden/lens.csv", true);
    assert_eq!(rows.len(), 420);
    let mut worst: f64 = 0.0;
    for row in rows {
        let n = numbers(&row[1..]);
        let lens = lens(&row[0], &n[..4], &n[4..12]);
        let (ideal, seen) = (PixelPoint::new(n[12], n[13]), PixelPoint::new(n[14], n[15]));
        let distorted = lens.distort(ideal).unwrap();
        let off = (distorted.u - seen.u).hypot(distorted.v - seen.v);
        assert!(off < 1e-9 * seen.u.hypot(seen.v), "{row:?}: {distorted:?}");
        let back = lens.undistort(seen).unwrap();
        worst = worst.max((back.u - ideal.u).hypot(back.v - ideal.v));
    }
    assert!(worst < 1e-7, "{worst} px");
}

proptest! {
    #[test]
    fn undoing_is_the_inverse_and_its_slope_that_of_small_steps(
        row in 0..420_usize, du in -20.0..20.0f64, dv in -20.0..20.0f64,
    ) {
        let rows = lines("golden/lens.csv", true);
        let n = numbers(&rows[row][1..]);
        let lens = lens(&rows[row][0], &n[..4], &n[4..12]);
        let seen = PixelPoint::new(n[14] + du, n[15] + dv);
        let Some(ideal) = lens.undistort(seen) else { return Ok(()) };
        let again = lens.distort(ideal).unwrap();
        prop_assert!((again.u - seen.u).hypot(again.v - seen.v) < 1e-6);
        let slope = lens.undistort_jacobian(seen).unwrap();
        let e = 1e-3;
        let step = |a: f64, b: f64| lens.undistort(PixelPoint::new(seen.u + a, seen.v + b));
        if let (Some(r), Some(l), Some(b), Some(a)) = (step(e, 0.0), step(-e, 0.0), step(0.0, e), step(0.0, -e)) {
            let by_u = [(r.u - l.u) / (2.0 * e), (r.v - l.v) / (2.0 * e)];
            let by_v = [(b.u - a.u) / (2.0 * e), (b.v - a.v) / (2.0 * e)];
            let size = 1.0 + slope[0][0].abs() + slope[1][1].abs();
            for k in 0..2 {
                prop_assert!((slope[k][0] - by_u[k]).abs() < 1e-4 * size * size, "{slope:?} {by_u:?}");
                prop_assert!((slope[k][1] - by_v[k]).abs() < 1e-4 * size * size, "{slope:?} {by_v:?}");
            }
        }
    }
}

#[test]
fn what_a_lens_folds_over_is_not_undone() {
    let matrix = CameraMatrix {
        fx: 100.0,
        fy: 100.0,
        cx: 0.0,
        cy: 0.0,
    };
    // r (1 - r^2 / 3) turns back at r = 1, at 2/3 of the focal length
    let lens = Lens::new(
        matrix,
        Distortion::PlumbBob([-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0]),
    )
    .unwrap();
    assert!(lens.undistort(PixelPoint::new(66.0, 0.0)).is_some());
    assert!(lens.undistort(PixelPoint::new(67.0, 0.0)).is_none());
    assert!(lens.undistort(PixelPoint::new(1e9, f64::NAN)).is_none());
    assert!(lens.distort(PixelPoint::new(99.0, 0.0)).is_some());
    assert!(lens.distort(PixelPoint::new(101.0, 0.0)).is_none());
}

#[test]
fn impossible_lenses_are_refused() {
    let matrix = CameraMatrix {
        fx: 100.0,
        fy: 0.0,
        cx: 0.0,
        cy: 0.0,
    };
    let none = Distortion::PlumbBob([0.0; 5]);
    assert_eq!(
        Lens::new(matrix, none),
        Err(LensError::Focal { found: 0.0 })
    );
    let matrix = CameraMatrix {
        fy: 100.0,
        ..matrix
    };
    let bad = Distortion::Equidistant([f64::INFINITY, 0.0, 0.0, 0.0]);
    assert!(matches!(
        Lens::new(matrix, bad),
        Err(LensError::NotFinite { .. })
    ));
    let folded = Distortion::PlumbBob([-1e6, 0.0, 0.0, 0.0, 0.0]);
    assert!(matches!(
        Lens::new(matrix, folded),
        Err(LensError::Folded { .. })
    ));
}
