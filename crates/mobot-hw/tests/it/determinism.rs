//! Same seed, same world, same calls: the same bytes, on every build and machine. The numbers below are
//! fingerprints, not truths: they change when the simulation is meant to change, and never otherwise.

use std::fmt::Write as _;

use mobot_hw::sim::{CameraModel, Distortion, RobotParams, Simulation, World};
use mobot_hw::{Camera as _, Clock as _, DifferentialDrive as _, RangeFinder as _, Twist2};

use crate::files::{HALL, OFFICE, SKETCH};

/// Fowler, Noll and Vo's FNV-1a.
fn fingerprint(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

/// Drives, listens and looks; everything that comes back, as bytes.
fn run(text: &str, distortion: Distortion, seed: u64) -> Vec<u8> {
    let params = RobotParams {
        camera: CameraModel {
            distortion,
            ..CameraModel::paper()
        },
        ..RobotParams::default()
    };
    let simulation =
        Simulation::new(World::from_toml(text).expect("a world"), params, seed).expect("a world");
    let (mut base, mut clock) = (simulation.base(), simulation.clock());
    let (mut turret, mut camera) = (simulation.turret(), simulation.camera());
    let mut log = String::new();
    let mut bytes = Vec::new();
    for leg in 0..6 {
        base.drive(Twist2::new(0.3, 0.4 - 0.2 * f64::from(leg)))
            .expect("it works");
        for shot in 0..20 {
            let ping = turret.ping(0.31 * f64::from(shot) - 3.1).expect("it works");
            writeln!(log, "{ping:?}").expect("it works");
        }
        clock.sleep(0.3);
        writeln!(
            log,
            "{:?} {:?}",
            base.status().expect("it works"),
            simulation.truth()
        )
        .expect("it works");
        bytes.extend(camera.frame().expect("it works").image.into_raw());
    }
    bytes.extend(log.into_bytes());
    bytes
}

#[test]
fn the_same_bytes_on_every_build() {
    let bent = Distortion::PlumbBob {
        coefficients: [-0.2, 0.03, 0.001, -0.001, 0.0],
    };
    let fisheye = Distortion::Fisheye {
        coefficients: [0.01, -0.005, 0.001, 0.0],
    };
    let found = [
        fingerprint(&run(OFFICE, Distortion::None, 1)),
        fingerprint(&run(SKETCH, bent, 2)),
        fingerprint(&run(HALL, fisheye, 3)),
    ];
    let expected = [
        0x962c_d7bc_3f56_0fb0_u64,
        0xd1ac_2f97_96ba_184f,
        0x43b1_ff20_88bf_97d8,
    ];
    assert_eq!(found, expected, "{found:#018x?}");
}

#[test]
fn twice_the_same_and_another_seed_another() {
    let run = |seed| run(SKETCH, Distortion::None, seed);
    let first = run(4);
    assert!(first == run(4));
    assert!(first != run(5));
}
