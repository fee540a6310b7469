//! The simulated sonar: ranges against an independent model of the buildings, and echoes where physics
//! puts them.

use std::f64::consts::{FRAC_PI_2, PI};

use mobot_hw::RangeFinder as _;
use mobot_hw::sim::{Block, Building, RobotParams, Simulation, Sonar, SonarParams, Walker, World};
use occgrid::{Pose2, Reading};

use crate::files::{empty_world, rows};

#[test]
fn rays_and_cones_reach_as_far_as_an_independent_model_says() {
    let golden = rows(
        include_str!("../../../../testdata/golden/sim_ranges.csv"),
        1,
    );
    let mut worlds = Vec::new();
    let (mut rays, mut cones) = (0, 0);
    for (name, n) in &golden {
        if worlds.last().is_none_or(|(w, _)| *w != name[0]) {
            worlds.push((name[0].clone(), empty_world(&name[0])));
        }
        let world = &worlds.last().unwrap().1;
        let (pose, height, half, truth) = (Pose2::new(n[0], n[1], n[2]), n[3], n[4], n[5]);
        if half == 0.0 {
            let found = world.range_along(pose, 60.0, height);
            // circles are polygons over there
            assert!(
                (found.unwrap_or(f64::NAN) - truth).abs() < 1e-4
                    || truth.is_nan() && found.is_none(),
                "{name:?} {n:?}: {found:?}"
            );
            rays += 1;
        } else {
            let sonar = Sonar::new(SonarParams {
                half_beam: half / 1.6,
                max_range: 50.0,
                critical_angle: FRAC_PI_2,
                corner_reach: 0.0,
                edge_reach: 0.0,
                height,
                ..SonarParams::default()
            });
            if truth.is_nan() || truth > 8.0 {
                continue; // near the cone's edge, 50 m of reach are 8.5
            }
            let found = sonar.first_echo(world, pose, 0.0).unwrap();
            // rays half a degree apart never overshoot, and pass by little; they may miss a tip
            assert!(found > truth - 1e-4, "{name:?} {n:?}: {found}");
            assert!(
                found < truth + 0.005 + 0.01 * truth,
                "{name:?} {n:?}: {found}"
            );
            cones += 1;
        }
    }
    assert!(rays > 400 && cones > 300, "{rays} {cones}");
}

/// A long thin wall across the x axis at `x`, turned by `slant` from square.
fn wall_at(x: f64, slant: f64) -> Building {
    Building {
        boxes: vec![Block {
            at: [x, 0.0],
            size: [0.002, 20.0],
            yaw_deg: slant.to_degrees(),
            height: 2.0,
            ..Block::default()
        }],
        ..Building::default()
    }
}

fn echo(building: &Building, params: SonarParams) -> Option<f64> {
    let world = World::new(building).expect("a world");
    Sonar::new(params).first_echo(&world, Pose2::default(), 0.0)
}

#[test]
fn a_square_wall_answers_up_to_the_end_of_the_range() {
    let params = SonarParams::default();
    let range = echo(&wall_at(3.001, 0.0), params).unwrap();
    assert!((range - 3.0).abs() < 1e-9, "{range}");
    assert!(echo(&wall_at(4.95, 0.0), params).is_some());
    assert!(echo(&wall_at(5.1, 0.0), params).is_none());
}

#[test]
fn a_slanted_wall_is_silent() {
    let params = SonarParams::default();
    // 20 degrees: the beam's axis is within the critical angle of 25
    assert!(echo(&wall_at(2.0, 20.0_f64.to_radians()), params).is_some());
    // 45 degrees: even the beam's edge, 14 degrees nearer to square, is not
    assert!(echo(&wall_at(2.0, 45.0_f64.to_radians()), params).is_none());
}

#[test]
fn a_double_bounce_reads_long() {
    let narrow = SonarParams {
        half_beam: 0.01,
        corner_reach: 0.0,
        edge_reach: 0.0,
        ..SonarParams::default()
    };
    let mut building = wall_at(1.5, -PI / 4.0);
    building.boxes.push(Block {
        at: [1.5, 1.201],
        size: [2.0, 0.002],
        height: 2.0,
        ..Block::default()
    });
    // along x to the mirror at 1.5, then along y to the wall at 1.2: the mirror's thickness aside
    let range = echo(&building, narrow).unwrap();
    assert!((range - 2.7).abs() < 0.01, "{range}");
}

#[test]
fn corners_answer_from_anywhere_edges_only_from_near() {
    // the inside of a right angle, 3 m away: both walls at 45 degrees
    let hollow = |x: f64| {
        let leg = |yaw_deg: f64, y: f64| Block {
            at: [x - 0.5, y],
            size: [2.0_f64.sqrt(), 0.002],
            yaw_deg,
            height: 2.0,
            ..Block::default()
        };
        Building {
            boxes: vec![leg(-45.0, 0.5), leg(45.0, -0.5)],
            ..Building::default()
        }
    };
    let range = echo(&hollow(3.0), SonarParams::default()).unwrap();
    assert!((range - 3.0).abs() < 0.01, "{range}");
    let edge = |x: f64| Building {
        boxes: vec![Block {
            at: [x + 0.5_f64.sqrt(), 0.0],
            size: [1.0; 2],
            yaw_deg: 45.0,
            height: 2.0,
            ..Block::default()
        }],
        ..Building::default()
    };
    let range = echo(&edge(1.4), SonarParams::default()).unwrap();
    assert!((range - 1.4).abs() < 1e-6, "{range}");
    assert!(echo(&edge(1.6), SonarParams::default()).is_none());
}

#[test]
fn what_is_lower_than_the_beam_is_not_heard_and_people_are() {
    let mut building = wall_at(3.0, 0.0);
    building.boxes[0].height = 0.25;
    assert!(echo(&building, SonarParams::default()).is_none());
    building.people.push(Walker {
        way: vec![[2.0, 0.0], [9.0, 0.0]],
        speed: 1.0,
        ..Walker::default()
    });
    let world = World::new(&building).unwrap();
    let sonar = Sonar::new(SonarParams::default());
    let at = |time| sonar.first_echo(&world, Pose2::default(), time);
    assert!((at(0.0).unwrap() - 1.8).abs() < 1e-3);
    assert!((at(0.5).unwrap() - 2.3).abs() < 1e-3);
    assert!(at(2.0).is_none(), "a soft coat is heard up to 3 m");
}

fn readings(building: &Building, sonar: SonarParams, shots: usize) -> Vec<Reading> {
    let params = RobotParams {
        sonar,
        ..RobotParams::default()
    };
    let simulation =
        Simulation::new(World::new(building).expect("a world"), params, 5).expect("a world");
    let mut sonar = simulation.sonar();
    (0..shots)
        .map(|_| sonar.ping(0.0).expect("it works").reading)
        .collect()
}

#[test]
fn noise_silence_and_crosstalk_come_as_often_as_told() {
    let sure = SonarParams {
        silence: 0.0,
        crosstalk: 0.0,
        resolution: 0.0,
        sigma: 0.02,
        ..SonarParams::default()
    };
    let ranges: Vec<f64> = readings(&wall_at(2.001, 0.0), sure, 4000)
        .iter()
        .map(|r| match r {
            Reading::Echo { range } => *range,
            other => panic!("{other:?}"),
        })
        .collect();
    let mean = ranges.iter().sum::<f64>() / 4000.0;
    let sigma = (ranges.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 4000.0).sqrt();
    assert!((mean - 2.0).abs() < 0.002, "{mean}");
    assert!((sigma / 0.02 - 1.0).abs() < 0.05, "{sigma}");

    let silent = SonarParams {
        silence: 0.1,
        ..sure
    };
    let missed = readings(&wall_at(2.0, 0.0), silent, 4000)
        .iter()
        .filter(|r| matches!(r, Reading::NoEcho { listened } if (*listened - 5.0).abs() < 1e-12))
        .count();
    assert!((320..480).contains(&missed), "{missed}");

    let crossed = SonarParams {
        crosstalk: 0.1,
        ..sure
    };
    // nothing there: every echo is a foreign one
    let foreign: Vec<Reading> = readings(&Building::default(), crossed, 4000)
        .into_iter()
        .filter(|r| matches!(r, Reading::Echo { .. }))
        .collect();
    assert!((320..480).contains(&foreign.len()), "{}", foreign.len());
    assert!(
        foreign
            .iter()
            .all(|r| matches!(r, Reading::Echo { range } if (0.2..5.1).contains(range)))
    );
}

#[test]
fn nearer_than_blanking_is_too_close_and_readings_have_steps() {
    let params = SonarParams {
        silence: 0.0,
        crosstalk: 0.0,
        sigma: 0.0,
        resolution: 0.05,
        blanking: 0.5,
        ..SonarParams::default()
    };
    assert_eq!(readings(&wall_at(0.4, 0.0), params, 1), [Reading::TooClose]);
    assert_eq!(
        readings(&wall_at(1.234, 0.0), params, 1),
        [Reading::Echo { range: 1.25 }]
    );
}
