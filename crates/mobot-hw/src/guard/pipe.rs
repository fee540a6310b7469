//! What program and guard say to each other: one line each, beginning with the request's number.

use std::io::{self, BufRead, Read as _};

use crate::{BaseStatus, DeviceError, FaultKind, Twist2, WheelTravel};

/// Longest line that is taken.
const LONGEST: u64 = 512;

/// Reads one line into `line`, without its end; false where the pipe is closed. What is too long comes in
/// pieces, which mean nothing.
pub(super) fn read_line(pipe: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<bool> {
    line.clear();
    let read = pipe.take(LONGEST).read_until(b'\n', line)?;
    while line.last().is_some_and(|b| b.is_ascii_whitespace()) {
        line.pop();
    }
    Ok(read > 0)
}

/// What the program wants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Request {
    Drive(Twist2),
    Stop,
    Status,
}

impl Request {
    pub(super) fn line(self, number: u64) -> String {
        match self {
            Self::Drive(Twist2 { linear, angular }) => {
                format!("{number} drive {linear} {angular}\n")
            }
            Self::Stop => format!("{number} stop\n"),
            Self::Status => format!("{number} status\n"),
        }
    }

    pub(super) fn read(line: &[u8]) -> Option<(u64, Self)> {
        let mut words = std::str::from_utf8(line).ok()?.split(' ');
        let number = words.next()?.parse().ok()?;
        let request = match words.next()? {
            "drive" => Self::Drive(Twist2 {
                linear: words.next()?.parse().ok()?,
                angular: words.next()?.parse().ok()?,
            }),
            "stop" => Self::Stop,
            "status" => Self::Status,
            _ => return None,
        };
        Some((number, request))
    }
}

/// What the guard answers.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Reply {
    Done,
    /// The stamp of a status is its age, as the two processes' clocks begin at different times.
    State(BaseStatus),
    Fault(FaultKind, String),
}

const KINDS: [(FaultKind, &str); 5] = [
    (FaultKind::Silent, "silent"),
    (FaultKind::Garbled, "garbled"),
    (FaultKind::Unplugged, "unplugged"),
    (FaultKind::Refused, "refused"),
    (FaultKind::System, "system"),
];

impl Reply {
    pub(super) fn fault(error: &impl DeviceError) -> Self {
        Self::Fault(error.kind(), error.to_string())
    }

    pub(super) fn line(&self, number: u64) -> String {
        match self {
            Self::Done => format!("{number} done\n"),
            Self::State(s) => {
                let WheelTravel { left, right } = s.travel;
                let bits = [s.bump_left, s.bump_right, s.cliff, s.wheel_drop].map(u8::from);
                let [a, b, c, d] = bits;
                format!(
                    "{number} state {} {left} {right} {a} {b} {c} {d}\n",
                    s.stamp
                )
            }
            Self::Fault(kind, message) => {
                let name = KINDS
                    .iter()
                    .find(|(k, _)| k == kind)
                    .map_or("system", |k| k.1);
                // one line, and a short one
                let message: String = message
                    .chars()
                    .map(|c| if c.is_control() { ' ' } else { c })
                    .take(100)
                    .collect();
                format!("{number} fault {name} {message}\n")
            }
        }
    }

    pub(super) fn read(line: &[u8]) -> Option<(u64, Self)> {
        let text = std::str::from_utf8(line).ok()?;
        let (number, rest) = text.split_once(' ')?;
        let (what, rest) = rest.split_once(' ').unwrap_or((rest, ""));
        let reply = match what {
            "done" => Self::Done,
            "state" => Self::State(state(rest)?),
            "fault" => {
                let (name, message) = rest.split_once(' ')?;
                let kind = KINDS.iter().find(|(_, n)| *n == name)?.0;
                Self::Fault(kind, message.to_owned())
            }
            _ => return None,
        };
        Some((number.parse().ok()?, reply))
    }
}

fn state(words: &str) -> Option<BaseStatus> {
    let numbers: Vec<f64> = words
        .split(' ')
        .map(str::parse)
        .collect::<Result<_, _>>()
        .ok()?;
    let [stamp, left, right, ref bits @ ..] = *numbers else {
        return None;
    };
    let [bump_left, bump_right, cliff, wheel_drop] =
        <[f64; 4]>::try_from(bits).ok()?.map(|bit| bit != 0.0);
    Some(BaseStatus {
        stamp,
        travel: WheelTravel { left, right },
        bump_left,
        bump_right,
        cliff,
        wheel_drop,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn whole(mut line: &[u8]) -> Vec<u8> {
        let mut read = Vec::new();
        assert!(read_line(&mut line, &mut read).expect("a line"));
        read
    }

    #[test]
    fn requests_come_out_as_they_went_in() {
        for request in [
            Request::Drive(Twist2::new(0.1, -1e-300)),
            Request::Drive(Twist2::new(f64::NEG_INFINITY, 1.0 / 3.0)),
            Request::Stop,
            Request::Status,
        ] {
            let line = whole(request.line(7).as_bytes());
            assert_eq!(Request::read(&line), Some((7, request)));
        }
        let line = Request::Drive(Twist2::new(f64::NAN, 0.0)).line(8);
        let Some((8, Request::Drive(twist))) = Request::read(&whole(line.as_bytes())) else {
            panic!("{line}");
        };
        assert!(twist.linear.is_nan());
    }

    #[test]
    fn replies_come_out_as_they_went_in() {
        let status = BaseStatus {
            stamp: 0.1 + 0.2,
            travel: WheelTravel {
                left: -1e9,
                right: 1.0 / 3.0,
            },
            bump_right: true,
            wheel_drop: true,
            ..BaseStatus::default()
        };
        for reply in [
            Reply::Done,
            Reply::State(status),
            Reply::Fault(FaultKind::Refused, "a cliff, or so".to_owned()),
        ] {
            let line = whole(reply.line(9).as_bytes());
            assert_eq!(Reply::read(&line), Some((9, reply)));
        }
        let long = Reply::Fault(FaultKind::System, "x\n".repeat(1000));
        assert!(Reply::read(&whole(long.line(1).as_bytes())).is_some());
    }

    #[test]
    fn what_is_no_line_means_nothing() {
        for line in [
            "",
            "1",
            "drive 1 1",
            "1 drive 1",
            "1 drive 1 x",
            "-1 stop",
            "1 fault odd x",
            "1 state 1 2 3",
        ] {
            assert_eq!(Request::read(line.as_bytes()), None, "{line}");
            assert_eq!(Reply::read(line.as_bytes()), None, "{line}");
        }
        assert_eq!(Request::read(b"\xFF\xFE stop"), None);
        let endless = vec![b'1'; 100_000];
        let mut pipe = &endless[..];
        let mut line = Vec::new();
        while read_line(&mut pipe, &mut line).expect("a read") {
            assert!(line.len() as u64 <= LONGEST);
            assert_eq!(Request::read(&line), None);
        }
    }
}
