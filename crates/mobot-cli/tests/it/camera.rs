//! Camera commands on real frames, and on what is no frame.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::arguments;
use crate::run::{Run, mobot, testdata};

/// Points on the floor of a corridor, as `u,v,x,y`.
fn corridor_pairs(folder: &Path) -> PathBuf {
    let table =
        std::fs::read_to_string(testdata("calibration/vgg-corridor.csv")).expect("by construction");
    let rows = table.lines().filter(|line| line.starts_with("bt.000,"));
    let pairs: Vec<String> = rows
        .map(|row| row.split(',').skip(1).take(4).collect::<Vec<_>>().join(","))
        .collect();
    let file = folder.join("pairs.csv");
    std::fs::write(&file, format!("u,v,x,y\n{}\n", pairs.join("\n"))).expect("by construction");
    file
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("a number, not {value}"))
}

#[test]
fn a_real_frame_and_its_pairs_give_a_metric_floor() {
    let folder = tempfile::tempdir().unwrap();
    let pairs = corridor_pairs(folder.path());
    let frame = testdata("frames/vgg-000.png");
    let camera = folder.path().join("camera.json");
    for picture in ["fit.svg", "fit.png"].map(|name| folder.path().join(name)) {
        let run = mobot(arguments![
            "calibrate",
            &pairs,
            "-o",
            &camera,
            "--image",
            &frame,
            "--picture",
            &picture,
            "--json"
        ]);
        assert_eq!(run.status, 0, "{}", run.stderr);
        let answer = run.json();
        assert_eq!(answer["pairs"], 33);
        assert_eq!(answer["outliers"], serde_json::json!([]));
        assert!(
            number(&answer["mean_m"]) < 0.06 && number(&answer["max_m"]) < 0.2,
            "{answer}"
        );
        assert!(number(&answer["held_out"]["mean_m"]) > number(&answer["mean_m"]));
        assert!(number(&answer["held_out"]["max_m"]) < 0.2);
        let focal = number(&answer["camera"]["focal_px"]);
        assert!((480.0..520.0).contains(&focal), "{answer}");
        assert!(
            number(&answer["camera"]["height_m"]) > 7.0
                && number(&answer["camera"]["tilt_rad"]) > 0.1
        );
        assert!(std::fs::metadata(&picture).unwrap().len() > 10_000);
    }
    let saved: Value = serde_json::from_str(&std::fs::read_to_string(&camera).unwrap()).unwrap();
    assert_eq!(saved["image_size"], serde_json::json!([512, 512]));
    assert_eq!(saved["covariance"].as_array().unwrap().len(), 8);

    let run = mobot(arguments!["floor", &camera, "256", "400", "--json"]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let floor = run.json();
    let matrix = |r: usize, c: usize| number(&saved["pixel_to_floor"][r][c]);
    let row = |r: usize| 256.0 * matrix(r, 0) + 400.0 * matrix(r, 1) + matrix(r, 2);
    assert!((number(&floor["x"]) - row(0) / row(2)).abs() < 1e-9);
    assert!((number(&floor["y"]) - row(1) / row(2)).abs() < 1e-9);
    let covariance = |r: usize, c: usize| number(&floor["covariance"][r][c]);
    assert!(covariance(0, 0) > covariance(1, 1));
    assert!(number(&floor["resolution"]["dx"]) > number(&floor["resolution"]["dy"]));
    let sharper = mobot(arguments![
        "floor",
        &camera,
        "256",
        "400",
        "--pixel-sigma",
        "0",
        "--json"
    ]);
    assert!(number(&sharper.json()["covariance"][0][0]) < covariance(0, 0));

    let run = mobot(arguments!["floor", &camera, "256", "100", "--json"]);
    assert_eq!(run.status, 1, "above the horizon");
    assert_eq!(run.json()["x"], Value::Null);

    let above = folder.path().join("above.png");
    let run = mobot(arguments![
        "birdseye",
        &frame,
        "--camera",
        &camera,
        "-o",
        &above,
        "--coarsest",
        "0.3",
        "--json"
    ]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let answer = run.json();
    let drawn = image::open(&above).unwrap();
    assert_eq!(
        (u64::from(drawn.width()), u64::from(drawn.height())),
        (
            answer["width"].as_u64().unwrap(),
            answer["height"].as_u64().unwrap()
        )
    );
    // a floor point is as bright from above as where the camera sees it
    let (x, y) = (number(&floor["x"]), number(&floor["y"]));
    let side = number(&answer["metres_per_pixel"]);
    let column = ((number(&answer["origin"][1]) - y) / side).round() as u32;
    let line = ((number(&answer["origin"][0]) - x) / side).round() as u32;
    let from_above = drawn.to_luma8().get_pixel(column, line).0[0];
    let seen = image::open(&frame)
        .unwrap()
        .to_luma8()
        .get_pixel(256, 400)
        .0[0];
    assert!(from_above.abs_diff(seen) <= 12, "{from_above} {seen}");
}

#[test]
fn a_fisheye_is_undone() {
    let folder = tempfile::tempdir().unwrap();
    let camera = folder.path().join("camera.json");
    let above = folder.path().join("above.png");
    let frame = testdata("frames/floor-cloth.jpg");
    let run = mobot(arguments![
        "calibrate",
        testdata("calibration/floor-cloth.csv"),
        "-o",
        &camera,
        "--lens",
        testdata("calibration/floor-cloth.yaml"),
        "--json"
    ]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert!(number(&run.json()["max_m"]) < 1e-6);
    let run = mobot(arguments![
        "birdseye", &frame, "--camera", &camera, "-o", &above
    ]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    // the cloth's four dark discs on white are as far apart ahead as across
    let run = mobot(arguments![
        "birdseye",
        &frame,
        "--camera",
        &camera,
        "-o",
        &above,
        "--metres-per-pixel",
        "0.02",
        "--json"
    ]);
    let origin = [0, 1].map(|k| number(&run.json()["origin"][k]));
    let picture = image::open(&above).unwrap().to_luma8();
    // over a square of 10 cm
    let at = |x: f64, y: f64| {
        let (column, row) = ((origin[1] - y) / 0.02, (origin[0] - x) / 0.02);
        let pixels = (0..25).map(|k| {
            [
                column.round() as u32 + k % 5 - 2,
                row.round() as u32 + k / 5 - 2,
            ]
        });
        pixels
            .map(|[c, r]| f64::from(picture.get_pixel(c, r).0[0]))
            .sum::<f64>()
            / 25.0
    };
    for x in [2.55, 1.78] {
        for y in [0.55, -0.2] {
            assert!(at(x, y) < 100.0, "disc at {x}, {y}: {}", at(x, y));
            assert!(
                at(x, 0.18) > 160.0,
                "white between discs at {x}: {}",
                at(x, 0.18)
            );
            assert!(
                at(2.17, y) > 160.0,
                "white between discs at {y}: {}",
                at(2.17, y)
            );
        }
    }
}

#[test]
fn wrong_pairs_are_named_and_the_noise_can_be_the_floor_s() {
    let folder = tempfile::tempdir().unwrap();
    let pairs = corridor_pairs(folder.path());
    let text = std::fs::read_to_string(&pairs).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    // pair 4 is in line 6: a slip of 40 px
    let mut values: Vec<f64> = lines[5].split(',').map(|v| v.parse().unwrap()).collect();
    values[0] += 40.0;
    lines[5] = values
        .iter()
        .map(f64::to_string)
        .collect::<Vec<_>>()
        .join(",");
    std::fs::write(&pairs, lines.join("\n")).unwrap();
    let camera = folder.path().join("camera.json");
    for noise in ["pixel", "floor", "both"] {
        let run = mobot(arguments![
            "calibrate",
            &pairs,
            "-o",
            &camera,
            "--noise",
            noise,
            "--json"
        ]);
        assert_eq!(run.status, 0, "{}", run.stderr);
        let outliers: Vec<u64> = run.json()["outliers"]
            .as_array()
            .unwrap()
            .iter()
            .map(|o| o.as_u64().unwrap())
            .collect();
        assert!(outliers.contains(&4), "{noise}: {outliers:?}");
        assert_eq!(run.json()["camera"], Value::Null, "no size, no centre");
    }
}

#[test]
fn a_sheet_to_print_is_one_svg() {
    let folder = tempfile::tempdir().unwrap();
    let sheet = folder.path().join("sheet.svg");
    let run = mobot(arguments!["calibrate", "--target-sheet", &sheet]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let text = std::fs::read_to_string(&sheet).unwrap();
    assert!(
        text.contains("width=\"210mm\"") && text.contains("100 mm") && text.ends_with("</svg>\n")
    );
}

/// Exit status 2, one line with these words, no panic, nothing written.
fn refused(run: &Run, words: &[&str], never: &Path) {
    assert_eq!(run.status, 2, "{}{}", run.stdout, run.stderr);
    assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
    for word in words {
        assert!(run.stderr.contains(word), "{word}: {}", run.stderr);
    }
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    assert!(!never.exists(), "{} was written", never.display());
}

#[test]
fn pairs_that_cannot_be_used_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let good = std::fs::read_to_string(corridor_pairs(folder.path())).unwrap();
    let camera = folder.path().join("camera.json");
    let file = folder.path().join("bad.csv");
    let line = good.lines().nth(3).unwrap();
    let cases = [
        (String::new(), "header"),
        (good.replace("u,v,x,y", "u,v,x"), "header"),
        (good.replace(line, "1,2,3"), "line 4"),
        (good.replace(line, "nan,2,3,4"), "line 4"),
        (format!("{good}{line}\n"), "same"),
        (
            good.lines().take(4).collect::<Vec<_>>().join("\n"),
            "at least 4",
        ),
        (
            "u,v,x,y\n0,0,1,1\n9,1,2,2\n20,5,3,3\n30,70,4,4\n".into(),
            "line",
        ),
        ("\u{0}\u{1}".into(), "header"),
    ];
    for (text, word) in cases {
        std::fs::write(&file, text).unwrap();
        refused(
            &mobot(arguments!["calibrate", &file, "-o", &camera]),
            &["bad.csv", word],
            &camera,
        );
    }
    let pairs = corridor_pairs(folder.path());
    refused(
        &mobot(arguments!["calibrate", folder.path(), "-o", &camera]),
        &["expected a file"],
        &camera,
    );
    refused(
        &mobot(arguments!["calibrate", &pairs]),
        &["--output"],
        &camera,
    );
    refused(
        &mobot(arguments![
            "calibrate",
            &pairs,
            "-o",
            &camera,
            "--image-size",
            "0x5"
        ]),
        &["0x5"],
        &camera,
    );
    refused(
        &mobot(arguments![
            "calibrate",
            &pairs,
            "-o",
            &camera,
            "--pixel-sigma",
            "-1"
        ]),
        &["--pixel-sigma"],
        &camera,
    );
    refused(
        &mobot(arguments![
            "calibrate",
            &pairs,
            "-o",
            &camera,
            "--image-size",
            "640x480",
            "--image",
            testdata("frames/vgg-000.png")
        ]),
        &["640 x 480", "512 x 512"],
        &camera,
    );
    refused(
        &mobot(arguments![
            "calibrate",
            &pairs,
            "-o",
            &camera,
            "--picture",
            "fit.jpg"
        ]),
        &[".svg or .png"],
        &camera,
    );
    refused(
        &mobot(arguments![
            "calibrate",
            &pairs,
            "-o",
            &camera,
            "--lens",
            &pairs
        ]),
        &["pairs.csv"],
        &camera,
    );
}

#[test]
fn frames_that_cannot_be_used_are_refused_in_bounded_memory() {
    let folder = tempfile::tempdir().unwrap();
    let pairs = corridor_pairs(folder.path());
    let camera = folder.path().join("camera.json");
    assert_eq!(
        mobot(arguments!["calibrate", &pairs, "-o", &camera]).status,
        0
    );
    let above = folder.path().join("above.png");
    let save = |name: &str, image: image::DynamicImage| {
        let path = folder.path().join(name);
        image.save(&path).unwrap();
        path
    };
    let bytes = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    let good = std::fs::read(testdata("frames/vgg-000.png")).unwrap();
    let mut wide = good.clone();
    // the width of the header says 20000, and so does the height; its checksum is made right again
    wide[16..24].copy_from_slice(&[0, 0, 0x4e, 0x20, 0, 0, 0x4e, 0x20]);
    let sum = crc(&wide[12..29]);
    wide[29..33].copy_from_slice(&sum.to_be_bytes());
    let cases = [
        (bytes("empty.png", b""), "whole"),
        (bytes("words.png", b"not a picture"), "PNG"),
        (bytes("none.pgm", b"P5\n0 0\n255\n"), "found"),
        (
            bytes("huge.pgm", b"P5\n1000000000 1000000000\n255\n"),
            "found",
        ),
        (bytes("large.png", &wide), "20000 x 20000"),
        (bytes("cut.png", &good[..good.len() / 2]), "whole"),
        (
            save("one.png", image::DynamicImage::new_luma8(1, 1)),
            "1 x 1",
        ),
        (
            save("deep.png", image::DynamicImage::new_luma16(64, 64)),
            "L16",
        ),
        (
            save("alpha.png", image::DynamicImage::new_rgba8(64, 64)),
            "alpha",
        ),
        (folder.path().to_path_buf(), "expected a file"),
        (folder.path().join("absent.png"), "absent.png"),
    ];
    for (frame, word) in cases {
        let name = frame.file_name().unwrap().to_string_lossy().into_owned();
        let run = mobot(arguments![
            "birdseye", &frame, "--camera", &camera, "-o", &above
        ]);
        refused(&run, &[name.as_str(), word], &above);
        let other = folder.path().join("other.json");
        let run = mobot(arguments![
            "calibrate",
            &pairs,
            "-o",
            &other,
            "--image",
            &frame
        ]);
        refused(&run, &[word], &other);
    }
    let frame = testdata("frames/vgg-000.png");
    refused(
        &mobot(arguments![
            "birdseye", &frame, "--camera", &pairs, "-o", &above
        ]),
        &["pairs.csv"],
        &above,
    );
    refused(
        &mobot(arguments![
            "birdseye",
            &frame,
            "--camera",
            &camera,
            "-o",
            "above.jpg"
        ]),
        &[".png"],
        &above,
    );
    for (flag, value) in [
        ("--metres-per-pixel", "0"),
        ("--metres-per-pixel", "1e-9"),
        ("--coarsest", "nan"),
    ] {
        refused(
            &mobot(arguments![
                "birdseye", &frame, "--camera", &camera, "-o", &above, flag, value
            ]),
            &[flag],
            &above,
        );
    }
    refused(
        &mobot(arguments!["floor", &camera, "nan", "1"]),
        &["U"],
        &above,
    );
}

/// The checksum of PNG chunks.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |s, _| {
            if s & 1 == 1 {
                (s >> 1) ^ 0xedb8_8320
            } else {
                s >> 1
            }
        })
    })
}

#[test]
fn a_frame_of_another_size_is_not_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let pairs = corridor_pairs(folder.path());
    let camera = folder.path().join("camera.json");
    let above = folder.path().join("above.png");
    assert_eq!(
        mobot(arguments![
            "calibrate",
            &pairs,
            "-o",
            &camera,
            "--image-size",
            "512x512"
        ])
        .status,
        0
    );
    let run = mobot(arguments![
        "birdseye",
        testdata("frames/floor-cloth.jpg"),
        "--camera",
        &camera,
        "-o",
        &above
    ]);
    refused(&run, &["512 x 512", "960 x 640"], &above);
}
