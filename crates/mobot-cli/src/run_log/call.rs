//! Calls of devices in a run log, exactly: every number keeps its bits.

use mobot_hw::wrap::{Answer, Asked, Call, Fault};
use mobot_hw::{BaseStatus, Bearings, CameraFrame, FaultKind, Ping, Twist2, WheelTravel};
use occgrid::Reading;

use super::cdr::ros_message;
use super::ros::topics;

ros_message!(
    /// One call of a device and what came of it. Its picture, if it gave one, is the message before it on
    /// the camera's topic.
    CallRecord = "mobot_msgs/Call" {
        asked: String,
        arguments: Vec<f64>,
        answer: String,
        numbers: Vec<f64>,
        sequence: u64,
        message: String,
    }
);

topics!(CallRecord: "mobot_msgs/msg/Call" on "/mobot/calls");

/// Words for what was asked, and for faults.
const KINDS: [(FaultKind, &str); 5] = [
    (FaultKind::Silent, "silent"),
    (FaultKind::Garbled, "garbled"),
    (FaultKind::Unplugged, "unplugged"),
    (FaultKind::Refused, "refused"),
    (FaultKind::System, "system"),
];

fn asked(asked: &Asked) -> Option<(&'static str, Vec<f64>)> {
    Some(match *asked {
        Asked::RangeBearings => ("range_bearings", vec![]),
        Asked::Ping { bearing } => ("ping", vec![bearing]),
        Asked::PanBearings => ("pan_bearings", vec![]),
        Asked::TurnTo { bearing } => ("turn_to", vec![bearing]),
        Asked::Frame => ("frame", vec![]),
        Asked::Track => ("track", vec![]),
        Asked::Drive(twist) => ("drive", vec![twist.linear, twist.angular]),
        Asked::Stop => ("stop", vec![]),
        Asked::Status => ("status", vec![]),
        Asked::Now => ("now", vec![]),
        Asked::Sleep { seconds } => ("sleep", vec![seconds]),
        _ => return None,
    })
}

fn ping(ping: &Ping) -> (&'static str, Vec<f64>) {
    let (kind, range) = match ping.reading {
        Reading::Echo { range } => ("echo", Some(range)),
        Reading::NoEcho { listened } => ("no_echo", Some(listened)),
        Reading::TooClose => ("too_close", None),
        Reading::Fault => ("fault", None),
    };
    let mut numbers = vec![ping.stamp, ping.bearing, truth(ping.settled)];
    numbers.extend(range);
    (kind, numbers)
}

fn status(status: &BaseStatus) -> Vec<f64> {
    vec![
        status.stamp,
        status.travel.left,
        status.travel.right,
        truth(status.bump_left),
        truth(status.bump_right),
        truth(status.cliff),
        truth(status.wheel_drop),
    ]
}

fn truth(yes: bool) -> f64 {
    f64::from(u8::from(yes))
}

impl CallRecord {
    /// Of a call; `None` for one that this log does not know.
    #[must_use]
    pub fn of(call: &Call) -> Option<Self> {
        let (question, arguments) = asked(&call.asked)?;
        let mut record = Self {
            asked: question.into(),
            arguments,
            answer: String::new(),
            numbers: Vec::new(),
            sequence: 0,
            message: String::new(),
        };
        let (answer, numbers) = match &call.answer {
            Answer::Bearings(reach) => ("bearings", vec![reach.from, reach.to]),
            Answer::Ping(found) => ping(found),
            Answer::Stands(bearing) => ("stands", vec![*bearing]),
            Answer::Frame(frame) => {
                record.sequence = frame.sequence;
                ("frame", vec![frame.stamp])
            }
            Answer::Track(track) => ("track", vec![*track]),
            Answer::Done => ("done", vec![]),
            Answer::Status(found) => ("status", status(found)),
            Answer::Now(now) => ("now", vec![*now]),
            Answer::Fault(fault) => {
                record.message.clone_from(&fault.message);
                let kind = KINDS.iter().find(|(kind, _)| *kind == fault.kind);
                (kind.map_or("system", |(_, word)| word), vec![])
            }
            _ => return None,
        };
        record.answer = answer.into();
        record.numbers = numbers;
        Some(record)
    }

    /// The call; `frame` makes the frame of a call that gave one, out of its stamp and number. `None` for
    /// a record that says nothing this log would say.
    #[must_use]
    pub fn call(&self, frame: impl FnOnce(f64, u64) -> Option<CameraFrame>) -> Option<Call> {
        let asked = self.question()?;
        let answer = match (self.answer.as_str(), self.numbers.as_slice()) {
            ("bearings", &[from, to]) => Answer::Bearings(Bearings { from, to }),
            ("stands", &[bearing]) => Answer::Stands(bearing),
            ("frame", &[stamp]) => Answer::Frame(frame(stamp, self.sequence)?),
            ("track", &[track]) => Answer::Track(track),
            ("done", []) => Answer::Done,
            ("status", numbers) => Answer::Status(read_status(numbers)?),
            ("now", &[now]) => Answer::Now(now),
            ("echo" | "no_echo" | "too_close" | "fault", _) => Answer::Ping(self.ping()?),
            (word, []) => {
                let (kind, _) = KINDS.iter().find(|(_, known)| *known == word)?;
                Answer::Fault(Fault {
                    kind: *kind,
                    message: self.message.clone(),
                })
            }
            _ => return None,
        };
        Some(Call { asked, answer })
    }

    fn question(&self) -> Option<Asked> {
        Some(match (self.asked.as_str(), self.arguments.as_slice()) {
            ("range_bearings", []) => Asked::RangeBearings,
            ("ping", &[bearing]) => Asked::Ping { bearing },
            ("pan_bearings", []) => Asked::PanBearings,
            ("turn_to", &[bearing]) => Asked::TurnTo { bearing },
            ("frame", []) => Asked::Frame,
            ("track", []) => Asked::Track,
            ("drive", &[linear, angular]) => Asked::Drive(Twist2::new(linear, angular)),
            ("stop", []) => Asked::Stop,
            ("status", []) => Asked::Status,
            ("now", []) => Asked::Now,
            ("sleep", &[seconds]) => Asked::Sleep { seconds },
            _ => return None,
        })
    }

    fn ping(&self) -> Option<Ping> {
        let (&[stamp, bearing, settled], range) = self.numbers.split_first_chunk()?;
        let reading = match (self.answer.as_str(), range) {
            ("echo", &[range]) => Reading::Echo { range },
            ("no_echo", &[listened]) => Reading::NoEcho { listened },
            ("too_close", []) => Reading::TooClose,
            ("fault", []) => Reading::Fault,
            _ => return None,
        };
        Some(Ping {
            stamp,
            bearing,
            settled: read_truth(settled)?,
            reading,
        })
    }
}

fn read_status(numbers: &[f64]) -> Option<BaseStatus> {
    let &[stamp, left, right, bump_left, bump_right, cliff, wheel_drop] = numbers else {
        return None;
    };
    Some(BaseStatus {
        stamp,
        travel: WheelTravel { left, right },
        bump_left: read_truth(bump_left)?,
        bump_right: read_truth(bump_right)?,
        cliff: read_truth(cliff)?,
        wheel_drop: read_truth(wheel_drop)?,
    })
}

fn read_truth(number: f64) -> Option<bool> {
    match number.to_bits() {
        0 => Some(false),
        bits if bits == 1.0_f64.to_bits() => Some(true),
        _ => None,
    }
}
