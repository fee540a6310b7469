//! The simulated base: kinematics, wheels, limits, contact.

use mobot_hw::sim::{BaseParams, Block, Building, RobotParams, Simulation, Walker, World};
use mobot_hw::{Clock as _, DifferentialDrive as _, Odometry, Twist2};
use occgrid::Pose2;
use proptest::prelude::*;

use crate::files::building;

fn simulation(building: &Building, base: BaseParams) -> Simulation {
    let params = RobotParams {
        base,
        ..RobotParams::default()
    };
    Simulation::new(World::new(building).expect("a world"), params, 3).expect("a world")
}

#[test]
fn an_ideal_base_drives_arcs_and_its_wheels_say_so() {
    let simulation = simulation(&Building::default(), BaseParams::ideal());
    let (mut base, mut clock) = (simulation.base(), simulation.clock());
    let mut odometry = Odometry::new(Pose2::default(), base.track());
    odometry.update(base.status().unwrap().travel);
    for command in [
        Twist2::new(0.3, 0.5),
        Twist2::new(0.2, -0.8),
        Twist2::new(0.0, 1.0),
    ] {
        base.drive(command).unwrap();
        for _ in 0..300 {
            clock.sleep(0.01);
            odometry.update(base.status().unwrap().travel);
        }
    }
    base.stop().unwrap();
    clock.sleep(1.0);
    let believed = odometry.update(base.status().unwrap().travel);
    let truth = simulation.truth().map_from_base;
    // ticks of 0.4446 mm leave half a tick on each wheel: 2 mrad
    assert!(believed.position().distance(truth.position()) < 3e-3);
    assert!((believed.theta - truth.theta).abs() < 4e-3);
    assert!(simulation.truth().driven > 1.0);
}

#[test]
fn a_circle_closes() {
    let base = BaseParams {
        max_acceleration: 1e9,
        ..BaseParams::ideal()
    };
    let simulation = simulation(&Building::default(), base);
    simulation.base().drive(Twist2::new(0.3, 0.5)).unwrap();
    simulation.clock().sleep(std::f64::consts::TAU / 0.5);
    let truth = simulation.truth();
    assert!(
        truth
            .map_from_base
            .position()
            .distance(Pose2::default().position())
            < 2e-3
    );
    assert!((truth.driven - std::f64::consts::TAU * 0.6).abs() < 2e-3);
}

#[test]
fn speed_and_acceleration_are_limited_and_the_curve_is_kept() {
    let simulation = simulation(&Building::default(), BaseParams::ideal());
    let (mut base, mut clock) = (simulation.base(), simulation.clock());
    base.drive(Twist2::new(5.0, 5.0)).unwrap();
    clock.sleep(0.1);
    assert!(simulation.truth().twist.linear <= 0.1 + 1e-9, "1 m/s^2");
    clock.sleep(2.0);
    let twist = simulation.truth().twist;
    assert!((twist.linear - twist.angular).abs() < 1e-9, "1 m radius");
    let [_, right] = twist.wheels(0.235);
    assert!((right - 0.5).abs() < 1e-9);
    for bad in [Twist2::new(f64::NAN, 0.0), Twist2::new(0.1, f64::INFINITY)] {
        base.drive(Twist2::new(0.2, 0.0)).unwrap();
        clock.sleep(1.0);
        base.drive(bad).unwrap();
        clock.sleep(1.0);
        assert_eq!(simulation.truth().twist, Twist2::default());
    }
}

#[test]
fn wrong_wheels_and_slip_carry_the_true_pose_off() {
    let base = BaseParams {
        wheel_error: [1.01, 1.01],
        slip: [0.1, 0.1],
        ..BaseParams::ideal()
    };
    let simulation = simulation(&Building::default(), base);
    let mut clock = simulation.clock();
    simulation.base().drive(Twist2::new(0.25, 0.0)).unwrap();
    clock.sleep(4.0);
    simulation.base().stop().unwrap();
    clock.sleep(1.0);
    let wheels = simulation.base().status().unwrap().travel.left;
    assert!((simulation.truth().driven / wheels - 1.01 * 0.9).abs() < 1e-3);
    simulation.set_slip([0.0, 0.5]);
    simulation.base().drive(Twist2::new(0.25, 0.0)).unwrap();
    clock.sleep(2.0);
    assert!(
        simulation.truth().map_from_base.theta < -0.5,
        "it pulls to the right"
    );
}

fn box_ahead(yaw_deg: f64) -> Building {
    Building {
        boxes: vec![Block {
            at: [1.5, 0.0],
            size: [1.0, 8.0],
            yaw_deg,
            ..Block::default()
        }],
        ..Building::default()
    }
}

#[test]
fn a_wall_stops_the_body_exactly_and_counts_once() {
    let simulation = simulation(&box_ahead(0.0), BaseParams::ideal());
    let (mut base, mut clock) = (simulation.base(), simulation.clock());
    base.drive(Twist2::new(0.4, 0.0)).unwrap();
    clock.sleep(5.0);
    let truth = simulation.truth();
    assert!(
        (truth.map_from_base.x - (1.0 - 0.175)).abs() < 1e-6,
        "{truth:?}"
    );
    assert_eq!(truth.collisions, 1);
    assert!(truth.least_clearance.abs() < 1e-12);
    let status = base.status().unwrap();
    assert!(status.bump_left && status.bump_right && status.in_trouble());
    assert!(status.travel.left > 1.5, "the wheels spin on");
    base.drive(Twist2::new(-0.2, 0.0)).unwrap();
    clock.sleep(1.5);
    assert!(!base.status().unwrap().in_trouble());
    base.drive(Twist2::new(0.4, 0.0)).unwrap();
    clock.sleep(5.0);
    assert_eq!(simulation.truth().collisions, 2);
}

#[test]
fn the_bumper_knows_its_side_and_the_body_slides() {
    for (yaw, left) in [(-40.0, false), (40.0, true)] {
        let simulation = simulation(&box_ahead(yaw), BaseParams::ideal());
        simulation.base().drive(Twist2::new(0.3, 0.0)).unwrap();
        simulation.clock().sleep(4.0);
        let status = simulation.base().status().unwrap();
        // turned counter-clockwise, the wall is nearer on the left
        assert_eq!(
            (status.bump_left, status.bump_right),
            (left, !left),
            "{yaw}"
        );
        let y = simulation.truth().map_from_base.y;
        assert!(y.abs() > 0.05 && (y < 0.0) == left, "{yaw}: {y}");
    }
}

#[test]
fn a_person_who_walks_into_a_standing_robot_is_no_collision_of_it() {
    let building = Building {
        people: vec![Walker {
            way: vec![[2.0, 0.0], [-2.0, 0.0]],
            ..Walker::default()
        }],
        ..Building::default()
    };
    let standing = simulation(&building, BaseParams::ideal());
    standing.clock().sleep(1.8);
    assert!(standing.base().status().unwrap().bump_left);
    assert_eq!(standing.truth().collisions, 0);
    let moving = simulation(&building, BaseParams::ideal());
    moving.base().drive(Twist2::new(0.2, 0.0)).unwrap();
    moving.clock().sleep(1.8);
    assert_eq!(moving.truth().collisions, 1);
}

#[test]
fn a_robot_that_does_not_fit_is_refused() {
    let mut building = box_ahead(0.0);
    building.start = [0.9, 0.0, 0.0];
    let refused = Simulation::new(World::new(&building).unwrap(), RobotParams::default(), 1);
    let message = refused.unwrap_err().to_string();
    assert!(
        message.contains("0.175") && message.contains("0.9"),
        "{message}"
    );
}

#[test]
fn impossible_robots_are_refused_and_senseless_times_do_not_pass() {
    let world = || World::new(&Building::default()).unwrap();
    let refused =
        |params: RobotParams| Simulation::new(world(), params, 1).unwrap_err().to_string();
    let good = RobotParams::default();
    let base = |base| refused(RobotParams { base, ..good });
    assert!(
        base(BaseParams {
            tick: 0.0,
            ..good.base
        })
        .contains("base.tick")
    );
    assert!(
        base(BaseParams {
            track: f64::NAN,
            ..good.base
        })
        .contains("base.track")
    );
    let frame_time = 0.0;
    assert!(refused(RobotParams { frame_time, ..good }).contains("frame_time"));
    let pan_settle = f64::INFINITY;
    assert!(refused(RobotParams { pan_settle, ..good }).contains("pan_settle"));

    let simulation = Simulation::new(world(), good, 1).unwrap();
    for senseless in [f64::NAN, f64::INFINITY, -1.0] {
        simulation.clock().sleep(senseless);
    }
    assert!(simulation.clock().now().abs() < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn no_command_drives_a_body_into_anything(
        commands in prop::collection::vec((-0.5..0.5_f64, -3.0..3.0_f64, 0.05..2.0_f64), 1..30),
        name in prop::sample::select(vec!["office", "sketch", "hall"]),
    ) {
        let mut building = building(name);
        building.people.clear();
        let world = World::new(&building).unwrap();
        let simulation = simulation(&building, BaseParams::default());
        for (linear, angular, seconds) in commands {
            simulation.base().drive(Twist2::new(linear, angular)).unwrap();
            let mut left = seconds;
            while left > 0.0 {
                simulation.clock().sleep(0.05);
                left -= 0.05;
                let at = simulation.truth().map_from_base.position();
                let room = world.room_at(at, 1.0, 1.2);
                prop_assert!(room >= 0.175 - 2e-6, "{room} at {at:?}");
            }
        }
    }
}
