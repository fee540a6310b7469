//! Recorded and given back.

use std::sync::{Arc, Mutex};

use mobot_hw::wrap::{
    Answer, Asked, Call, Device, Failure, Faulty, FaultyParams, Recorded, Replay, ReplayError,
    Trouble,
};
use mobot_hw::{
    BaseStatus, Camera, Clock, DeviceError, DifferentialDrive, FaultKind, Odometry, PanActuator,
    RangeFinder, Twist2,
};
use occgrid::{Pose2, Reading};

use super::simulation;

/// Devices of any make, and one program for all of them.
struct Robot<R, P, K, B, C> {
    sonar: R,
    pan: P,
    camera: K,
    base: B,
    clock: C,
}

/// All that a program saw and did, in words.
type Story = Vec<String>;

impl<R, P, K, B, C> Robot<R, P, K, B, C>
where
    R: RangeFinder,
    P: PanActuator,
    K: Camera,
    B: DifferentialDrive,
    C: Clock,
{
    /// Turns, listens, looks and drives; what it does depends on everything it is told.
    fn run(&mut self, steps: usize) -> Story {
        let mut story = Vec::new();
        let mut odometry = Odometry::new(Pose2::default(), self.base.track());
        let reach = self.pan.bearings();
        story.push(format!("{reach:?} {:?}", self.sonar.bearings()));
        let mut bearing = 0.0;
        for step in 0..steps {
            let turned = self.pan.turn_to(bearing).map_err(|e| e.kind());
            let ping = self.sonar.ping(0.0).map_err(|e| e.kind());
            let status = self.base.status().map_err(|e| e.kind());
            if let Ok(BaseStatus { travel, .. }) = status {
                odometry.update(travel);
            }
            let range = match ping.map(|p| p.reading) {
                Ok(Reading::Echo { range }) => range,
                _ => 0.3,
            };
            let mut grey = 0.0;
            if step % 4 == 0 {
                match self.camera.frame() {
                    Ok(frame) => {
                        let sum: u64 = frame.image.iter().map(|p| u64::from(*p)).sum();
                        grey = sum as f64 / 1e9;
                        story.push(format!("{} {} {sum}", frame.stamp, frame.sequence));
                    }
                    Err(error) => story.push(format!("{:?}", error.kind())),
                }
            }
            let command = Twist2::new(0.2 * range.min(1.0), 0.1 * range.sin() + grey);
            let driven = self.base.drive(command).map_err(|e| e.kind());
            self.clock.sleep(0.02 + 0.01 * range);
            bearing = (bearing + 1.3 * range).sin() * reach.to.min(1.5);
            let now = self.clock.now();
            story.push(format!(
                "{now} {turned:?} {ping:?} {status:?} {driven:?} {odometry:?}"
            ));
        }
        let _ = self.base.stop();
        story
    }
}

/// The simulated robot, every device failing now and then, recorded.
fn recorded(seed: u64, steps: usize) -> (Story, Vec<Call>) {
    let simulation = simulation(seed);
    let calls: Arc<Mutex<Vec<Call>>> = Arc::default();
    let faulty = |k: u64| {
        let troubles = [
            Trouble::Drop { share: 0.2 },
            Trouble::Stuck,
            Trouble::Garbage { share: 0.3 },
            Trouble::Delayed { seconds: 0.2 },
            Trouble::Wrong { by: 0.2 },
        ];
        FaultyParams {
            failures: vec![Failure {
                trouble: troubles[((seed + k) % 5) as usize],
                from: 0.3,
                until: 1.5,
            }],
            seed,
            ..FaultyParams::default()
        }
    };
    let clock = simulation.clock();
    let on_tape = || calls.clone();
    let mut robot = Robot {
        sonar: Recorded::new(
            Faulty::new(simulation.sonar(), clock.clone(), faulty(0)),
            on_tape(),
        ),
        pan: Recorded::new(
            Faulty::new(simulation.pan(), clock.clone(), faulty(1)),
            on_tape(),
        ),
        camera: Recorded::new(
            Faulty::new(simulation.camera(), clock.clone(), faulty(2)),
            on_tape(),
        ),
        base: Recorded::new(
            Faulty::new(simulation.base(), clock.clone(), faulty(3)),
            on_tape(),
        ),
        clock: Recorded::new(clock.clone(), on_tape()),
    };
    let story = robot.run(steps);
    let calls = calls.lock().expect("no panic").clone();
    (story, calls)
}

fn replayed(replay: &Replay, steps: usize) -> Story {
    let device = || replay.clone();
    Robot {
        sonar: device(),
        pan: device(),
        camera: device(),
        base: device(),
        clock: device(),
    }
    .run(steps)
}

#[test]
fn a_replay_leads_to_the_same_decisions_faults_and_all() {
    let mut faults = 0;
    for seed in 0..25 {
        let (story, calls) = recorded(seed, 30);
        let failed = |call: &&Call| matches!(call.answer, Answer::Fault(_));
        faults += calls.iter().filter(failed).count();
        let replay = Replay::of(calls.clone());
        assert_eq!(replayed(&replay, 30), story, "seed {seed}");
        assert_eq!(replay.ended(), None);
        assert_eq!(replay.played(), calls.len() as u64);
    }
    assert!(faults > 25, "{faults}");
}

#[test]
fn one_device_replays_alone_beside_live_ones() {
    let (_, calls) = recorded(3, 20);
    let all: Vec<Call> = calls.clone();
    let source = calls.into_iter().map(Ok::<_, std::convert::Infallible>);
    let mut base = Replay::only(Device::Base, source);
    let of_base = all.iter().filter(|c| c.asked.device() == Device::Base);
    let mut asked = 0;
    for call in of_base {
        asked += 1;
        match (call.asked, &call.answer) {
            (Asked::Track, Answer::Track(track)) => {
                assert_eq!(base.track().to_bits(), track.to_bits());
            }
            (Asked::Status, Answer::Status(status)) => {
                assert_eq!(base.status().as_ref(), Ok(status))
            }
            (Asked::Drive(command), Answer::Done) => assert_eq!(base.drive(command), Ok(())),
            (Asked::Stop, Answer::Done) => assert_eq!(base.stop(), Ok(())),
            (Asked::Status, Answer::Fault(fault)) => {
                let error = base.status().unwrap_err();
                assert_eq!(
                    (error.kind(), error.to_string()),
                    (fault.kind, fault.message.clone())
                );
            }
            (Asked::Drive(command), Answer::Fault(fault)) => {
                assert_eq!(
                    base.drive(command),
                    Err(ReplayError::Recorded(fault.clone()))
                );
            }
            other => panic!("{other:?}"),
        }
    }
    assert!(asked > 40, "{asked}");
    assert_eq!(base.ended(), None);
}

fn call(asked: Asked, answer: Answer) -> Call {
    Call { asked, answer }
}

#[test]
fn another_question_is_an_error_and_stays_one() {
    let command = Twist2::new(0.1, 0.0);
    let calls = vec![
        call(Asked::Drive(command), Answer::Done),
        call(Asked::Drive(command), Answer::Done),
        call(Asked::Stop, Answer::Done),
    ];
    let mut base = Replay::of(calls);
    assert_eq!(base.drive(command), Ok(()));
    // one bit of one number
    let other = Twist2::new(f64::from_bits(0.1_f64.to_bits() + 1), 0.0);
    let error = base.drive(other).unwrap_err();
    assert_eq!(error.kind(), FaultKind::Refused);
    assert_eq!(
        error.to_string(),
        "call 1 of the recording: expected drive 0.1 m/s 0 rad/s, found drive 0.10000000000000002 m/s 0 rad/s"
    );
    assert_eq!(base.drive(command), Err(error.clone()));
    assert_eq!(base.stop(), Err(error.clone()));
    assert_eq!((base.ended(), base.played()), (Some(error), 1));
}

#[test]
fn minus_zero_and_nan_are_numbers_of_their_own() {
    let ask = |recorded: f64, now: f64| {
        let mut sonar = Replay::of(vec![call(
            Asked::Ping { bearing: recorded },
            Answer::Fault(mobot_hw::wrap::Fault {
                kind: FaultKind::Silent,
                message: String::new(),
            }),
        )]);
        sonar.ping(now).unwrap_err()
    };
    assert_eq!(ask(f64::NAN, f64::NAN).kind(), FaultKind::Silent);
    assert_eq!(ask(-0.0, 0.0).kind(), FaultKind::Refused);
}

#[test]
fn the_end_is_an_error_and_time_goes_on() {
    let mut replay = Replay::of(vec![call(Asked::Now, Answer::Now(7.5))]);
    assert_eq!(replay.now().to_bits(), 7.5_f64.to_bits());
    let error = replay.frame().unwrap_err();
    assert_eq!(error.kind(), FaultKind::Unplugged);
    assert_eq!(
        error.to_string(),
        "the recording ends after 1 calls; asked: frame"
    );
    replay.sleep(1.0);
    let began = replay.now();
    assert!(began > 8.5);
    let waited = (0..10_000)
        .take_while(|_| replay.now() < began + 2.0)
        .count();
    assert!(waited < 10_000, "a loop that waits for a time ends");
}

#[test]
fn a_recording_that_cannot_be_read_says_where() {
    let calls = [
        Ok(call(Asked::Stop, Answer::Done)),
        Err("a torn record"),
        Ok(call(Asked::Stop, Answer::Done)),
    ];
    let mut base = Replay::new(calls);
    assert_eq!(base.stop(), Ok(()));
    let error = base.stop().unwrap_err();
    assert_eq!(error.kind(), FaultKind::System);
    assert_eq!(error.to_string(), "call 1 of the recording: a torn record");
    assert_eq!(base.stop(), Err(error));
    // an answer to something else
    let mut clock = Replay::of(vec![call(Asked::Stop, Answer::Now(1.0))]);
    let error = clock.stop().unwrap_err();
    assert_eq!(error.kind(), FaultKind::System);
    assert_eq!(clock.ended(), Some(error));
}

#[test]
fn an_error_is_handed_on_as_it_is_and_recorded() {
    let simulation = simulation(1);
    let calls: Mutex<Vec<Call>> = Mutex::default();
    let mut sonar = Recorded::new(simulation.sonar(), &calls);
    let error = sonar.ping(2.0).unwrap_err();
    assert_eq!(error, simulation.sonar().ping(2.0).unwrap_err());
    let calls = calls.lock().expect("no panic");
    let Answer::Fault(fault) = &calls[0].answer else {
        panic!("{calls:?}");
    };
    assert_eq!(
        (fault.kind, fault.to_string()),
        (FaultKind::Refused, error.to_string())
    );
}
