//! Every command does its job on real input and answers with the keys it promises.

use std::path::Path;

use serde_json::Value;

use crate::arguments;
use crate::run::{mobot, testdata};

/// The Intel Research Lab, Seattle: 0.1 m cells.
fn intel() -> std::path::PathBuf {
    testdata("maps/utexas_gdc/intel.yaml")
}

fn keys(value: &Value, wanted: &[&str]) {
    for key in wanted {
        assert!(value.get(key).is_some(), "{key} missing in {value}");
    }
}

#[test]
fn a_graph_passes_the_independent_check_and_a_moved_edge_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let graph = folder.path().join("g.geojson");
    let picture = folder.path().join("g.svg");
    let run = mobot(arguments![
        "graph",
        intel(),
        "--radius",
        "0.2",
        "-o",
        &graph,
        "--picture",
        &picture,
        "--json"
    ]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let answer = run.json();
    keys(
        &answer,
        &[
            "nodes",
            "arcs",
            "components",
            "cycles",
            "min_clearance_m",
            "elapsed_ms",
        ],
    );
    assert!(
        answer["min_clearance_m"].as_f64().unwrap() >= 0.2 - 1e-9,
        "{answer}"
    );
    assert!(
        std::fs::read_to_string(&picture)
            .unwrap()
            .contains("<polyline")
    );

    let run = mobot(arguments![
        "check",
        &graph,
        intel(),
        "--radius",
        "0.2",
        "--json"
    ]);
    assert_eq!(run.status, 0, "{}", run.stdout);
    let report = run.json();
    keys(
        &report,
        &["edges", "violations", "min_clearance_m", "worst_edge"],
    );
    assert_eq!(
        report["edges"].as_u64(),
        answer["arcs"].as_u64().map(|arcs| 2 * arcs)
    );

    let text = std::fs::read_to_string(&graph).unwrap();
    let mut moved: Value = serde_json::from_str(&text).unwrap();
    let edge = moved["features"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .find(|f| f["geometry"]["type"] != "Point")
        .unwrap();
    let id = edge["properties"]["id"].clone();
    let line = &mut edge["geometry"]["coordinates"];
    let line = if line[0][0].is_array() {
        &mut line[0]
    } else {
        line
    };
    let middle = line.as_array().unwrap().len() / 2;
    line[middle] = serde_json::json!([-5.0, -5.0]);
    let planted = folder.path().join("planted.geojson");
    std::fs::write(&planted, moved.to_string()).unwrap();
    let run = mobot(arguments![
        "check",
        &planted,
        intel(),
        "--radius",
        "0.2",
        "--json"
    ]);
    assert_eq!(run.status, 1);
    assert_eq!(run.json()["violations"][0]["id"], id);
}

#[test]
fn the_papers_chain_counts_its_crossings_beside_ours() {
    let folder = tempfile::tempdir().unwrap();
    let graph = folder.path().join("paper.geojson");
    let run = mobot(arguments![
        "graph",
        intel(),
        "--radius",
        "0.2",
        "-o",
        &graph,
        "--paper",
        "--json"
    ]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let answer = run.json();
    assert!(answer["crossings"].as_u64().unwrap() > 0, "{answer}");
    assert_eq!(answer["ours"]["crossings"], 0);
}

#[test]
fn a_route_starts_and_ends_where_it_was_asked_to() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("route.png");
    let floor = testdata("maps/utexas_gdc/real-3/3.yaml");
    let run = mobot(arguments![
        "plan",
        &floor,
        "--radius",
        "0.25",
        "--from",
        "-54,-10",
        "--to",
        "-24,32",
        "--picture",
        &picture,
        "--json"
    ]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let answer = run.json();
    assert_eq!(answer["status"], "ok");
    let points = answer["points"].as_array().unwrap();
    assert_eq!(points[0], serde_json::json!([-54.0, -10.0]));
    assert_eq!(points[points.len() - 1], serde_json::json!([-24.0, 32.0]));
    assert!(answer["clearance_m"].as_f64().unwrap() >= 0.25 - 1e-9);
    let xy: Vec<[f64; 2]> = points
        .iter()
        .map(|p| [p[0].as_f64().unwrap(), p[1].as_f64().unwrap()])
        .collect();
    let length: f64 = xy
        .windows(2)
        .map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]))
        .sum();
    assert!((length - answer["length_m"].as_f64().unwrap()).abs() < 1e-6);
    assert_eq!(std::fs::read(&picture).unwrap()[..4], *b"\x89PNG");
}

#[test]
fn many_queries_are_answered_in_order_from_a_saved_graph_too() {
    let folder = tempfile::tempdir().unwrap();
    let graph = folder.path().join("g.geojson");
    let queries = folder.path().join("q.csv");
    let made = mobot(arguments![
        "graph",
        intel(),
        "--radius",
        "0.2",
        "-o",
        &graph
    ]);
    assert_eq!(made.status, 0, "{}", made.stderr);
    std::fs::write(
        &queries,
        "x0,y0,x1,y1\n30,30,31,31\n-5,0,1,1\n0.05,0.05,30,30\n",
    )
    .unwrap();
    let arguments = arguments!["plan", intel(), "--radius", "0.2", "--queries", &queries];
    let fresh = mobot(arguments.clone());
    let saved = mobot(arguments.into_iter().chain(arguments!["--graph", &graph]));
    assert_eq!(
        (fresh.status, saved.status),
        (0, 0),
        "{}{}",
        fresh.stderr,
        saved.stderr
    );
    assert_eq!(fresh.stdout, saved.stdout);
    let statuses: Vec<Value> = fresh
        .stdout
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap()["status"].clone())
        .collect();
    assert_eq!(statuses.len(), 3);
    assert_eq!(statuses[1], "outside");
    assert_eq!(statuses[2], "start_blocked");
}

#[test]
fn cleaning_leaves_a_picture_a_stage() {
    for paper in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let mut arguments = arguments!["clean", intel(), "-o", folder.path(), "--json"].to_vec();
        if paper {
            arguments.push("--paper".into());
        }
        let run = mobot(arguments);
        assert_eq!(run.status, 0, "{}", run.stderr);
        let answer = run.json();
        let stages = answer["stages"].as_array().unwrap();
        let names: Vec<&str> = stages.iter().map(|s| s["name"].as_str().unwrap()).collect();
        assert_eq!(
            names,
            ["binary", "opened", "filled", "closed", "grown", "skeleton"]
        );
        for stage in stages {
            keys(
                stage,
                &[
                    "name",
                    "free_cells",
                    "free_components",
                    "holes",
                    "removed",
                    "added",
                ],
            );
            assert!(
                folder
                    .path()
                    .join(stage["picture"].as_str().unwrap())
                    .is_file()
            );
            assert!(
                paper || stage["added"] == 0,
                "the default never adds free cells: {stage}"
            );
        }
    }
}

#[test]
fn a_sonar_log_becomes_a_map_that_plans_and_explains_itself() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("corridor.yaml");
    let log = testdata("sonar/udacity-robond/log.csv");
    let sensor = testdata("sonar/udacity-robond/sensor.toml");
    let run = mobot(arguments![
        "map",
        &log,
        "--sensor",
        &sensor,
        "--resolution",
        "0.1",
        "-o",
        &map,
        "--json"
    ]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let answer = run.json();
    let readings = &answer["readings"];
    keys(readings, &["echo", "no_echo", "too_close", "fault"]);
    let total: u64 = readings
        .as_object()
        .unwrap()
        .values()
        .map(|v| v.as_u64().unwrap())
        .sum();
    assert_eq!(
        total as usize,
        std::fs::read_to_string(&log).unwrap().lines().count() - 1
    );
    for key in ["free", "occupied", "unknown"] {
        assert!(answer["cells"][key].as_u64().unwrap() > 100, "{answer}");
    }
    assert!(numpy_header(&map.with_extension("npy")).contains("'descr': '<f4'"));

    let run = mobot(arguments!["why", &map, &log, "1.0", "0.0", "--json"]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let why = run.json();
    assert!(why["readings"].as_u64().unwrap() > 0);
    assert!(
        why.get("saved_log_odds").is_none(),
        "the readings add up to the map: {why}"
    );

    let run = mobot(arguments![
        "plan", &map, "--radius", "0.15", "--from", "0.5,0", "--to", "3,0", "--json"
    ]);
    assert!(run.status <= 1, "{}", run.stderr);
}

fn numpy_header(path: &Path) -> String {
    let bytes = std::fs::read(path).expect("written");
    assert_eq!(&bytes[..6], b"\x93NUMPY");
    String::from_utf8_lossy(&bytes[10..128.min(bytes.len())]).into_owned()
}

#[test]
fn a_guard_says_why_it_cannot_open_its_port_and_is_not_in_the_help() {
    let words = [
        "guard",
        "/nowhere/base",
        "115200",
        "create2",
        "0.5",
        "1",
        "0.1",
    ];
    let run = mobot(words);
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert!(
        run.stdout.starts_with("0 fault system /nowhere/base: "),
        "{}",
        run.stdout
    );
    let run = mobot(&words[..5]);
    assert_eq!(run.status, 2);
    assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
    assert!(!mobot(["--help"]).stdout.contains("guard"));
}
