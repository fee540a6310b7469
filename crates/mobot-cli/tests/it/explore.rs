//! Exploration in simulated buildings: how much of the floor, how true the map, no contact. With `MOBOT_LONG=1` the
//! three buildings of the test data, 50 seeds each, as a table: `MOBOT_LONG=1 cargo test --release -p mobot-cli
//! --test it explore -- --nocapture`.

use mobot_cli::nav::{
    Devices, Explore, ExploreParams, FilterParams, NoLog, Outcome, Runner, RunnerParams,
};
use mobot_cli::score::{Floor, JudgedRobot, MapScore};
use mobot_hw::sim::{BaseParams, Building, RobotParams, SimCamera, Simulation, World};
use occgrid::{FREE_AT_MOST, OCCUPIED_AT_LEAST, Pose2, read_log};

use crate::arguments;
use crate::run::{mobot, testdata};

/// One exploration by a robot whose wheels are exact.
struct Explored {
    outcome: Outcome,
    contacts: u64,
    time: f64,
    score: MapScore,
}

fn explore(building: &Building, seed: u64, budget: f64) -> Explored {
    let world = World::new(building).expect("a world");
    let base = BaseParams {
        // lower than table tops, which a sonar at 0.3 m does not hear
        height: 0.6,
        ..BaseParams::ideal()
    };
    let robot = JudgedRobot {
        radius: base.radius,
        height: base.height,
    };
    let params = RobotParams {
        base,
        ..RobotParams::default()
    };
    let simulation = Simulation::new(world.clone(), params, seed).expect("a robot");
    let devices = Devices {
        base: simulation.base(),
        sonar: simulation.turret(),
        camera: None::<SimCamera>,
        clock: simulation.clock(),
    };
    let exact = FilterParams {
        wheel_sigma: 1e-6,
        track_sigma: 1e-6,
        slip: 1e-6,
        ..FilterParams::default()
    };
    let params = RunnerParams {
        filter: exact,
        ..RunnerParams::default()
    };
    let mut runner = Runner::new(devices, Pose2::default(), params).expect("a runner");
    let params = ExploreParams {
        budget,
        ..ExploreParams::default()
    };
    let mut behaviour = Explore::new(params).expect("a behaviour");
    let outcome = runner.run(&mut behaviour, &mut NoLog, &|| false);
    let grid = behaviour.map().expect("a map");
    let map = grid.to_occupancy_map(FREE_AT_MOST, OCCUPIED_AT_LEAST);
    let floor = Floor::of(&world, robot).expect("a floor");
    let truth = simulation.truth();
    Explored {
        outcome,
        contacts: truth.collisions,
        time: truth.time,
        score: MapScore::of(&map, world.start(), &world, &floor, robot),
    }
}

const ROOM: &str = r#"
start = [0.8, 0.8, 0.3]
walls = [
    { from = [0, 0], to = [3.6, 0] },
    { from = [3.6, 0], to = [3.6, 2.8] },
    { from = [3.6, 2.8], to = [0, 2.8] },
    { from = [0, 2.8], to = [0, 0] },
]
"#;

#[test]
fn a_room_is_explored_to_its_walls_without_touching_them() {
    let building = Building::from_toml(ROOM).expect("a building");
    let found = explore(&building, 3, 1200.0);
    assert_eq!(found.outcome, Outcome::Done, "{:?}", found.score);
    assert_eq!(found.contacts, 0);
    let score = found.score;
    assert!(score.coverage >= 0.98, "{score:?}");
    assert!(score.recall >= 0.95, "{score:?}");
    assert!(score.offset_mean_m <= 0.05, "{score:?}");
}

#[test]
fn the_figures_of_the_three_buildings() {
    if std::env::var_os("MOBOT_LONG").is_none() {
        return;
    }
    println!("| building | seed | end | contacts | time [s] | coverage | recall | offset [m] |");
    println!("|---|---|---|---|---|---|---|---|");
    let mut contacts = 0;
    for name in ["sketch", "office", "hall"] {
        let path = testdata(&format!("worlds/{name}.toml"));
        let text = std::fs::read_to_string(path).expect("a world file");
        let mut building = Building::from_toml(&text).expect("a building");
        building.people.clear();
        for seed in 1..=50 {
            let found = explore(&building, seed, 5400.0);
            let score = found.score;
            println!(
                "| {name} | {seed} | {:?} | {} | {:.0} | {:.4} | {:.4} | {:.3} |",
                found.outcome,
                found.contacts,
                found.time,
                score.coverage,
                score.recall,
                score.offset_mean_m
            );
            contacts += found.contacts;
        }
    }
    assert_eq!(contacts, 0);
}

#[test]
fn what_was_explored_is_on_the_disk_and_can_be_mapped_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let run = mobot(arguments![
        "explore",
        "--world",
        "office",
        "--budget",
        "12",
        "--out",
        out.as_os_str(),
        "--json"
    ]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let answer = run.json();
    assert_eq!(answer["outcome"], "budget over");
    assert_eq!(answer["drive"]["collisions"], 0);
    for name in [
        "map.yaml",
        "map.npy",
        "map.png",
        "graph.geojson",
        "run.mcap",
    ] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let log = std::fs::File::open(out.join("sonar.csv")).expect("a log");
    let shots = read_log(log).expect("a sonar log");
    assert_eq!(answer["map"]["shots"], shots.len());
    assert!(shots.len() >= 20);
    let again = mobot(arguments![
        "map",
        out.join("sonar.csv").as_os_str(),
        "--sensor",
        out.join("sensor.toml").as_os_str(),
        "--refine",
        "-o",
        folder.path().join("again.yaml").as_os_str(),
        "--json"
    ]);
    assert_eq!(again.status, 0, "{}", again.stderr);
    let free = again.json()["cells"]["free"].as_u64().expect("a count");
    assert!(free > 500, "{free}");
}

#[test]
fn unusable_requests_are_refused() {
    for (flag, value) in [("--budget", "0"), ("--shots", "2"), ("--step", "0.1")] {
        let run = mobot(["explore", "--out", "/tmp", flag, value]);
        assert_eq!(run.status, 2, "{flag}");
        assert!(run.stderr.contains(flag), "{}", run.stderr);
    }
}
