//! Devices that fail as planned.

use mobot_hw::sim::{SimClock, Simulation};
use mobot_hw::wrap::{Failure, Faulty, FaultyError, FaultyParams, Trouble};
use mobot_hw::{
    Camera, Clock, DeviceError, DifferentialDrive, FaultKind, PanActuator, RangeFinder, Twist2,
};
use occgrid::Reading;

use super::simulation;

/// From 1 s to 2 s.
fn for_a_second(trouble: Trouble) -> FaultyParams {
    FaultyParams {
        failures: vec![Failure {
            trouble,
            from: 1.0,
            until: 2.0,
        }],
        ..FaultyParams::default()
    }
}

fn faulty<D>(simulation: &Simulation, device: D, trouble: Trouble) -> Faulty<D, SimClock> {
    Faulty::new(device, simulation.clock(), for_a_second(trouble))
}

fn until(simulation: &Simulation, time: f64) {
    let mut clock = simulation.clock();
    clock.sleep(time - clock.now());
}

fn range<R: RangeFinder>(sonar: &mut R) -> Result<f64, FaultKind> {
    match sonar.ping(0.0).map_err(|e| e.kind())?.reading {
        Reading::Echo { range } => Ok(range),
        // now and then an echo is missed
        Reading::NoEcho { listened } => Ok(listened),
        other => panic!("{other:?}"),
    }
}

/// What a device answers before, in, and after the trouble.
fn three<T>(simulation: &Simulation, mut ask: impl FnMut() -> T) -> [T; 3] {
    [0.5, 1.2, 2.2].map(|time| {
        until(simulation, time);
        ask()
    })
}

#[test]
fn off_and_unplugged_are_silence_after_the_timeout_and_absence_at_once() {
    for (trouble, kind, waits) in [
        (Trouble::Off, FaultKind::Silent, 0.1),
        (Trouble::Drop { share: 1.0 }, FaultKind::Silent, 0.1),
        (Trouble::Unplug, FaultKind::Unplugged, 0.0),
    ] {
        let simulation = simulation(1);
        let mut sonar = faulty(&simulation, simulation.sonar(), trouble);
        let mut pan = faulty(&simulation, simulation.pan(), trouble);
        let mut camera = faulty(&simulation, simulation.camera(), trouble);
        let mut base = faulty(&simulation, simulation.base(), trouble);
        let all = three(&simulation, || {
            let clock = simulation.clock();
            let mut took = [0.0; 4];
            let mut ask = |k: usize, call: &mut dyn FnMut() -> Option<FaultKind>| {
                let called = clock.now();
                let fault = call();
                took[k] = clock.now() - called;
                fault
            };
            let faults = [
                ask(0, &mut || sonar.ping(0.0).err().map(|e| e.kind())),
                ask(1, &mut || pan.turn_to(0.1).err().map(|e| e.kind())),
                ask(2, &mut || camera.frame().err().map(|e| e.kind())),
                ask(3, &mut || base.status().err().map(|e| e.kind())),
            ];
            (faults, took)
        });
        assert_eq!(all.map(|a| a.0), [[None; 4], [Some(kind); 4], [None; 4]]);
        for took in all[1].1 {
            assert!((took - waits).abs() < 1e-9, "{trouble:?} {took}");
        }
    }
}

#[test]
fn a_base_that_cannot_be_reached_drives_on() {
    for trouble in [Trouble::Off, Trouble::Unplug, Trouble::Freeze] {
        let simulation = simulation(1);
        let mut base = faulty(&simulation, simulation.base(), trouble);
        base.drive(Twist2::new(0.2, 0.0)).unwrap();
        until(&simulation, 1.0);
        let stopped = base.stop();
        assert_eq!(stopped.is_ok(), trouble == Trouble::Freeze);
        until(&simulation, 1.9);
        let speed = simulation.truth().twist.linear;
        assert!((speed - 0.2).abs() < 0.01, "{speed}");
        until(&simulation, 2.0);
        base.stop().unwrap();
        until(&simulation, 3.0);
        assert!(simulation.truth().twist.linear.abs() < 1e-9);
    }
}

#[test]
fn stuck_says_the_same_with_fresh_stamps_and_freeze_with_old_ones() {
    for (trouble, fresh) in [(Trouble::Stuck, true), (Trouble::Freeze, false)] {
        let simulation = simulation(1);
        let mut sonar = faulty(&simulation, simulation.sonar(), trouble);
        let mut camera = faulty(&simulation, simulation.camera(), trouble);
        let mut base = faulty(&simulation, simulation.base(), trouble);
        base.drive(Twist2::new(0.3, 0.1)).unwrap();
        let [before, inside, after] = three(&simulation, || {
            (
                sonar.ping(0.0).unwrap(),
                camera.frame().unwrap(),
                base.status().unwrap(),
            )
        });
        assert_eq!(before.0.reading, inside.0.reading);
        assert_ne!(before.0.reading, after.0.reading);
        assert_eq!(inside.0.stamp > before.0.stamp, fresh);
        assert_eq!(before.1.image, inside.1.image);
        assert_ne!(before.1.image, after.1.image);
        assert_eq!(inside.1.stamp > before.1.stamp, fresh);
        assert_eq!(inside.1.sequence > before.1.sequence, fresh);
        assert_eq!(before.2.travel, inside.2.travel);
        assert!(after.2.travel.left > before.2.travel.left + 0.3);
        assert_eq!(inside.2.stamp > before.2.stamp, fresh);
    }
}

#[test]
fn a_stuck_pan_says_where_it_stands_and_a_frozen_or_wrong_one_lies() {
    for (trouble, says, points) in [
        (Trouble::Stuck, 0.0, 0.0),
        (Trouble::Freeze, 1.0, 0.0),
        (Trouble::Wrong { by: 0.2 }, 1.0, 1.2),
    ] {
        let simulation = simulation(1);
        let mut pan = faulty(&simulation, simulation.pan(), trouble);
        until(&simulation, 1.1);
        let called = simulation.clock().now();
        let said = pan.turn_to(1.0).unwrap();
        assert!((said - says).abs() < 1e-12, "{trouble:?} {said}");
        // 5 rad/s and 20 ms to settle tell how far it turned
        let took = simulation.clock().now() - called;
        let turn = if points > 0.0 {
            points / 5.0 + 0.02
        } else {
            0.0
        };
        assert!((took - turn).abs() < 1e-9, "{trouble:?} {took}");
    }
}

#[test]
fn garbage_is_garbled_or_noise_as_often_as_told() {
    let simulation = simulation(1);
    let params = FaultyParams {
        failures: vec![Failure::from(Trouble::Garbage { share: 0.3 }, 0.0)],
        ..FaultyParams::default()
    };
    let mut sonar = Faulty::new(simulation.sonar(), simulation.clock(), params.clone());
    let garbled = (0..1000).filter(|_| range(&mut sonar) == Err(FaultKind::Garbled));
    let share = garbled.count() as f64 / 1000.0;
    assert!((share - 0.3).abs() < 0.05, "{share}");

    let mut camera = faulty(
        &simulation,
        simulation.camera(),
        Trouble::Garbage { share: 1.0 },
    );
    // this clock has gone past the trouble; another simulation has not
    let clean = camera.frame().unwrap().image;
    let other = super::simulation(1);
    let mut camera = faulty(&other, other.camera(), Trouble::Garbage { share: 1.0 });
    until(&other, 1.1);
    let noise = camera.frame().unwrap().image;
    let spread = |image: &image::GrayImage| {
        let n = image.len() as f64;
        let mean = image.iter().map(|p| f64::from(*p)).sum::<f64>() / n;
        let square = image.iter().map(|p| (f64::from(*p) - mean).powi(2));
        (square.sum::<f64>() / n).sqrt()
    };
    assert_eq!(clean.dimensions(), noise.dimensions());
    // even over 0 to 255
    assert!((spread(&noise) - 73.9).abs() < 1.0, "{}", spread(&noise));
    assert!(spread(&clean) < 60.0);
}

#[test]
fn wrong_is_plausible() {
    let simulation = simulation(1);
    let mut sonar = faulty(&simulation, simulation.sonar(), Trouble::Wrong { by: 0.6 });
    let mut camera = faulty(&simulation, simulation.camera(), Trouble::Wrong { by: 0.1 });
    let mut base = faulty(&simulation, simulation.base(), Trouble::Wrong { by: 0.1 });
    until(&simulation, 1.0);
    let truth = range(&mut simulation.sonar()).unwrap();
    for _ in 0..10 {
        let found = range(&mut sonar).unwrap();
        assert!(
            found > 0.97 * truth && found < 1.63 * truth,
            "{found} {truth}"
        );
    }
    let (slid, level) = (
        camera.frame().unwrap(),
        simulation.camera().frame().unwrap(),
    );
    let down = (f64::from(level.image.height()) * 0.1).round() as u32;
    let differ = (down..level.image.height())
        .map(|y| {
            let a = i32::from(slid.image.get_pixel(100, y)[0]);
            let b = i32::from(level.image.get_pixel(100, y - down)[0]);
            (a - b).abs()
        })
        .max()
        .unwrap();
    assert!(differ < 30, "the same picture but for its noise: {differ}");

    base.status().unwrap();
    base.drive(Twist2::new(0.3, 0.0)).unwrap();
    until(&simulation, 1.99);
    let inside = base.status().unwrap().travel;
    assert!(
        (inside.left / inside.right - 1.1).abs() < 0.02,
        "{inside:?}"
    );
    until(&simulation, 3.0);
    let after = base.status().unwrap().travel;
    let left = after.left - inside.left;
    let right = after.right - inside.right;
    assert!((left / right - 1.0).abs() < 0.02, "no jump when it is over");
}

#[test]
fn slow_takes_longer_and_delayed_gives_what_is_old() {
    let simulation = simulation(1);
    let mut sonar = faulty(
        &simulation,
        simulation.sonar(),
        Trouble::Slow { factor: 2.0 },
    );
    let took = three(&simulation, || {
        let called = simulation.clock().now();
        sonar.ping(0.0).unwrap();
        simulation.clock().now() - called
    });
    assert!((took[1] - 2.0 * took[0]).abs() < 1e-9, "{took:?}");
    assert!((took[2] - took[0]).abs() < 1e-9, "{took:?}");

    let simulation = super::simulation(1);
    let delayed = Trouble::Delayed { seconds: 0.2 };
    let mut sonar = faulty(&simulation, simulation.sonar(), delayed);
    let mut base = faulty(&simulation, simulation.base(), delayed);
    let mut oldest = 0.0_f64;
    while simulation.clock().now() < 1.95 {
        let now = simulation.clock().now();
        let age = now - sonar.ping(0.0).unwrap().stamp;
        if now > 1.0 {
            assert!((0.15..0.35).contains(&age), "{age}");
            oldest = oldest.max(age);
        }
    }
    assert!(oldest > 0.2);
    let simulation = super::simulation(1);
    let mut late = faulty(&simulation, simulation.base(), delayed);
    until(&simulation, 1.0);
    late.drive(Twist2::new(0.2, 0.0)).unwrap();
    let mut moved = None;
    while simulation.clock().now() < 1.6 {
        let _ = late.status();
        simulation.clock().sleep(0.01);
        if moved.is_none() && simulation.truth().twist.linear > 0.0 {
            moved = Some(simulation.clock().now());
        }
    }
    let moved = moved.expect("it arrives");
    assert!((1.2..1.25).contains(&moved), "{moved}");
    base.stop().unwrap();
}

#[test]
fn intermittent_goes_off_and_on_by_turns() {
    let simulation = simulation(1);
    let params = FaultyParams {
        failures: vec![Failure::from(Trouble::Intermittent { seconds: 1.0 }, 1.0)],
        ..FaultyParams::default()
    };
    let mut sonar = Faulty::new(simulation.sonar(), simulation.clock(), params);
    let works = [0.5, 1.5, 2.5, 3.5, 4.5].map(|time| {
        until(&simulation, time);
        sonar.ping(0.0).is_ok()
    });
    assert_eq!(works, [true, false, true, false, true]);
}

#[test]
fn a_clock_loses_time_and_never_goes_back() {
    for (trouble, lost) in [
        (Trouble::Freeze, 1.0),
        (Trouble::Slow { factor: 4.0 }, 0.75),
        (Trouble::Off, 0.0),
    ] {
        let simulation = simulation(1);
        let mut clock = faulty(&simulation, simulation.clock(), trouble);
        let mut last = 0.0;
        for _ in 0..300 {
            clock.sleep(0.01);
            assert!(clock.now() >= last);
            last = clock.now();
        }
        assert!(
            (simulation.clock().now() - last - lost).abs() < 1e-9,
            "{trouble:?}"
        );
    }
}

#[test]
fn the_same_seed_fails_the_same_way() {
    let run = |seed: u64| {
        let simulation = simulation(1);
        let params = FaultyParams {
            failures: vec![
                Failure {
                    trouble: Trouble::Drop { share: 0.5 },
                    from: 0.0,
                    until: 3.0,
                },
                Failure::from(Trouble::Garbage { share: 0.5 }, 0.0),
            ],
            seed,
            ..FaultyParams::default()
        };
        let mut sonar = Faulty::new(simulation.sonar(), simulation.clock(), params);
        let kinds: Vec<_> = (0..100).map(|_| range(&mut sonar)).collect();
        (kinds, sonar.params().at(10.0))
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1).0, run(2).0);
    assert_eq!(run(1).1, Some(Trouble::Garbage { share: 0.5 }));
}

#[test]
fn a_device_s_own_errors_pass() {
    let simulation = simulation(1);
    let mut sonar = faulty(&simulation, simulation.sonar(), Trouble::Off);
    let own = simulation.sonar().ping(2.0).unwrap_err();
    let through = sonar.ping(2.0).unwrap_err();
    assert_eq!(through, FaultyError::Device(own));
    assert_eq!(through.to_string(), own.to_string());
    until(&simulation, 1.0);
    let injected = sonar.ping(0.0).unwrap_err();
    assert_eq!(injected.to_string(), "injected: Silent");
    assert_eq!(sonar.device().ping(2.0), Err(own));
}
