//! `mobot floorplan` on real maps, and on what is none.

use crate::arguments;
use crate::run::{mobot, testdata};

#[test]
fn a_real_map_gives_a_plan_that_locate_reads() {
    let folder = tempfile::tempdir().unwrap();
    let plan = folder.path().join("plan.geojson");
    let map = testdata("maps/nav2/depot.yaml");
    let run = mobot(arguments!["floorplan", &map, "-o", &plan, "--json"]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let answer = run.json();
    let text = std::fs::read_to_string(&plan).unwrap();
    let read = monocal::FloorPlan::from_geojson(&text).unwrap();
    assert_eq!(answer["walls"], read.walls.len());
    assert_eq!(answer["door_corners"], read.door_corners.len());
    assert!(read.walls.len() > 10);
}

#[test]
fn doorways_are_told_with_confidence_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, picture) = (
        folder.path().join("plan.geojson"),
        folder.path().join("plan.png"),
    );
    let map = testdata("maps/utexas_gdc/real-3/3.yaml");
    let run = mobot(arguments![
        "floorplan",
        &map,
        "-o",
        &plan,
        "--picture",
        &picture,
        "--json"
    ]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let answer = run.json();
    let doorways = answer["doorways"].as_array().unwrap();
    let kept = doorways.iter().filter(|d| d["in_plan"] == true);
    let corners = kept.map(|d| 2 * d["faces"].as_array().unwrap().len());
    assert_eq!(answer["door_corners"], corners.sum::<usize>());
    for doorway in doorways {
        let width = doorway["width_m"].as_f64().unwrap();
        assert!((0.599..1.401).contains(&width), "{doorway}");
        let likely = doorway["confidence"].as_f64().unwrap() >= 0.6;
        assert_eq!(doorway["in_plan"], likely, "{doorway}");
    }
    let drawn = image::open(&picture).unwrap().to_rgb8();
    let red = drawn.pixels().filter(|p| p.0 == [220, 0, 90]).count();
    assert!(red > 500, "{red} pixels of doorways");
    for bad in ["0,1", "2,1", "1"] {
        let run = mobot(arguments!["floorplan", &map, "-o", &plan, "--doors", bad]);
        assert_eq!(run.status, 2, "{bad}");
    }
}

#[test]
fn a_map_without_walls_is_the_answer_no() {
    let folder = tempfile::tempdir().unwrap();
    let (map, plan) = (
        folder.path().join("map.yaml"),
        folder.path().join("plan.geojson"),
    );
    std::fs::write(&map, "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n").unwrap();
    let pixels: Vec<u8> = b"P5 40 40 255\n"
        .iter()
        .copied()
        .chain([254; 1600])
        .collect();
    std::fs::write(folder.path().join("map.pgm"), pixels).unwrap();
    let run = mobot(arguments!["floorplan", &map, "-o", &plan, "--json"]);
    assert_eq!(run.status, 1, "{}", run.stderr);
    assert_eq!(run.json()["walls"], 0);
    assert!(!plan.exists());
}

#[test]
fn what_is_no_map_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let plan = folder.path().join("plan.geojson");
    for map in [
        folder.path().join("absent.yaml"),
        testdata("frames/vgg-000.png"),
    ] {
        let run = mobot(arguments!["floorplan", &map, "-o", &plan]);
        assert_eq!(run.status, 2, "{}", run.stdout);
        assert_eq!(run.stderr.trim_end().lines().count(), 1, "{}", run.stderr);
        let name = map.file_name().unwrap().to_string_lossy().into_owned();
        assert!(run.stderr.contains(&name), "{}", run.stderr);
        assert!(!plan.exists());
    }
}
