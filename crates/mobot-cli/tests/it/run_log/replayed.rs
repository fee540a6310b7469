//! A run from its log.

use std::sync::Arc;

use mobot_cli::run_log::{
    Decision, DecisionCheck, LogWriter, Message, Recordings, replay, replay_all,
};
use mobot_hw::sim::{RobotParams, Simulation, World};
use mobot_hw::wrap::{Answer, Asked, Call, Device, Recorded, Replay, Sink as _};
use mobot_hw::{
    Camera, Clock, DeviceError as _, DifferentialDrive, FaultKind, RangeFinder, Twist2,
};
use occgrid::Reading;

use super::{Dice, Memory, any_call, entries, params};

/// Asks a replay what a call asked; what it says, bit for bit, in words.
fn ask(replay: &mut Replay, asked: Asked) -> String {
    fn words<T: std::fmt::Debug>(result: Result<T, impl std::fmt::Display>) -> String {
        match result {
            Ok(value) => format!("{value:?}"),
            Err(error) => format!("error {error}"),
        }
    }
    match asked {
        Asked::RangeBearings => format!("{:?}", RangeFinder::bearings(replay)),
        Asked::Ping { bearing } => words(replay.ping(bearing)),
        Asked::PanBearings => format!("{:?}", mobot_hw::PanActuator::bearings(replay)),
        Asked::TurnTo { bearing } => words(mobot_hw::PanActuator::turn_to(replay, bearing)),
        Asked::Frame => words(replay.frame()),
        Asked::Track => format!("{:?}", replay.track()),
        Asked::Drive(twist) => words(replay.drive(twist)),
        Asked::Stop => words(replay.stop()),
        Asked::Status => words(replay.status()),
        Asked::Now => format!("{:?}", replay.now()),
        Asked::Sleep { seconds } => {
            replay.sleep(seconds);
            "slept".into()
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn any_call_comes_back_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("calls.mcap");
    let mut dice = Dice(1);
    let calls: Vec<Call> = (0..20_000).map(|_| any_call(&mut dice)).collect();
    let log = LogWriter::create(&path, params()).unwrap();
    for call in &calls {
        log.take(call.clone());
    }
    log.finish().unwrap();
    let mut from_memory = Replay::of(calls.clone());
    let mut from_file = replay_all(&path).unwrap();
    let (mut faults, mut frames) = (0, 0);
    for (i, call) in calls.iter().enumerate() {
        // a fault to a question that cannot fail ends the tape; such calls no device makes
        let cannot_fail = matches!(
            call.asked,
            Asked::RangeBearings
                | Asked::PanBearings
                | Asked::Track
                | Asked::Now
                | Asked::Sleep { .. }
        );
        let expected = ask(&mut from_memory, call.asked);
        let found = ask(&mut from_file, call.asked);
        assert_eq!(expected, found, "call {i} {call:?}");
        faults += u32::from(matches!(call.answer, Answer::Fault(_)) && !cannot_fail);
        frames += u32::from(matches!(call.answer, Answer::Frame(_)));
    }
    assert!(faults > 500 && frames > 500, "{faults} {frames}");
    assert_eq!(from_file.played(), 20_000);
    assert_eq!(from_file.ended(), None);
}

/// NaN is not itself, and words have only one for it: bits in the file are compared as bits.
#[test]
fn every_nan_keeps_its_bits() {
    let bits = [
        0x7ff8_0000_0000_0001_u64,
        0xfff4_dead_beef_0000,
        0x7ff0_0000_0000_0001,
    ];
    let memory = Memory::default();
    let log = LogWriter::to(Box::new(memory.clone()), params()).unwrap();
    for bits in bits {
        log.take(Call {
            asked: Asked::Now,
            answer: Answer::Now(f64::from_bits(bits)),
        });
    }
    log.finish().unwrap();
    let found: Vec<u64> = entries(&memory.bytes())
        .into_iter()
        .filter_map(|message| match message {
            Message::Call(call) => Some(call.numbers[0].to_bits()),
            _ => None,
        })
        .collect();
    assert_eq!(found, bits);
}

/// A small program: keeps off the wall, looks now and then. Tells its decisions.
fn run<R, K, B, C>(
    mut sonar: R,
    mut camera: K,
    mut base: B,
    mut clock: C,
    gain: f64,
    mut decided: impl FnMut(Decision),
) where
    R: RangeFinder,
    K: Camera,
    B: DifferentialDrive,
    C: Clock,
{
    for step in 0..60 {
        let bearing = 0.4 * f64::from(step % 3) - 0.4;
        let range = match sonar.ping(bearing).map(|ping| ping.reading) {
            Ok(Reading::Echo { range }) => range,
            _ => 0.0,
        };
        let mut grey = 0.0;
        if step % 10 == 0
            && let Ok(frame) = camera.frame()
        {
            grey = frame.image.iter().map(|p| f64::from(*p)).sum::<f64>() * 1e-9;
        }
        let travel = base.status().map(|s| s.travel.left).unwrap_or(-1.0);
        let command = Twist2::new(gain * range, grey + 0.01 * travel);
        let sent = base.drive(command).is_ok();
        let time = clock.now();
        decided(Decision {
            kind: "command".into(),
            time,
            numbers: vec![command.linear, command.angular],
            text: sent.to_string(),
        });
        clock.sleep(0.02);
    }
}

fn simulation() -> Simulation {
    let world = World::from_toml(
        "start = [1.0, 0.0, 0.0]
         walls = [{ from = [4, -2], to = [4, 2] }, { from = [0, 2], to = [4, 2] }]",
    )
    .expect("it works");
    Simulation::new(world, RobotParams::default(), 7).expect("it works")
}

#[test]
fn the_same_program_decides_the_same_from_the_log_and_another_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let log = Arc::new(LogWriter::create(&path, params()).unwrap());
    let robot = simulation();
    run(
        Recorded::new(robot.turret(), log.clone()),
        Recorded::new(robot.camera(), log.clone()),
        Recorded::new(robot.base(), log.clone()),
        Recorded::new(robot.clock(), log.clone()),
        0.1,
        |decision| log.decision(&decision),
    );
    log.finish().unwrap();
    let logged: Vec<Decision> = entries(&std::fs::read(&path).unwrap())
        .into_iter()
        .filter_map(|message| match message {
            Message::Decision(decision) => Some(decision),
            _ => None,
        })
        .collect();
    assert_eq!(logged.len(), 60);

    let again = |gain: f64| {
        let replay = replay_all(&path).unwrap();
        let mut check = DecisionCheck::new(logged.iter().cloned());
        let device = || replay.clone();
        run(device(), device(), device(), device(), gain, |decision| {
            check.made(decision);
        });
        (check.finish(), replay.ended())
    };
    let (verdict, ended) = again(0.1);
    assert_eq!((verdict.equal, verdict.difference, ended), (60, None, None));
    // the smallest change there is
    let (verdict, ended) = again(0.1_f64.next_up());
    let difference = verdict.difference.expect("another decision");
    assert!(
        difference
            .to_string()
            .starts_with("decision 0: expected command at "),
        "{difference}"
    );
    let ended = ended.expect("another question");
    assert_eq!(ended.kind(), FaultKind::Refused);
}

/// The mission's own loop, from the log.
mod mission {
    use mobot_cli::nav::{
        Action, Behaviour, Devices, Observation, Outcome, Runner, RunnerParams, StopCause,
    };
    use mobot_cli::run_log::Verdict;
    use mobot_hw::wrap::Fault;
    use occgrid::Pose2;

    use super::*;

    /// On until something is ahead, a turn, and on.
    struct Onward {
        turned: u32,
        speed: f64,
    }

    impl Behaviour for Onward {
        fn step(&mut self, seen: &Observation<'_>) -> Action {
            if self.turned > 40 {
                return Action::done(Outcome::Done);
            }
            if self.turned > 0 || matches!(seen.stopped, Some(StopCause::Obstacle { .. })) {
                self.turned += 1;
                return Action::drive(Twist2::new(0.0, 0.5));
            }
            Action::drive(Twist2::new(self.speed, 0.0))
        }
    }

    fn logged(path: &std::path::Path) -> Vec<Decision> {
        entries(&std::fs::read(path).expect("it works"))
            .into_iter()
            .filter_map(|message| match message {
                Message::Decision(decision) => Some(decision),
                _ => None,
            })
            .collect()
    }

    fn record(path: &std::path::Path) {
        let robot = simulation();
        let log = Arc::new(LogWriter::create(path, params()).expect("it works"));
        let devices = Devices {
            base: Recorded::new(robot.base(), log.clone()),
            sonar: Recorded::new(robot.turret(), log.clone()),
            camera: Some(Recorded::new(robot.camera(), log.clone())),
            clock: Recorded::new(robot.clock(), log.clone()),
        };
        let start = robot.truth().map_from_base;
        let mut runner = Runner::new(devices, start, RunnerParams::default()).expect("it works");
        let mut behaviour = Onward {
            turned: 0,
            speed: 0.3,
        };
        let late = || robot.truth().time > 60.0;
        let outcome = runner.run(&mut behaviour, &mut &*log, &late);
        assert_eq!(outcome, Outcome::Done);
        log.finish().expect("it works");
    }

    fn again(path: &std::path::Path, speed: f64) -> (Verdict, Option<Fault>) {
        let replay = replay_all(path).expect("it works");
        let devices = Devices {
            base: replay.clone(),
            sonar: replay.clone(),
            camera: Some(replay.clone()),
            clock: replay.clone(),
        };
        let start = Pose2::new(1.0, 0.0, 0.0);
        let mut runner = Runner::new(devices, start, RunnerParams::default()).expect("it works");
        let mut check = DecisionCheck::new(logged(path).into_iter());
        let mut behaviour = Onward { turned: 0, speed };
        runner.run(&mut behaviour, &mut check, &|| replay.ended().is_some());
        (check.finish_early(), replay.ended().map(|e| Fault::of(&e)))
    }

    #[test]
    fn the_mission_s_loop_decides_the_same_from_its_log() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        record(&path);
        let (verdict, ended) = again(&path, 0.3);
        assert_eq!((&verdict.difference, ended), (&None, None));
        assert_eq!(verdict.equal, logged(&path).len() as u64);
        assert!(
            verdict.is_equal() && verdict.equal > 200,
            "{}",
            verdict.equal
        );

        let (verdict, ended) = again(&path, 0.3_f64.next_up());
        assert!(!verdict.is_equal());
        assert!(ended.is_some());
    }

    /// What is left of a run that was killed leads to the same decisions as far as it goes.
    #[test]
    fn a_cut_log_leads_to_the_same_decisions_as_far_as_it_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        record(&path);
        let bytes = std::fs::read(&path).unwrap();
        let mut dice = Dice(2);
        for _ in 0..20 {
            let length = bytes.len() / 10 + dice.below(bytes.len() as u64 * 9 / 10) as usize;
            std::fs::write(&path, &bytes[..length]).unwrap();
            let (verdict, ended) = again(&path, 0.3);
            let logged = logged(&path).len() as u64;
            assert!(ended.is_some() || length > bytes.len() * 9 / 10);
            // all that the log knows was decided again; past its end there may be more
            assert_eq!(verdict.equal, logged, "{:?}", verdict.difference);
        }
    }
}

#[test]
fn a_log_that_goes_on_or_ends_early_is_a_difference() {
    let decision = |time| Decision {
        kind: "stop".into(),
        time,
        numbers: vec![],
        text: "why".into(),
    };
    let logged = [decision(1.0), decision(2.0)];
    let verdict = |made: &[f64]| {
        let mut check = DecisionCheck::new(logged.iter().cloned());
        for time in made {
            check.made(decision(*time));
        }
        let verdict = check.finish();
        (verdict.equal, verdict.difference.map(|d| d.to_string()))
    };
    assert_eq!(verdict(&[1.0, 2.0]), (2, None));
    let line = "decision 1: expected stop at 2 s \"why\", found no more";
    assert_eq!(verdict(&[1.0]), (1, Some(line.into())));
    let line = "decision 2: expected no more, found stop at 3 s \"why\"";
    assert_eq!(verdict(&[1.0, 2.0, 3.0]), (2, Some(line.into())));
    let line = "decision 0: expected stop at 1 s \"why\", found stop at 1.5 s \"why\"";
    assert_eq!(verdict(&[1.5, 2.0]), (0, Some(line.into())));
    let check = DecisionCheck::new(logged.iter().cloned());
    assert_eq!(check.finish_early().difference, None);
}

#[test]
fn devices_share_a_recording_and_replay_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shared.mcap");
    let mut recordings = Recordings::default();
    let robot = simulation();
    let mut sonar = Recorded::new(robot.turret(), recordings.at(&path).unwrap());
    let mut base = Recorded::new(robot.base(), recordings.at(&path).unwrap());
    let ping = sonar.ping(0.0).unwrap();
    let status = base.status().unwrap();
    let second = sonar.ping(0.5).unwrap();
    recordings.finish().unwrap();

    let mut sonar = replay(&path, Device::RangeFinder).unwrap();
    assert_eq!(sonar.ping(0.0), Ok(ping));
    assert_eq!(sonar.ping(0.5), Ok(second));
    let error = sonar.ping(0.5).unwrap_err();
    assert_eq!(error.kind(), FaultKind::Unplugged);
    let mut base = replay(&path, Device::Base).unwrap();
    assert_eq!(base.status(), Ok(status));
    let missing = replay(&folder.path().join("none.mcap"), Device::Base).unwrap_err();
    assert!(missing.to_string().contains("No such file"), "{missing}");
}
