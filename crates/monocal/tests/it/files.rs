//! Files: what is written is read back, and nothing hostile gets through.

use std::path::PathBuf;

use monocal::{
    CalibrateParams, CameraInfo, CameraMatrix, Distortion, FloorCamera, Lens, PixelPoint,
    calibrate, read_pairs,
};
use proptest::prelude::*;
use rand::SeedableRng as _;
use rand_pcg::Pcg64;

use crate::calibrate::{pairs_of, paper_marks};
use crate::csv::testdata;
use crate::pinhole::Pinhole;

/// A file of this test's own.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let path = std::env::temp_dir().join(format!("monocal-{}-{name}", std::process::id()));
        std::fs::write(&path, bytes).expect("by construction");
        Self(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn a_camera_is_read_back_as_it_was() {
    let mut rng = Pcg64::seed_from_u64(1);
    let matrix = CameraMatrix {
        fx: 450.0,
        fy: 449.0,
        cx: 239.0,
        cy: 110.0,
    };
    let lens = Lens::new(
        matrix,
        Distortion::RationalPolynomial([0.1, 0.0, 0.0, 0.001, 0.0, 0.2, 0.0, 0.0]),
    )
    .unwrap();
    for lens in [None, Some(lens)] {
        let params = CalibrateParams {
            lens,
            image_size: lens.map(|_| [480, 220]),
            ..CalibrateParams::default()
        };
        let camera = calibrate(
            &pairs_of(&Pinhole::paper(), &paper_marks(), &mut rng, 0.5, 0.0),
            &params,
        )
        .unwrap()
        .camera;
        let file = Scratch::new("round.json", camera.to_json().as_bytes());
        let again = FloorCamera::load(&file.0).unwrap();
        assert_eq!(
            (again.covariance, again.lens, again.image_size),
            (camera.covariance, camera.lens, camera.image_size)
        );
        for pixel in [[10.0, 40.0], [240.0, 200.0]] {
            let (a, b) = (
                camera.floor_point(pixel.into()).unwrap(),
                again.floor_point(pixel.into()).unwrap(),
            );
            assert!(a.distance(b) < 1e-9);
        }
    }
}

#[test]
fn a_matrix_alone_is_a_camera() {
    let file = Scratch::new(
        "alone.json",
        br#"{"pixel_to_floor": [[0, -0.01, 2], [-0.01, 0, 3], [0, 0, 1]]}"#,
    );
    let camera = FloorCamera::load(&file.0).unwrap();
    let seen = camera.floor_point(PixelPoint::new(300.0, 100.0)).unwrap();
    assert!((seen.x - 1.0).hypot(seen.y) < 1e-12);
    assert_eq!(camera.covariance, [[0.0; 8]; 8]);
}

#[test]
fn bad_cameras_are_refused_in_one_line() {
    let ones = "[[1,0,0],[0,-1,0],[0,0,1]]";
    let eight = |entry: &str| {
        format!(
            "[{}]",
            vec![format!("[{}]", [entry; 8].join(",")); 8].join(",")
        )
    };
    for (text, said) in [
        (String::new(), "line 1"),
        ("{}".into(), "pixel_to_floor"),
        ("[1]".into(), "line 1"),
        (r#"{"pixel_to_floor": [[1,2],[3,4]]}"#.into(), "line 1"),
        (
            r#"{"pixel_to_floor": [[1,2,3],[2,4,6],[0,0,1]]}"#.into(),
            "inverted",
        ),
        (
            r#"{"pixel_to_floor": [[1e999,0,0],[0,-1,0],[0,0,1]]}"#.into(),
            "line 1",
        ),
        (
            format!(
                r#"{{"pixel_to_floor": {ones}, "covariance": {}}}"#,
                eight("-1")
            ),
            "covariance",
        ),
        (
            format!(r#"{{"pixel_to_floor": {ones}, "image_size": [0, 5]}}"#),
            "image_size",
        ),
        (
            format!(r#"{{"pixel_to_floor": {ones}, "pixel_sigma_px": -1}}"#),
            "pixel_sigma_px",
        ),
        (
            format!(
                r#"{{"pixel_to_floor": {ones}, "lens": {{"fx": 1, "fy": 0, "cx": 0, "cy": 0, "distortion_model": "plumb_bob", "distortion_coefficients": []}}}}"#
            ),
            "lens",
        ),
        (
            format!(
                r#"{{"pixel_to_floor": {ones}, "lens": {{"fx": 1, "fy": 1, "cx": 0, "cy": 0, "distortion_model": "w\u001bow", "distortion_coefficients": []}}}}"#
            ),
            "distortion_model",
        ),
        ("[".repeat(60_000), "line 1"),
        (" ".repeat(70_000), "bytes"),
    ] {
        let file = Scratch::new("bad.json", text.as_bytes());
        let said_so = FloorCamera::load(&file.0).unwrap_err().to_string();
        assert!(
            said_so.contains(said) && said_so.contains("bad.json"),
            "{said}: {said_so}"
        );
        assert!(
            said_so.len() < 400 && !said_so.chars().any(char::is_control),
            "{said_so:?}"
        );
    }
    assert!(FloorCamera::load(&std::env::temp_dir()).is_err());
    assert!(FloorCamera::load(&testdata("no such file")).is_err());
}

#[test]
fn camera_info_is_read_as_ros_writes_it() {
    let info = CameraInfo::load(&testdata("calibration/floor-cloth.yaml")).unwrap();
    assert_eq!(info.image_size, [960, 640]);
    assert!(
        matches!(info.lens.distortion(), Distortion::Equidistant([k1, ..]) if (k1 + 0.043_735_601_598_704_08).abs() < 1e-15)
    );
    let info = CameraInfo::load(&testdata("calibration/chessboard.yaml")).unwrap();
    assert!(matches!(info.lens.distortion(), Distortion::PlumbBob(k) if k[4] > 0.238));
}

#[test]
fn bad_camera_info_is_refused_in_one_line_and_at_once() {
    let good = std::fs::read_to_string(testdata("calibration/chessboard.yaml")).unwrap();
    assert!(good.contains("plumb_bob"));
    let cases: Vec<(String, &str)> = vec![
        (String::new(), "image_width"),
        ("a: [".into(), "YAML"),
        (good.replace("plumb_bob", "thin_prism"), "distortion_model"),
        (
            good.replace("image_width: 640", "image_width: 0"),
            "image_width",
        ),
        (
            good.replace("image_height: 480", "image_height: -480"),
            "line",
        ),
        (good.replace("535.", ".nan, 535."), "line"),
        (good.replace("camera_matrix", "camera_mat"), "camera_matrix"),
        (good.replace("-0.26", ".nan #"), "line"),
        (
            good.replace("rectification_matrix", "camera_matrix"),
            "line",
        ),
        (
            format!("x: {}{}", "[".repeat(30_000), "]".repeat(30_000)),
            "line",
        ),
        (format!("x: [{}]", "1,".repeat(30_000)), "line"),
        ("a: &a [1]\nb: *a\n".into(), "line"),
        ("x".repeat(70_000), "bytes"),
    ];
    for (text, said) in cases {
        let file = Scratch::new("bad.yaml", text.as_bytes());
        let said_so = CameraInfo::load(&file.0).unwrap_err().to_string();
        assert!(
            said_so.contains(said) && said_so.contains("bad.yaml"),
            "{said}: {said_so}"
        );
        assert!(
            said_so.len() < 500 && !said_so.chars().any(char::is_control),
            "{said_so:?}"
        );
    }
}

#[test]
fn pairs_are_read_and_wrong_lines_are_named() {
    let pairs =
        read_pairs("\u{feff}u, v, x, y\r\n1,2,3,4\r\n\r\n-1.5e1,0,0.25,-7\n".as_bytes()).unwrap();
    assert_eq!(pairs.len(), 2);
    assert_eq!(pairs[1].pixel, PixelPoint::new(-15.0, 0.0));
    for (text, said) in [
        ("", "header"),
        ("u,v,x\n1,2,3\n", "header"),
        ("1,2,3,4\n", "header"),
        ("u,v,x,y\n1,2,3\n", "line 2: expected 4 values, found 3"),
        ("u,v,x,y\n1,2,3,4\n1,2,3,nan\n", "line 3, y"),
        ("u,v,x,y\ninf,2,3,4\n", "line 2, u"),
        ("u,v,x,y\n1,2,,4\n", "line 2, x"),
    ] {
        let error = read_pairs(text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains(said), "{said}: {error}");
    }
    assert!(read_pairs(&b"u,v,x,y\n\xff,1,2,3\n"[..]).is_err());
    assert!(
        read_pairs(
            "u,v,x,y\n"
                .chars()
                .chain("\n".repeat(100_000).chars())
                .collect::<String>()
                .as_bytes()
        )
        .is_err()
    );
    assert!(read_pairs("9".repeat(1_000_000).as_bytes()).is_err());
}

proptest! {
    #[test]
    fn no_text_makes_the_parsers_panic(text in "\\PC{0,200}", cut in 0..600_usize) {
        let _ = read_pairs(text.as_bytes());
        let good = std::fs::read_to_string(testdata("calibration/chessboard.yaml")).unwrap();
        let at = good.char_indices().map(|(i, _)| i).take(cut + 1).last().unwrap_or(0);
        let file = Scratch::new("cut.yaml", format!("{}{text}{}", &good[..at], &good[at..]).as_bytes());
        let _ = CameraInfo::load(&file.0);
        let _ = FloorCamera::load(&file.0);
    }
}
