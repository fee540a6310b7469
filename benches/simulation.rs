//! The simulated world: one sonar shot, one camera frame, one step of the base, one core.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use mobot_hw::sim::{
    CameraModel, Look, Renderer, RobotParams, Simulation, Sonar, SonarParams, World,
};
use mobot_hw::{Clock as _, DifferentialDrive as _, Twist2};
use occgrid::Pose2;
use std::hint::black_box;

fn world(name: &str) -> World {
    let path = format!(
        "{}/../testdata/worlds/{name}.toml",
        env!("CARGO_MANIFEST_DIR")
    );
    World::from_toml(&std::fs::read_to_string(path).expect("a world file")).expect("a world")
}

/// Down a corridor, into its side, through a doorway, at a person.
const VIEWS: [(&str, Pose2); 4] = [
    ("office", Pose2::new(1.5, 0.0, 0.0)),
    ("office", Pose2::new(2.0, 3.0, -0.9)),
    ("sketch", Pose2::new(11.6, 1.2, 0.3)),
    ("hall", Pose2::new(3.0, 1.0, 0.8)),
];

fn frames(c: &mut Criterion) {
    let cameras = [
        ("480x220", CameraModel::paper()),
        ("640x480", CameraModel::vga()),
    ];
    for (size, camera) in cameras {
        let mut group = c.benchmark_group(format!("frame_{size}"));
        for (k, (name, pose)) in VIEWS.into_iter().enumerate() {
            let world = world(name);
            let mut renderer = Renderer::new(camera, Look::default()).expect("a camera");
            let frame = renderer.render(&world, pose, 1.0, 0);
            let (low, high) = frame
                .as_raw()
                .iter()
                .fold((255, 0), |(l, h), p| (*p.min(&l), *p.max(&h)));
            assert!(high > low + 80, "{name}: a picture with something in it");
            group.bench_function(format!("{name}_{k}"), |b| {
                b.iter(|| renderer.render(&world, black_box(pose), 1.0, 0));
            });
        }
    }
}

fn shots(c: &mut Criterion) {
    let sonar = Sonar::new(SonarParams::default());
    let mut group = c.benchmark_group("shot");
    for name in ["office", "sketch", "hall"] {
        let world = world(name);
        let start = world.start();
        let poses: Vec<Pose2> = (0..200)
            .map(|k| Pose2::new(start.x + 0.002 * f64::from(k), start.y, 0.31 * f64::from(k)))
            .collect();
        let heard = poses
            .iter()
            .filter(|p| sonar.first_echo(&world, **p, 0.0).is_some());
        assert!(heard.count() > 50, "{name}: there is something to hear");
        let mut next = poses.iter().cycle();
        group.bench_function(name, |b| {
            b.iter(|| sonar.first_echo(&world, *next.next().expect("endless"), 0.0));
        });
    }
}

fn steps(c: &mut Criterion) {
    let mut group = c.benchmark_group("base_step_5ms");
    for name in ["office", "sketch", "hall"] {
        group.bench_function(name, |b| {
            b.iter_batched(
                || {
                    let robot = Simulation::new(world(name), RobotParams::default(), 1);
                    let robot = robot.expect("it fits");
                    robot.base().drive(Twist2::new(0.3, 0.2)).expect("a base");
                    robot
                },
                |robot| {
                    // a hundred steps: divide by 100
                    robot.clock().sleep(0.5);
                    robot
                },
                BatchSize::LargeInput,
            );
        });
    }
}

criterion_group!(benches, frames, shots, steps);
criterion_main!(benches);
