//! The run log: what goes in comes out, here and in other people's readers, whole or cut off.

mod again;
mod cut;
mod foreign;
mod hostile;
mod recipe;
mod replayed;
mod written;

use std::io::Write;
use std::sync::{Arc, Mutex};

use image::{GrayImage, Luma};
use mobot_cli::run_log::{
    Decision, Level, LogParams, LogReader, LogWriter, Message, SonarFrame, Stamps,
};
use mobot_hw::wrap::{Answer, Asked, Call, Fault, Sink as _};
use mobot_hw::{BaseStatus, CameraFrame, FaultKind, Ping, Twist2, WheelTravel};
use occgrid::{MapFrame, OccupancyGrid, Point2, Pose2, Reading};

/// 25 November 2026, 6 o'clock, and a bit [ns].
pub(crate) const START: u64 = 1_795_586_400_123_456_789;

pub(crate) fn params() -> LogParams {
    LogParams {
        stamps: Stamps::From(START),
        sonar: SonarFrame::default(),
    }
}

/// Bytes in memory that outlive their writer.
#[derive(Clone, Default)]
pub(crate) struct Memory(Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().expect("no panic").extend_from_slice(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Memory {
    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.0.lock().expect("no panic").clone()
    }
}

/// SplitMix64.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
    pub(crate) fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }
    /// Any bits at all: infinities, subnormals, every NaN.
    pub(crate) fn number(&mut self) -> f64 {
        match self.below(8) {
            0 => f64::NAN,
            1 => f64::NEG_INFINITY,
            2 => -0.0,
            3 => 5e-324,
            _ => f64::from_bits(self.next()),
        }
    }
}

pub(crate) fn picture(seed: u64) -> GrayImage {
    let mut dice = Dice(seed);
    GrayImage::from_fn(24, 10, |x, y| {
        Luma([(x * 9 + y) as u8 ^ (dice.next() & 7) as u8])
    })
}

pub(crate) fn small_map() -> OccupancyGrid {
    let frame = MapFrame::new(3, 2, 0.05, Pose2::new(-1.0, 2.0, 0.5)).expect("a frame");
    // the upper row first: occupied, unknown, free
    let odds = vec![4.0, 0.0, -4.0, 0.0, 1.0, -1.0];
    OccupancyGrid::from_log_odds(frame, odds).expect("a grid")
}

/// A second of a run, at 20 steps a second, with something on every topic.
pub(crate) fn second(log: &LogWriter, second: u32) {
    for step in 0..20 {
        let count = second * 20 + step;
        let now = f64::from(count) * 0.05;
        log.tick(now);
        let pose = Pose2::new(0.1 * now, -0.2, 0.3);
        log.pose(
            now,
            pose,
            &[[0.01, 0.001, 0.0], [0.001, 0.02, 0.0], [0.0, 0.0, 0.003]],
        );
        log.odometry(now, pose, Twist2::new(0.1, 0.05));
        let reading = match step {
            1 => Reading::NoEcho { listened: 4.0 },
            2 => Reading::TooClose,
            3 => Reading::Fault,
            _ => Reading::Echo { range: 1.25 },
        };
        let ping = Ping {
            stamp: now - 0.03,
            bearing: 0.5,
            settled: true,
            reading,
        };
        log.range(&ping);
        log.take(Call {
            asked: Asked::Ping { bearing: 0.5 },
            answer: Answer::Ping(ping),
        });
        log.decision(&Decision {
            kind: "command".into(),
            time: now,
            numbers: vec![0.1, 0.05],
            text: String::new(),
        });
        if step == 10 {
            log.take(Call {
                asked: Asked::Frame,
                answer: Answer::Frame(CameraFrame {
                    stamp: now - 0.04,
                    sequence: u64::from(count),
                    image: picture(u64::from(count)),
                }),
            });
            log.map(now, &small_map());
            log.path(now, &[Point2::new(0.0, 0.0), Point2::new(1.0, 1.0)]);
            log.event(now, Level::Warn, "stop", "obstacle 0.3 m ahead — grün");
        }
    }
}

pub(crate) fn seconds(count: u32) -> Vec<u8> {
    let memory = Memory::default();
    let log = LogWriter::to(Box::new(memory.clone()), params()).expect("a log");
    log.input("job.json", b"{}");
    for k in 0..count {
        second(&log, k);
    }
    log.finish().expect("written");
    memory.bytes()
}

pub(crate) fn entries(bytes: &[u8]) -> Vec<Message> {
    let reader = LogReader::new(bytes).expect("a log");
    reader.map(|e| e.expect("an entry").message).collect()
}

/// Any call that there can be.
pub(crate) fn any_call(dice: &mut Dice) -> Call {
    let mut n = || dice.number();
    let (a, b, c) = (n(), n(), n());
    let reading = match dice.below(4) {
        0 => Reading::Echo { range: b },
        1 => Reading::NoEcho { listened: b },
        2 => Reading::TooClose,
        _ => Reading::Fault,
    };
    let bits = dice.next();
    let bit = |i: u32| bits >> i & 1 == 1;
    let (asked, answer) = match dice.below(11) {
        0 => (
            Asked::RangeBearings,
            Answer::Bearings(mobot_hw::Bearings { from: a, to: b }),
        ),
        1 => (
            Asked::PanBearings,
            Answer::Bearings(mobot_hw::Bearings { from: a, to: b }),
        ),
        2 => (
            Asked::Ping { bearing: a },
            Answer::Ping(Ping {
                stamp: a,
                bearing: c,
                settled: bit(0),
                reading,
            }),
        ),
        3 => (Asked::TurnTo { bearing: a }, Answer::Stands(b)),
        4 => (
            Asked::Frame,
            Answer::Frame(CameraFrame {
                stamp: a,
                sequence: bits,
                image: picture(bits),
            }),
        ),
        5 => (Asked::Track, Answer::Track(a)),
        6 => (Asked::Drive(Twist2::new(a, b)), Answer::Done),
        7 => (Asked::Stop, Answer::Done),
        8 => (
            Asked::Status,
            Answer::Status(BaseStatus {
                stamp: a,
                travel: WheelTravel { left: b, right: c },
                bump_left: bit(0),
                bump_right: bit(1),
                cliff: bit(2),
                wheel_drop: bit(3),
            }),
        ),
        9 => (Asked::Now, Answer::Now(a)),
        _ => (Asked::Sleep { seconds: a }, Answer::Done),
    };
    if dice.below(6) == 0 {
        let kinds = [
            FaultKind::Silent,
            FaultKind::Garbled,
            FaultKind::Unplugged,
            FaultKind::Refused,
            FaultKind::System,
        ];
        let kind = kinds[dice.below(5) as usize];
        let message = format!("fault {bits} \u{1f916}\n");
        let answer = Answer::Fault(Fault { kind, message });
        return Call { asked, answer };
    }
    Call { asked, answer }
}
