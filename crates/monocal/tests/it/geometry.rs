//! Focal length, height and tilt against cameras whose mounting is known.

use monocal::{
    CalibrateParams, CameraMatrix, Distortion, FloorCamera, FloorHomography, Lens, Undetermined,
    calibrate, paper,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::calibrate::{pairs_of, paper_marks};
use crate::pinhole::Pinhole;

fn exact(truth: &Pinhole, image_size: Option<[u32; 2]>) -> FloorCamera {
    FloorCamera {
        image_size,
        ..FloorCamera::exact(FloorHomography::new(truth.pixel_to_floor()).expect("by construction"))
    }
}

#[test]
fn an_exact_homography_tells_its_mounting_exactly() {
    let mut rng = Pcg64::seed_from_u64(3);
    for _ in 0..200 {
        let truth = Pinhole {
            focal: rng.random_range(200.0..900.0),
            center: [319.5, 239.5],
            height: rng.random_range(0.2..2.0),
            tilt: rng.random_range(0.15..1.2),
            yaw: rng.random_range(-3.0..3.0),
            roll: rng.random_range(-0.5..0.5),
            foot: [rng.random_range(-1.0..1.0), 0.3],
        };
        let found = match exact(&truth, Some([640, 480])).geometry() {
            Ok(found) => found,
            // near to looking level or straight down, 13 px of principal point hide the focal length
            Err(Undetermined::Focal { relative }) => {
                assert!(relative < 2.0, "{truth:?}");
                continue;
            }
            Err(other) => panic!("{truth:?}: {other}"),
        };
        assert!(
            (found.focal_px - truth.focal).abs() < 1e-6 * truth.focal,
            "{truth:?} {found:?}"
        );
        assert!(
            (found.height - truth.height).abs() < 1e-6,
            "{truth:?} {found:?}"
        );
        assert!(
            (found.tilt - truth.tilt).abs() < 1e-6,
            "{truth:?} {found:?}"
        );
        assert!((found.yaw - truth.yaw).abs() < 1e-6, "{truth:?} {found:?}");
        assert!(
            (found.roll - truth.roll).abs() < 1e-6,
            "{truth:?} {found:?}"
        );
        assert!((found.foot.x - truth.foot[0]).hypot(found.foot.y - truth.foot[1]) < 1e-6);
        // far below the camera, a point of the vertical through its foot
        let [u, v, w] = found.nadir;
        let below = Pinhole {
            height: 1e7,
            ..truth
        }
        .pixel(truth.foot.map(|c| c + 1e-3))
        .unwrap();
        assert!(
            (u / w - below[0]).hypot(v / w - below[1]) < 0.02,
            "{truth:?} {found:?}"
        );
    }
}

#[test]
fn sigmas_hold_the_truth() {
    let truth = Pinhole::paper();
    let mut rng = Pcg64::seed_from_u64(5);
    let (mut inside, trials) = (0, 300);
    let mut worst: f64 = 0.0;
    for _ in 0..trials {
        // a principal point as far off the centre as is assumed of it
        let off = Pinhole {
            center: [
                239.5 + rng.random_range(-16.0..16.0),
                109.5 + rng.random_range(-16.0..16.0),
            ],
            ..truth
        };
        let pairs = pairs_of(&off, &paper_marks(), &mut rng, 0.5, 0.0);
        let params = CalibrateParams {
            image_size: Some(paper::IMAGE_SIZE),
            ..CalibrateParams::default()
        };
        let found = calibrate(&pairs, &params)
            .unwrap()
            .camera
            .geometry()
            .unwrap();
        let errors = [
            (found.focal_px - truth.focal) / found.focal_sigma_px,
            (found.height - truth.height) / found.height_sigma,
            (found.tilt - truth.tilt) / found.tilt_sigma,
        ];
        worst = worst.max((found.height - truth.height).abs());
        inside += u32::from(errors.iter().all(|e| e.abs() < 2.5));
    }
    println!("inside {inside} of {trials}, worst height error {worst:.3} m");
    assert!(inside >= trials * 95 / 100, "{inside} of {trials}");
}

#[test]
fn what_is_not_determined_is_said_to_be_so() {
    assert_eq!(
        exact(&Pinhole::paper(), None).geometry(),
        Err(Undetermined::Center)
    );
    let down = Pinhole {
        tilt: std::f64::consts::FRAC_PI_2 - 1e-3,
        ..Pinhole::paper()
    };
    assert!(matches!(
        exact(&down, Some([480, 220])).geometry(),
        Err(Undetermined::Focal { .. })
    ));
    // pixels twice as high as wide
    let turned = Pinhole {
        roll: 0.6,
        ..Pinhole::paper()
    };
    let stretched = turned.pixel_to_floor().map(|[a, b, c]| [a, 2.0 * b, c]);
    let rolled = FloorCamera {
        image_size: Some([480, 220]),
        ..FloorCamera::exact(FloorHomography::new(stretched).unwrap())
    };
    assert!(matches!(
        rolled.geometry(),
        Err(Undetermined::NotCentered { .. } | Undetermined::Focal { .. })
    ));
}

#[test]
fn a_known_lens_determines_a_view_straight_down() {
    let truth = Pinhole {
        tilt: std::f64::consts::FRAC_PI_2 - 1e-9,
        ..Pinhole::paper()
    };
    let matrix = CameraMatrix {
        fx: 450.0,
        fy: 450.0,
        cx: 239.5,
        cy: 109.5,
    };
    let lens = Lens::new(matrix, Distortion::PlumbBob([0.0; 5])).unwrap();
    let camera = FloorCamera {
        lens: Some(lens),
        ..exact(&truth, None)
    };
    let found = camera.geometry().unwrap();
    assert!((found.height - 1.0).abs() < 1e-6, "{found:?}");
    assert!((found.tilt - truth.tilt).abs() < 1e-5, "{found:?}");
}

#[test]
fn the_paper_s_matrix_is_a_camera_1_m_high_and_24_degrees_down() {
    let camera = FloorCamera {
        image_size: Some(paper::IMAGE_SIZE),
        ..FloorCamera::exact(paper::homography().unwrap())
    };
    match camera.geometry() {
        Ok(found) => {
            println!("{found:?}");
            assert!((found.tilt.to_degrees() - 24.0).abs() < 3.0, "{found:?}");
            assert!((found.height - 1.0).abs() < 0.15, "{found:?}");
            assert!((found.focal_px - 450.0).abs() < 60.0, "{found:?}");
        }
        Err(error) => panic!("{error}"),
    }
}
