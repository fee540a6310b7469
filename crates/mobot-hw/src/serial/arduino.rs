//! An Arduino with the firmware `ROSArduinoBridge`: base, servo and sonar on one line. After the sources of
//! hbrobotics/ros_arduino_bridge: 57600 baud 8N1, a letter, arguments after spaces, a carriage return; the
//! answer is one line.
//!
//! Answers do not say what they answer: after a fault the driver drains the line and asks for the baud rate
//! before it trusts an answer again. Numbers have no checksum: a ping asks until two of three answers agree,
//! and counts that jump further than the wheels can turn are dropped. The firmware has 16 bytes an argument and does not check; all
//! arguments sent here are shorter. A ping without echo holds the firmware and the line for a second,
//! motor commands too. The firmware stops the wheels 2 s after the last command; the driver stops them where a
//! command was not renewed for 0.2 s and the driver is called at all, and when it is dropped.

mod counters;
mod driver;

use super::decode::{Decode, Event, FrameFault};

pub use driver::{Arduino, ArduinoParams};

/// Baud rate of the line, and the answer to `b`.
pub const BAUD: u32 = 57_600;

/// A command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Answers the baud rate.
    Baud,
    /// Answers the counts of left and right wheel.
    Encoders,
    /// Sets the speeds of left and right wheel, counts a PID frame.
    Motors(i16, i16),
    /// Turns a servo [deg].
    Servo(u8, u8),
    /// Measures with the sonar on a pin; answers cm, 0 where nothing was heard.
    Ping(u8),
}

impl Command {
    /// Its bytes.
    #[must_use]
    pub fn bytes(self) -> Vec<u8> {
        let text = match self {
            Self::Baud => "b\r".to_owned(),
            Self::Encoders => "e\r".to_owned(),
            Self::Motors(left, right) => format!("m {left} {right}\r"),
            Self::Servo(servo, deg) => format!("s {servo} {deg}\r"),
            Self::Ping(pin) => format!("p {pin}\r"),
        };
        text.into_bytes()
    }
}

/// What a line says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// `OK`.
    Ok,
    /// A number.
    One(i32),
    /// Two numbers.
    Two(i32, i32),
    /// `Invalid Command`.
    Invalid,
}

impl Answer {
    /// Its line.
    #[must_use]
    pub fn bytes(self) -> Vec<u8> {
        let text = match self {
            Self::Ok => "OK\r\n".to_owned(),
            Self::One(value) => format!("{value}\r\n"),
            Self::Two(left, right) => format!("{left} {right}\r\n"),
            Self::Invalid => "Invalid Command\r\n".to_owned(),
        };
        text.into_bytes()
    }
}

/// Longest line that is kept.
const LONGEST: usize = 32;

/// Finds answers: whole lines that end with a carriage return and a line feed.
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    line: [u8; LONGEST],
    length: usize,
    event: Option<Event<Answer>>,
}

impl Decoder {
    fn read(&self) -> Option<Answer> {
        let line = self.line.get(..self.length)?;
        let text = std::str::from_utf8(line.strip_suffix(b"\r")?).ok()?;
        match text {
            "OK" => return Some(Answer::Ok),
            "Invalid Command" => return Some(Answer::Invalid),
            _ => {}
        }
        let number = |text: &str| text.parse().ok().filter(|_| !text.starts_with('+'));
        match text.split_once(' ') {
            Some((left, right)) => Some(Answer::Two(number(left)?, number(right)?)),
            None => number(text).map(Answer::One),
        }
    }
}

impl Decode for Decoder {
    type Message = Answer;

    fn feed(&mut self, byte: u8) {
        if byte == b'\n' {
            let answer = self.read();
            self.event = Some(answer.map_or(Event::Fault(FrameFault::Form), Event::Message));
            self.length = 0;
        } else {
            if let Some(place) = self.line.get_mut(self.length) {
                *place = byte;
            }
            self.length = self.length.saturating_add(1);
        }
    }

    fn quiet(&mut self) {
        if self.length > 0 {
            self.event = Some(Event::Fault(FrameFault::Half));
        }
        self.length = 0;
    }

    fn reset(&mut self) {
        *self = Self::default();
    }

    fn poll(&mut self) -> Option<Event<Answer>> {
        self.event.take()
    }
}
