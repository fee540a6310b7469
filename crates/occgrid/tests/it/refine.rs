//! Properties of the refinement that hold on every log.

use occgrid::{
    Cell, GridError, OccupancyGrid, Point2, Pose2, Reading, RefineError, RefineParams, Refinement,
    Shot, SonarModel, refine,
};

use crate::sonar_score::empty_around;
use crate::sonar_world::{Random, Sensor, World, every, room, scan, scan_with};

fn model() -> SonarModel {
    SonarModel {
        beam_width: 0.4538,
        sigma: 0.03,
        max_range: 2.54,
        ..SonarModel::default()
    }
}

fn echo(x: f64, y: f64, heading: f64, range: f64) -> Shot {
    Shot {
        stamp: 0.0,
        map_from_base: Pose2::new(x, y, heading),
        bearing: 0.0,
        reading: Reading::Echo { range },
    }
}

fn plain(shots: &[Shot], resolution: f64) -> OccupancyGrid {
    let mut grid = OccupancyGrid::new(resolution).expect("resolution");
    grid.integrate(&model(), shots).expect("shots are valid");
    grid
}

fn refined(shots: &[Shot], resolution: f64) -> OccupancyGrid {
    refine(
        shots,
        &model(),
        &plain(shots, resolution),
        &RefineParams::default(),
    )
    .expect("shots are valid")
}

fn at(grid: &OccupancyGrid, x: f64, y: f64) -> f32 {
    let cell = grid.frame().cell_at(Point2::new(x, y)).expect("inside");
    grid.log_odds()[grid.frame().index(cell)]
}

#[test]
fn one_echo_is_free_then_wall_then_unknown() {
    // two places, so that the map reaches behind both
    let grid = refined(
        &[echo(0.01, 0.01, 0.0, 1.0), echo(-0.6, 0.01, 3.1, 0.5)],
        0.05,
    );
    assert!(at(&grid, 0.5, 0.01) < -1.0);
    assert!(at(&grid, 1.01, 0.01) > 0.05);
    assert!(at(&grid, 1.3, 0.01).abs() < 0.05);
    assert!(at(&grid, -0.2, 0.01).abs() < 0.05);
}

#[test]
fn the_order_of_the_shots_does_not_matter() {
    let world = room(3);
    let mut shots = every(9, &scan(&world, 3));
    let grid = plain(&shots, 0.05);
    let params = RefineParams::default();
    let first = refine(&shots, &model(), &grid, &params).expect("shots are valid");
    let mut random = Random(5);
    for i in (1..shots.len()).rev() {
        shots.swap(i, random.between(0.0, (i + 1) as f64) as usize);
    }
    let second = refine(&shots, &model(), &grid, &params).expect("shots are valid");
    let bits = |g: &OccupancyGrid| g.log_odds().iter().map(|l| l.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&first), bits(&second));
}

#[test]
fn an_echo_that_others_look_through_is_not_believed() {
    // a false echo at 1 m along +x, and shots across its arc from both sides that all pass
    let mut shots = vec![echo(0.0, 0.0, 0.0, 1.0)];
    for k in 0..7 {
        let x = 0.7 + 0.1 * f64::from(k);
        shots.push(echo(x, -1.0, std::f64::consts::FRAC_PI_2, 2.0));
        shots.push(echo(x, 1.0, -std::f64::consts::FRAC_PI_2, 2.0));
    }
    let grid = plain(&shots, 0.05);
    let result = Refinement::new(&shots, &model(), &grid, &RefineParams::default())
        .expect("shots are valid");
    let trust = result.trust();
    let trust = |k: usize| trust[k].expect("an echo in range is evidence");
    assert!(trust(0) < 0.8 * trust(1), "{} {}", trust(0), trust(1));
    assert!(at(result.grid(), 1.0, 0.0) < -1.0);
    assert!(at(&grid, 1.0, 0.0) > at(result.grid(), 1.0, 0.0));
}

#[test]
fn held_echoes_build_no_wall() {
    // a sonar that turns on the spot: a true echo, then the same value for half a turn
    let turned = |range: fn(u32) -> f64| -> Vec<Shot> {
        let shot = |k: u32| Shot {
            stamp: f64::from(k),
            ..echo(0.01, 0.01, 0.1 * f64::from(k), range(k))
        };
        (0..32).map(shot).collect()
    };
    let refinement = |shots: &[Shot]| {
        let params = RefineParams::default();
        Refinement::new(shots, &model(), &plain(shots, 0.05), &params).expect("shots are valid")
    };
    let held = refinement(&turned(|_| 1.0));
    // as far all around, but read afresh every time
    let fresh = refinement(&turned(|k| 1.0 + 0.001 * f64::from(k % 2)));
    let opposite = |found: &Refinement| {
        let p = Point2::new(1.01 * 2.0_f64.cos(), 1.01 * 2.0_f64.sin());
        found.evidence(found.grid().frame().cell_at(p).expect("inside"))
    };
    assert!(opposite(&fresh) > 0.6, "{}", opposite(&fresh));
    assert!(
        opposite(&held) < 0.5 * opposite(&fresh),
        "{}",
        opposite(&held)
    );
    // what they passed is free all the same
    let inside = |found: &Refinement| at(found.grid(), 0.6 * 2.0_f64.cos(), 0.6 * 2.0_f64.sin());
    assert!(inside(&held) < -1.0 && inside(&fresh) < -1.0);
}

#[test]
fn what_is_no_evidence_leaves_the_map_unknown() {
    let mut shots = vec![echo(0.0, 0.0, 0.0, 3.0)];
    for reading in [Reading::TooClose, Reading::Fault] {
        shots.push(Shot {
            reading,
            ..shots[0]
        });
    }
    let grid = refined(&shots, 0.1);
    assert!(grid.log_odds().iter().all(|l| l.to_bits() == 0));
    assert!(
        refined(&[], 0.1)
            .log_odds()
            .iter()
            .all(|l| l.to_bits() == 0)
    );
}

#[test]
fn unusable_input_is_refused() {
    let grid = plain(&[], 0.1);
    let bad = [echo(f64::NAN, 0.0, 0.0, 1.0)];
    let error = refine(&bad, &model(), &grid, &RefineParams::default()).expect_err("NaN");
    assert!(matches!(error, RefineError::Grid(GridError::Shot { .. })));
    let params = RefineParams {
        same_place: 0.0,
        ..RefineParams::default()
    };
    let error = refine(&[], &model(), &grid, &params).expect_err("same_place");
    assert!(error.to_string().contains("same_place"), "{error}");
}

/// A corridor 1.6 m wide along +x with a doorway of 0.9 m in its upper wall, into a room 2 m deep.
fn corridor() -> World {
    let outline = [
        (0.0, 0.0),
        (6.0, 0.0),
        (6.0, 1.6),
        (3.45, 1.6),
        (3.45, 1.7),
        (4.5, 1.7),
        (4.5, 3.7),
        (1.5, 3.7),
        (1.5, 1.7),
        (2.55, 1.7),
        (2.55, 1.6),
        (0.0, 1.6),
    ];
    let stops = (1..=11)
        .map(|k| Point2::new(0.5 * f64::from(k), 0.8))
        .collect();
    World::from_outline(
        outline.iter().map(|&(x, y)| Point2::new(x, y)).collect(),
        stops,
    )
}

/// Whether a path of 4-neighbours, all called free, leads from one place to another.
fn is_joined(grid: &OccupancyGrid, from: Point2, to: Point2) -> bool {
    let frame = grid.frame();
    let cell = |p| frame.cell_at(p).expect("inside");
    let (mut open, goal) = (vec![cell(from)], cell(to));
    let mut seen = vec![false; frame.cell_count()];
    while let Some(c) = open.pop() {
        let inside = c.col < frame.width() && c.row < frame.height();
        if !inside || seen[frame.index(c)] || grid.log_odds()[frame.index(c)] >= 0.0 {
            continue;
        }
        seen[frame.index(c)] = true;
        let (col, row) = (c.col, c.row);
        open.extend([
            Cell::new(col + 1, row),
            Cell::new(col.wrapping_sub(1), row),
            Cell::new(col, row + 1),
            Cell::new(col, row.wrapping_sub(1)),
        ]);
    }
    seen[frame.index(goal)]
}

/// Mean number of cells of the corridor within 0.5 m of its lower wall that are not called free.
fn eaten(grid: &OccupancyGrid) -> f64 {
    let across = |k: u32| {
        let x = 1.025 + 0.1 * f64::from(k);
        let depths = (1..10).map(|j| 0.025 + 0.05 * f64::from(j));
        depths.filter(|&y| at(grid, x, y) >= 0.0).count() as f64
    };
    (0..40).map(across).sum::<f64>() / 40.0
}

#[test]
fn doors_open_and_walls_narrow() {
    let world = corridor();
    let sensor = Sensor {
        half: 0.22,
        reach: 4.0,
        critical: 0.5,
        listens: 4.5,
        holds: false,
    };
    // the paper's own model, but for the beam and the reach of this sensor
    let model = SonarModel {
        beam_width: 0.45,
        max_range: 4.5,
        ..SonarModel::default()
    };
    let sharp = SonarModel {
        sigma: 0.03,
        ..model
    };
    for seed in 0..5 {
        let shots = every(18, &scan_with(&world, &sensor, &mut Random(seed)));
        let empty = empty_around(&world, 0.05);
        let [mut plain, mut narrow] = [empty.clone(), empty];
        plain.integrate(&model, &shots).expect("shots are valid");
        narrow.integrate(&sharp, &shots).expect("shots are valid");
        let refined =
            refine(&shots, &sharp, &narrow, &RefineParams::default()).expect("shots are valid");
        let joined = |grid| is_joined(grid, Point2::new(3.0, 0.8), Point2::new(3.0, 2.2));
        let cells = [&plain, &narrow, &refined].map(eaten);
        println!(
            "seed {seed}: door open: plain {}, plain with sigma 0.03 {}, refined {}; wall eats {cells:.1?} cells",
            joined(&plain),
            joined(&narrow),
            joined(&refined)
        );
        assert!(!joined(&plain) && joined(&refined));
        assert!(cells[2] < 0.6 * cells[0], "{cells:?}");
    }
}

#[test]
fn many_shots_take_bounded_time() {
    // 20 000 shots along a corridor; thinned to a budget of 2e7 visits, half a second of work at most
    let world = corridor();
    let sensor = Sensor {
        half: 0.22,
        reach: 4.0,
        critical: 0.5,
        listens: 4.5,
        holds: false,
    };
    let turn = scan_with(&world, &sensor, &mut Random(1));
    let count = 20_000;
    let shots: Vec<Shot> = (0..count).map(|k| turn[k % turn.len()]).collect();
    let model = SonarModel {
        max_range: 4.5,
        ..model()
    };
    let params = RefineParams {
        max_visits: 2e7,
        ..RefineParams::default()
    };
    let grid = empty_around(&world, 0.05);
    let result = Refinement::new(&shots, &model, &grid, &params).expect("shots are valid");
    let kept = result.trust().iter().flatten().count();
    assert!(kept > 100 && kept < turn.len(), "{kept}");
    // what is left still makes the map
    for stop in &world.stops {
        assert!(at(result.grid(), stop.x + 0.25, stop.y) < -1.0);
    }
}

/// 10 000 and 100 000 shots, no two alike. Measured in a release build: see the README of this crate.
#[test]
fn long_logs_finish() {
    let long = std::env::var_os("MOBOT_LONG").is_some();
    for count in if long {
        vec![10_000, 100_000]
    } else {
        vec![1_000]
    } {
        let mut random = Random(9);
        let shots: Vec<Shot> = (0..count)
            .map(|_| {
                let (x, y) = (random.between(0.0, 40.0), random.between(0.0, 40.0));
                echo(x, y, random.between(-3.0, 3.0), random.between(0.3, 2.5))
            })
            .collect();
        let grid = plain(&shots, 0.05);
        let start = std::time::Instant::now();
        let refined =
            refine(&shots, &model(), &grid, &RefineParams::default()).expect("shots are valid");
        let elapsed = start.elapsed();
        println!("{count} shots: {elapsed:.2?}");
        assert!(elapsed.as_secs() < 60);
        assert!(refined.log_odds().iter().any(|l| *l < -1.0));
    }
}

#[test]
fn a_known_main_direction_gives_the_map_that_finding_it_gives() {
    let model = model();
    let stops = [(0.0, 0.0), (1.0, 0.1), (2.0, -0.1)];
    let shots: Vec<Shot> = stops
        .iter()
        .flat_map(|&(x, y)| {
            let side = |bearing: f64, range| echo(x, y, bearing, range);
            [side(1.2, 1.0 - y), side(-1.94, 1.0 + y)]
        })
        .collect();
    let grid = plain(&shots, 0.05);
    let found =
        Refinement::new(&shots, &model, &grid, &RefineParams::default()).expect("a refinement");
    let told = RefineParams {
        main_direction: Some(found.main_direction()),
        ..RefineParams::default()
    };
    let again = Refinement::new(&shots, &model, &grid, &told).expect("a refinement");
    let bits =
        |r: &Refinement| -> Vec<u32> { r.grid().log_odds().iter().map(|l| l.to_bits()).collect() };
    assert_eq!(bits(&found), bits(&again));
    let turned = RefineParams {
        main_direction: Some(found.main_direction() + 0.4),
        ..RefineParams::default()
    };
    let other = Refinement::new(&shots, &model, &grid, &turned).expect("a refinement");
    assert_ne!(bits(&found), bits(&other));
    let nonsense = RefineParams {
        main_direction: Some(f64::NAN),
        ..RefineParams::default()
    };
    let error = nonsense.validate().expect_err("NaN");
    assert!(error.to_string().contains("main_direction"), "{error}");
}
