//! Frames with the lens undone.

use image::{GrayImage, Luma};
use monocal::{CameraMatrix, Distortion, Lens, PixelPoint, Rectifier};

fn lens(distortion: Distortion) -> Lens {
    let matrix = CameraMatrix {
        fx: 300.0,
        fy: 310.0,
        cx: 165.0,
        cy: 118.0,
    };
    Lens::new(matrix, distortion).expect("a lens")
}

const LENSES: [Distortion; 4] = [
    Distortion::PlumbBob([-0.3, 0.1, 0.001, -0.002, 0.0]),
    Distortion::PlumbBob([0.2, -0.05, 0.0, 0.0, 0.0]),
    Distortion::RationalPolynomial([-0.2, 0.05, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0]),
    Distortion::Equidistant([-0.02, 0.004, 0.0, 0.0]),
];

/// A frame whose gray levels are linear in the undistorted place: rectified, they are linear in the place.
#[test]
fn a_rectified_pixel_shows_its_undistorted_place() {
    for distortion in LENSES {
        let lens = lens(distortion);
        let shade = |u: f64, v: f64| 128.0 + 0.3 * (u - 165.0) + 0.2 * (v - 118.0);
        let frame = GrayImage::from_fn(320, 240, |u, v| {
            let ideal = lens.undistort(PixelPoint::new(f64::from(u), f64::from(v)));
            let ideal = ideal.expect("in reach");
            Luma([shade(ideal.u, ideal.v).round().clamp(0.0, 255.0) as u8])
        });
        let rectifier = Rectifier::new(&lens, [320, 240]).expect("a picture");
        let mut flat = GrayImage::default();
        rectifier.rectify(&frame, &mut flat);
        let [left, top] = rectifier.origin().map(f64::from);
        let mut worst = 0.0_f64;
        for (u, v, pixel) in flat.enumerate_pixels() {
            let wanted = shade(f64::from(u) + left, f64::from(v) + top);
            if (2.0..253.0).contains(&wanted) {
                worst = worst.max((f64::from(pixel.0[0]) - wanted).abs());
            }
        }
        assert!(worst < 1.5, "{distortion:?}: {worst} gray levels");
        // nothing is made up: each corner is in the frame
        let (right, bottom) = (flat.width() - 1, flat.height() - 1);
        for [u, v] in [[0, 0], [right, 0], [0, bottom], [right, bottom]] {
            let ideal = PixelPoint::new(f64::from(u) + left, f64::from(v) + top);
            let seen = lens.distort(ideal).expect("in reach");
            let inside = (-0.01..=319.01).contains(&seen.u) && (-0.01..=239.01).contains(&seen.v);
            assert!(inside, "{distortion:?}: {seen:?}");
        }
        assert!(
            flat.width() >= 240 && flat.height() >= 180,
            "{distortion:?}"
        );
    }
}

#[test]
fn a_lens_that_bends_nothing_gives_the_frame_again() {
    let lens = lens(Distortion::PlumbBob([0.0; 5]));
    assert!(lens.is_plain() && lens.without_distortion() == lens);
    let frame = GrayImage::from_fn(40, 30, |u, v| Luma([(u * 37 + v * 91) as u8]));
    let rectifier = Rectifier::new(&lens, [40, 30]).expect("a picture");
    assert_eq!(rectifier.origin(), [0, 0]);
    let mut flat = GrayImage::default();
    rectifier.rectify(&frame, &mut flat);
    assert_eq!(flat, frame);
}

#[test]
fn pictures_too_small_to_read_between_are_refused() {
    let lens = lens(LENSES[0]);
    for size in [[0, 0], [1, 1], [1, 240], [320, 1]] {
        assert!(Rectifier::new(&lens, size).is_none(), "{size:?}");
    }
}
