//! The traits: through references and boxes, with a scripted device beside the simulated ones.

use mobot_hw::{
    Bearings, Camera, CameraFrame, Clock, DeviceError, FaultKind, PanActuator, Ping, RangeFinder,
    SystemClock, Turret,
};
use occgrid::Reading;

#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("scripted {0:?}")]
struct Scripted(FaultKind);

impl DeviceError for Scripted {
    fn kind(&self) -> FaultKind {
        self.0
    }
}

/// Gives its answers one after another, then falls silent.
struct Script {
    answers: Vec<Result<f64, FaultKind>>,
}

impl Script {
    fn next(&mut self) -> Result<f64, Scripted> {
        if self.answers.is_empty() {
            return Err(Scripted(FaultKind::Silent));
        }
        self.answers.remove(0).map_err(Scripted)
    }
}

impl RangeFinder for Script {
    type Error = Scripted;
    fn bearings(&self) -> Bearings {
        Bearings::fixed(0.0)
    }
    fn ping(&mut self, bearing: f64) -> Result<Ping, Scripted> {
        let range = self.next()?;
        Ok(Ping {
            stamp: 0.0,
            bearing,
            settled: true,
            reading: Reading::Echo { range },
        })
    }
}

impl PanActuator for Script {
    type Error = Scripted;
    fn bearings(&self) -> Bearings {
        Bearings {
            from: -1.0,
            to: 1.0,
        }
    }
    fn turn_to(&mut self, bearing: f64) -> Result<f64, Scripted> {
        self.next().map(|lag| bearing + lag)
    }
}

/// One user for any range finder.
fn nearest<R: RangeFinder>(mut sonar: R, bearings: &[f64]) -> Result<f64, R::Error> {
    let mut nearest = f64::INFINITY;
    for bearing in bearings {
        if let Reading::Echo { range } = sonar.ping(*bearing)?.reading {
            nearest = nearest.min(range);
        }
    }
    Ok(nearest)
}

#[test]
fn a_user_takes_devices_borrowed_boxed_and_unnamed() {
    let script = || Script {
        answers: vec![Ok(2.0), Ok(1.5)],
    };
    assert_eq!(nearest(&mut script(), &[0.0, 0.0]), Ok(1.5));
    assert_eq!(nearest(Box::new(script()), &[0.0]), Ok(2.0));
    let unnamed: Box<dyn RangeFinder<Error = Scripted>> = Box::new(script());
    let error = nearest(unnamed, &[0.0, 0.0, 0.0]).unwrap_err();
    assert_eq!(error.kind(), FaultKind::Silent);
}

/// Always the same picture.
struct Still {
    sequence: u64,
}

impl Camera for Still {
    type Error = std::convert::Infallible;
    fn frame(&mut self) -> Result<CameraFrame, Self::Error> {
        self.sequence += 1;
        Ok(CameraFrame {
            stamp: 0.1 * self.sequence as f64,
            sequence: self.sequence,
            image: image::GrayImage::from_pixel(4, 4, image::Luma([7])),
        })
    }
}

/// One user for any camera: whether it is frozen.
fn frozen<C: Camera>(mut camera: C) -> Result<bool, C::Error> {
    let first = camera.frame()?;
    let second = camera.frame()?;
    assert!(second.sequence > first.sequence && second.stamp > first.stamp);
    Ok(first.image == second.image)
}

#[test]
fn one_user_for_any_camera() {
    assert_eq!(frozen(Still { sequence: 0 }), Ok(true));
    assert_eq!(frozen(&mut Box::new(Still { sequence: 0 })), Ok(true));
}

#[test]
fn a_turret_reports_where_the_pan_stands_and_which_part_failed() {
    let mut turret = Turret {
        sonar: Script {
            answers: vec![Ok(3.0), Err(FaultKind::Garbled)],
        },
        pan: Script {
            answers: vec![Ok(0.01), Ok(0.0), Err(FaultKind::Unplugged)],
        },
    };
    assert_eq!(
        turret.bearings(),
        Bearings {
            from: -1.0,
            to: 1.0
        }
    );
    assert!((turret.ping(0.5).unwrap().bearing - 0.51).abs() < 1e-12);
    let sonar = turret.ping(0.0).unwrap_err();
    assert_eq!(
        (sonar.kind(), sonar.to_string()),
        (FaultKind::Garbled, "sonar: scripted Garbled".into())
    );
    let pan = turret.ping(0.0).unwrap_err();
    assert_eq!(
        (pan.kind(), pan.to_string()),
        (FaultKind::Unplugged, "pan: scripted Unplugged".into())
    );
}

#[test]
fn the_system_clock_goes_on() {
    let mut clock = SystemClock::start();
    let before = clock.now();
    for nothing in [0.0, -1.0, f64::NAN] {
        clock.sleep(nothing);
    }
    clock.sleep(0.01);
    assert!(clock.now() >= before + 0.01);
}

#[cfg(feature = "simulation")]
mod simulated {
    use super::*;
    use mobot_hw::sim::{RobotParams, SimFault, Simulation, World};
    use mobot_hw::{DifferentialDrive, Twist2};

    fn simulation() -> Simulation {
        let world = World::from_toml(crate::files::OFFICE).expect("a world");
        Simulation::new(world, RobotParams::default(), 1).expect("it works")
    }

    #[test]
    fn the_same_user_takes_the_simulated_sonar() {
        let range = nearest(simulation().turret(), &[0.0, 1.57, -1.57]).unwrap();
        assert!((range - 0.94).abs() < 0.05, "{range}");
    }

    #[test]
    fn the_same_user_takes_the_simulated_camera() {
        assert_eq!(frozen(simulation().camera()), Ok(false));
    }

    #[test]
    fn bearings_out_of_reach_are_refused() {
        let simulation = simulation();
        let refused = simulation.sonar().ping(0.1).unwrap_err();
        assert!(matches!(refused, SimFault::Bearing { .. }));
        assert_eq!(refused.kind(), FaultKind::Refused);
        assert!(simulation.pan().turn_to(f64::NAN).is_err());
        assert!(simulation.turret().ping(3.2).is_err());
    }

    #[test]
    fn time_passes_only_while_a_device_is_waited_for() {
        let simulation = simulation();
        let now = || simulation.clock().now();
        simulation.sonar().ping(0.0).unwrap();
        assert!((now() - 0.05).abs() < 1e-12);
        simulation.pan().turn_to(1.0).unwrap();
        assert!((now() - 0.27).abs() < 1e-12, "5 rad/s and 20 ms to settle");
        simulation.base().status().unwrap();
        assert!((now() - 0.27).abs() < 1e-12);
    }

    #[test]
    fn a_frame_is_never_stale_and_never_the_same() {
        let simulation = simulation();
        let mut camera = simulation.camera();
        simulation.base().drive(Twist2::new(0.2, 0.3)).unwrap();
        let (mut last, mut stamp) = (None, -1.0);
        for wait in [0.0, 0.0, 0.5, 0.013, 0.0] {
            simulation.clock().sleep(wait);
            let called = simulation.clock().now();
            let frame = camera.frame().unwrap();
            assert!(frame.stamp >= called && frame.stamp <= called + 1.0 / 30.0 + 1e-9);
            assert!(frame.stamp > stamp && Some(frame.sequence) > last);
            (stamp, last) = (frame.stamp, Some(frame.sequence));
            assert!(
                (simulation.clock().now() - frame.stamp - 0.03).abs() < 1e-9,
                "its age is known"
            );
        }
        assert_eq!(
            last.map(|l| l >= 15),
            Some(true),
            "frames not taken are counted"
        );
    }

    #[test]
    fn devices_share_one_robot_through_boxes_too() {
        let simulation = simulation();
        let mut base: Box<dyn DifferentialDrive<Error = SimFault>> = Box::new(simulation.base());
        let mut clock: Box<dyn Clock> = Box::new(simulation.clock());
        let mut camera: Box<dyn Camera<Error = SimFault>> = Box::new(simulation.camera());
        base.drive(Twist2::new(0.3, 0.0)).unwrap();
        clock.sleep(2.0);
        let before = camera.frame().unwrap();
        base.stop().unwrap();
        clock.sleep(1.0);
        assert_ne!(before.image, camera.frame().unwrap().image);
        let rolled = base.status().unwrap().travel.left;
        assert!((rolled - simulation.truth().driven).abs() < 0.02 * rolled);
        assert!(rolled > 0.5);
    }
}
