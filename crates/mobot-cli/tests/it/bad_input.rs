//! Input that cannot be used: exit status 2, one clear line, nothing written.

use crate::arguments;
use crate::run::{Run, mobot, testdata};

/// Status 2, one line that holds all of these words, nothing on stdout.
fn refused(run: &Run, words: &[&str]) {
    assert_eq!(run.status, 2, "{}{}", run.stdout, run.stderr);
    assert_eq!(run.stderr.lines().count(), 1, "one line: {}", run.stderr);
    assert_eq!(run.stdout, "");
    for word in words {
        assert!(run.stderr.contains(word), "{word:?} not in {}", run.stderr);
    }
}

/// A map's YAML with this image and resolution.
fn yaml(image: &str, resolution: &str) -> String {
    format!(
        "image: {image}\nresolution: {resolution}\norigin: [0, 0, 0]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
}

#[test]
fn maps_that_cannot_be_used_are_named_with_place_and_expectation() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("g.geojson");
    let graph = |yaml: &str| {
        let map = folder.path().join("map.yaml");
        std::fs::write(&map, yaml).unwrap();
        mobot(arguments!["graph", &map, "--radius", "0.2", "-o", &out])
    };
    let missing = folder.path().join("none.yaml");
    refused(
        &mobot(arguments!["graph", missing, "--radius", "0.2", "-o", &out]),
        &["none.yaml"],
    );
    refused(&graph("image: [\n"), &["map.yaml"]);
    refused(&graph(&yaml("m.pgm", ".nan")), &["map.yaml", "resolution"]);
    refused(
        &graph(&yaml("/etc/passwd", "0.05")),
        &["map.yaml", "folder"],
    );
    std::fs::write(folder.path().join("m.pgm"), "P5 1000000 1000000 255\n").unwrap();
    refused(&graph(&yaml("m.pgm", "0.05")), &["m.pgm"]);
    assert!(!out.exists(), "nothing is half-written");
}

#[test]
fn numbers_out_of_range_are_refused_before_any_work() {
    let map = testdata("maps/nav2/TenByTen/TenByTen.yaml");
    for radius in ["-1", "nan", "inf"] {
        let run = mobot(arguments![
            "graph",
            &map,
            format!("--radius={radius}"),
            "-o",
            "/none/g"
        ]);
        refused(&run, &["--radius", "0 m or more"]);
    }
    let run = mobot(arguments![
        "graph",
        &map,
        "--radius",
        "1",
        "-o",
        "/none/g",
        "--picture",
        "p.gif"
    ]);
    refused(&run, &["p.gif", ".svg", ".png"]);
}

#[test]
fn tables_are_refused_with_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let map = testdata("maps/nav2/TenByTen/TenByTen.yaml");
    let file = folder.path().join("t.csv");
    let plan = |text: &str| {
        std::fs::write(&file, text).unwrap();
        mobot(arguments![
            "plan",
            &map,
            "--radius",
            "1",
            "--queries",
            &file
        ])
    };
    refused(&plan("x,y\n"), &["t.csv", "line 1", "x0,y0,x1,y1"]);
    refused(
        &plan("x0,y0,x1,y1\n1,2,3\n"),
        &["t.csv", "line 2", "4 fields", "found 3"],
    );
    refused(
        &plan("x0,y0,x1,y1\n1,2,3,4\n1,2,NaN,4\n"),
        &["t.csv", "line 3", "x1", "NaN"],
    );

    let sensor = testdata("sonar/udacity-robond/sensor.toml");
    let out = folder.path().join("m.yaml");
    let log = |text: &str, sensor: &std::path::Path| {
        std::fs::write(&file, text).unwrap();
        mobot(arguments!["map", &file, "--sensor", sensor, "-o", &out])
    };
    let header = "stamp,x,y,theta,bearing,kind,range\n";
    refused(&log("hello\n", &sensor), &["t.csv", "line 1"]);
    refused(
        &log(&format!("{header}0,0,0,0,0,ping,1\n"), &sensor),
        &["t.csv", "line 2", "ping"],
    );
    let bad_sensor = folder.path().join("s.toml");
    std::fs::write(&bad_sensor, "beam_width = 0.3\nsigma = -1\n").unwrap();
    refused(&log(header, &bad_sensor), &["s.toml", "sigma"]);
    std::fs::write(&bad_sensor, "beam_width = 0.3\nbeem = 1\n").unwrap();
    refused(&log(header, &bad_sensor), &["s.toml", "line 2", "beem"]);
    assert!(!out.exists());
}

#[test]
fn graphs_that_cannot_be_used_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let map = testdata("maps/nav2/TenByTen/TenByTen.yaml");
    let file = folder.path().join("g.geojson");
    for text in [
        "",
        "{}",
        "[1,2]",
        "{\"type\":\"FeatureCollection\",\"features\":[{}]}",
    ] {
        std::fs::write(&file, text).unwrap();
        refused(
            &mobot(arguments!["check", &file, &map, "--radius", "0.1"]),
            &["g.geojson"],
        );
    }
}

#[test]
fn names_cannot_reach_the_terminal_as_control_characters() {
    let run = mobot(arguments![
        "graph",
        "no\u{1b}[31mmap.yaml",
        "--radius",
        "1",
        "-o",
        "g"
    ]);
    assert_eq!(run.status, 2);
    assert!(!run.stderr.contains('\u{1b}'), "{:?}", run.stderr);
}

#[test]
fn usage_errors_are_one_line_too() {
    refused(&mobot(["graph", "m.yaml"]), &["--radius", "--help"]);
    refused(&mobot(["fly"]), &["fly"]);
    refused(
        &mobot([
            "plan", "m.yaml", "--radius", "1", "--from", "1,x", "--to", "0,0",
        ]),
        &["1,x"],
    );
}
