//! `mobot locate` on frames of the simulated camera, whose truth is known, with and without a lens.

use std::path::{Path, PathBuf};

use mobot_cli::nav::{Eye, Thresholds, calibrated};
use mobot_hw::sim::{CameraModel, Distortion, Look, Renderer, World};
use monocal::{FixStatus, FloorCamera, FloorPlan, LocateParams, PoseFix, Prior, locate};
use nalgebra::{Matrix3, Vector3};
use occgrid::Pose2;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde_json::Value;
use tempfile::TempDir;

use crate::arguments;
use crate::nav_worlds::Site;
use crate::run::{Run, mobot};

/// A webcam's barrel: its corners are 62 px nearer to the middle than a pinhole's.
const BARREL: Distortion = Distortion::PlumbBob {
    coefficients: [-0.32, 0.12, 0.0008, -0.0006, 0.0],
};

fn camera(distortion: Distortion) -> CameraModel {
    CameraModel {
        distortion,
        ..CameraModel::vga()
    }
}

/// A frame, the camera and the plan as files, and where the frame was taken.
struct Case {
    folder: TempDir,
    truth: Pose2,
}

impl Case {
    fn new(world: &World, plan: &FloorPlan, model: CameraModel, truth: Pose2) -> Self {
        let folder = tempfile::tempdir().expect("by construction");
        let mut renderer = Renderer::new(model, Look::default()).expect("by construction");
        let frame = renderer.render(world, truth, 0.0, 5);
        frame
            .save(folder.path().join("frame.png"))
            .expect("by construction");
        let camera = calibrated(&model).expect("by construction").to_json();
        std::fs::write(folder.path().join("camera.json"), camera).expect("by construction");
        std::fs::write(folder.path().join("plan.geojson"), plan.to_geojson())
            .expect("by construction");
        Self { folder, truth }
    }

    /// Down the office's corridor.
    fn office(model: CameraModel) -> Self {
        let site = Site::without_people("office");
        Self::new(&site.world, &site.plan, model, Pose2::new(1.5, 0.1, 0.03))
    }

    /// Two walls and an end 14 m ahead, no doors.
    fn bare_corridor() -> Self {
        let wall = |from: [f64; 2], to: [f64; 2]| {
            format!("[[walls]]\nfrom = {from:?}\nto = {to:?}\nskirting = 0.0\n")
        };
        let text = [
            "name = \"bare\"\n[[lamps]]\nat = [2.0, 0.0]\n[[lamps]]\nat = [7.0, 0.0]\n".to_owned(),
            wall([-3.0, 1.0], [20.0, 1.0]),
            wall([-3.0, -1.0], [20.0, -1.0]),
        ];
        let world = World::from_toml(&text.concat()).expect("by construction");
        let plan = FloorPlan {
            walls: world.floor_outline(),
            door_corners: vec![],
        };
        let truth = Pose2::new(2.0, -0.15, 0.05);
        Self::new(&world, &plan, CameraModel::vga(), truth)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// With a prior that is so far off the truth.
    fn locate(&self, off: [f64; 3], more: &[&Path]) -> Run {
        let Pose2 { x, y, theta } = self.truth;
        let prior = format!("{},{},{}", x + off[0], y + off[1], theta + off[2]);
        let mut arguments = arguments![
            "locate",
            self.file("frame.png"),
            "--camera",
            self.file("camera.json"),
            "--plan",
            self.file("plan.geojson"),
            "--prior",
            prior,
            "--json"
        ]
        .to_vec();
        arguments.extend(more.iter().map(Into::into));
        mobot(arguments)
    }

    /// The errors of x, y and theta, each over its sigma.
    fn sigmas_off(&self, answer: &Value) -> [f64; 3] {
        let truth = [self.truth.x, self.truth.y, self.truth.theta];
        let error = |k: usize| answer["pose"][k].as_f64().expect("by construction") - truth[k];
        let variance = |k: usize| {
            answer["covariance"][k][k]
                .as_f64()
                .expect("by construction")
        };
        [0, 1, 2].map(|k| error(k).abs() / variance(k).sqrt())
    }
}

fn observed(answer: &Value) -> [bool; 3] {
    ["x", "y", "theta"].map(|axis| answer["observed"][axis].as_bool().expect("by construction"))
}

#[test]
fn a_corridor_with_doors_gives_the_whole_pose() {
    for distortion in [Distortion::None, BARREL] {
        let case = Case::office(camera(distortion));
        let run = case.locate([0.08, -0.07, 0.03], &[]);
        assert_eq!(run.status, 0, "{}{}", run.stdout, run.stderr);
        let answer = run.json();
        assert_eq!(answer["status"], "ok", "{answer}");
        assert_eq!(observed(&answer), [true; 3]);
        let off = case.sigmas_off(&answer);
        assert!(off.iter().all(|off| *off < 3.0), "{off:?}: {answer}");
        for k in 0..3 {
            let sigma = answer["covariance"][k][k].as_f64().unwrap().sqrt();
            assert!(sigma > 0.0 && sigma < 0.02, "{answer}");
        }
        let matched = answer["matched"].as_array().unwrap();
        assert!(matched.len() >= 3, "{answer}");
        for one in matched {
            let pixel = [0, 1].map(|k| one["pixel"][k].as_f64().unwrap());
            let inside = (-1.0..641.0).contains(&pixel[0]) && (-1.0..481.0).contains(&pixel[1]);
            assert!(inside, "{one}");
        }
    }
}

#[test]
fn a_bare_corridor_gives_heading_and_lateral_and_says_so() {
    let case = Case::bare_corridor();
    let run = case.locate([0.1, 0.08, -0.03], &[]);
    assert_eq!(run.status, 0, "{}{}", run.stdout, run.stderr);
    let answer = run.json();
    assert_eq!(answer["status"], "partial", "{answer}");
    assert_eq!(observed(&answer), [false, true, true]);
    let off = case.sigmas_off(&answer);
    assert!(off.iter().all(|off| *off < 3.0), "{off:?}: {answer}");
    let along = answer["pose"][0].as_f64().unwrap();
    assert!((along - 2.1).abs() < 0.02, "the prior stays: {answer}");
}

#[test]
fn a_prior_in_the_wrong_place_is_refused() {
    let case = Case::office(CameraModel::vga());
    for off in [[0.0, 0.0, 0.9], [4.0, 3.4, 0.4]] {
        let run = case.locate(off, &[]);
        let answer = run.json();
        let refused = ["lost", "no_match", "ambiguous"];
        assert!(refused.iter().any(|s| answer["status"] == *s), "{answer}");
        assert_eq!(run.status, 1, "{answer}");
    }
}

#[test]
fn the_overlay_is_a_picture_with_something_drawn_on_it() {
    let case = Case::office(camera(BARREL));
    let frame = image::open(case.file("frame.png")).unwrap().to_rgb8();
    let png = case.file("seen.png");
    let svg = case.file("seen.svg");
    for path in [&png, &svg] {
        let run = case.locate([0.05, 0.05, 0.02], &[Path::new("--overlay"), path]);
        assert_eq!(run.status, 0, "{}", run.stderr);
    }
    let drawn = image::open(&png).unwrap().to_rgb8();
    let zoom = drawn.width() / frame.width();
    assert!(zoom >= 1 && drawn.width() == zoom * frame.width());
    assert!(drawn.height() >= zoom * frame.height());
    let coloured = drawn.pixels().filter(|p| p.0[0] != p.0[1]).count();
    assert!(coloured > 10_000, "{coloured} pixels in colour");
    let text = std::fs::read_to_string(&svg).unwrap();
    assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"));
    assert!(text.contains("floor edges") && text.matches("<path").count() > 20);
}

#[test]
fn what_cannot_be_used_is_refused_in_one_line() {
    let case = Case::office(CameraModel::vga());
    let write = |name: &str, text: &str| {
        let path = case.file(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let small = case.file("small.png");
    image::GrayImage::new(64, 48).save(&small).unwrap();
    let camera = std::fs::read_to_string(case.file("camera.json")).unwrap();
    let unsized_camera = write(
        "unsized.json",
        r#"{"pixel_to_floor": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}"#,
    );
    let cut = write("cut.json", &camera[..camera.len() / 2]);
    let empty = write(
        "empty.geojson",
        r#"{"type": "FeatureCollection", "features": []}"#,
    );
    let words = write("words.png", "not a picture");
    let (frame, good, plan) = (
        case.file("frame.png"),
        case.file("camera.json"),
        case.file("plan.geojson"),
    );
    let fine = "1.5,0,0";
    type Asked<'a> = (
        &'a Path,
        &'a Path,
        &'a Path,
        &'a str,
        &'a [&'a str],
        &'a str,
    );
    let cases: [Asked<'_>; 11] = [
        (&words, &good, &plan, fine, &[], "words.png"),
        (&small, &good, &plan, fine, &[], "640 x 480"),
        (&case.file("no.png"), &good, &plan, fine, &[], "no.png"),
        (&frame, &cut, &plan, fine, &[], "cut.json"),
        (&frame, &unsized_camera, &plan, fine, &[], "unsized.json"),
        (&frame, &good, &empty, fine, &[], "empty.geojson"),
        (&frame, &good, &words, fine, &[], "words.png"),
        (&frame, &good, &plan, "1,2", &[], "1,2"),
        (&frame, &good, &plan, "1,nan,2", &[], "nan"),
        (
            &frame,
            &good,
            &plan,
            fine,
            &["--prior-sigma", "0,1,1"],
            "--prior-sigma",
        ),
        (
            &frame,
            &good,
            &plan,
            fine,
            &["--overlay", "seen.jpg"],
            ".svg or .png",
        ),
    ];
    for (image, camera, plan, prior, more, word) in cases {
        let mut arguments = arguments![
            "locate", image, "--camera", camera, "--plan", plan, "--prior", prior
        ]
        .to_vec();
        arguments.extend(more.iter().map(Into::into));
        let run = mobot(arguments);
        assert_eq!(run.status, 2, "{word}: {}{}", run.stdout, run.stderr);
        assert!(run.stderr.contains(word), "{word}: {}", run.stderr);
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
        let lines = run.stderr.trim_end().lines().count();
        assert_eq!(lines, 1, "{}", run.stderr);
    }
}

/// A third of the light: thresholds follow the frame.
#[test]
fn a_dim_frame_is_as_good() {
    let case = Case::office(CameraModel::vga());
    let path = case.file("frame.png");
    let mut frame = image::open(&path).unwrap().to_luma8();
    for pixel in frame.iter_mut() {
        *pixel /= 3;
    }
    frame.save(&path).unwrap();
    let run = case.locate([0.08, -0.07, 0.03], &[]);
    let answer = run.json();
    assert_eq!(answer["status"], "ok", "{answer}");
    let off = case.sigmas_off(&answer);
    assert!(off.iter().all(|off| *off < 3.0), "{off:?}: {answer}");
}

/// The fix of a frame.
fn fixed(
    eye: &mut Eye,
    renderer: &mut Renderer,
    site: &Site,
    truth: Pose2,
    prior: &Prior,
) -> PoseFix {
    let frame = renderer.render(&site.world, truth, 0.0, 9);
    eye.look(&frame);
    locate(
        eye.seen(),
        &site.plan,
        eye.camera(),
        prior,
        &LocateParams::default(),
    )
}

/// Frames from the same places through a pinhole, a barrel, a pincushion and a fisheye. A lens is undone before
/// features are looked for: fixes are about as many, as near and as honest as the pinhole's.
#[test]
fn a_lens_costs_no_accuracy() {
    let long = std::env::var("MOBOT_LONG").is_ok_and(|v| v == "1");
    let count = if long { 300 } else { 24 };
    let site = Site::without_people("office");
    let lenses = [
        ("pinhole", Distortion::None),
        ("barrel", BARREL),
        (
            "pincushion",
            Distortion::PlumbBob {
                coefficients: [0.12, -0.03, 0.0, 0.0, 0.0],
            },
        ),
        (
            "fisheye",
            Distortion::Fisheye {
                coefficients: [-0.02, 0.004, 0.0, 0.0],
            },
        ),
    ];
    for (name, distortion) in lenses {
        let model = camera(distortion);
        let known: FloorCamera = calibrated(&model).expect("marks in sight");
        let mut eye = Eye::new(&known, Thresholds::OfFrame).expect("a mounting");
        let mut renderer = Renderer::new(model, Look::default()).expect("a camera");
        let mut rng = Pcg64::seed_from_u64(71);
        let (mut errors, mut sum_nees) = (Vec::new(), 0.0);
        for _ in 0..count {
            let truth = Pose2::new(
                rng.random_range(0.5..11.0),
                rng.random_range(-0.3..0.3),
                rng.random_range(-0.25..0.25),
            );
            let off = [0.1, 0.1, 0.04].map(|s: f64| s * rng.random_range(-1.0..1.0));
            let prior = Prior {
                pose: Pose2::new(truth.x + off[0], truth.y + off[1], truth.theta + off[2]),
                covariance: [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.0016]],
            };
            let fix = fixed(&mut eye, &mut renderer, &site, truth, &prior);
            if fix.status != FixStatus::Ok {
                continue;
            }
            let e = Vector3::new(
                fix.pose.x - truth.x,
                fix.pose.y - truth.y,
                fix.pose.theta - truth.theta,
            );
            let p = Matrix3::from_fn(|r, c| fix.covariance[r][c]);
            errors.push(e.xy().norm());
            sum_nees += e.dot(&(p.try_inverse().expect("a covariance") * e));
        }
        errors.sort_by(f64::total_cmp);
        let fixes = errors.len();
        let mean = errors.iter().sum::<f64>() / fixes as f64;
        let (most, nees) = (errors[fixes * 95 / 100], sum_nees / fixes as f64);
        println!(
            "{name}: {fixes} of {count} fixes, mean {mean:.4} m, 95 % {most:.4} m, max {:.4} m, NEES {nees:.2}",
            errors[fixes - 1]
        );
        assert!(fixes * 2 > count, "{name}: {fixes} of {count}");
        assert!(mean < 0.015 && most < 0.047, "{name}: {mean} {most}");
        assert!(nees < 6.0, "{name}: {nees}");
    }
}
