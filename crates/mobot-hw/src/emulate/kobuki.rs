//! A Kobuki: a frame every 20 ms; the last base command holds.

use super::{Emulator, RobotView};
use crate::serial::kobuki::{COUNT, Sensors, encode, wheels_of};
use crate::serial::{Decode as _, Event, FrameFault, Framing, Scanner, Verdict};

/// Frames to the base; the message is the base control part.
#[derive(Debug, Clone, Copy)]
struct CommandFraming;

impl Framing for CommandFraming {
    type Message = Option<(i16, i16)>;

    fn longest(&self) -> usize {
        4 + 255
    }

    fn self_evident(&self) -> bool {
        true
    }

    fn inspect(&self, bytes: &[u8], _ended: bool) -> Verdict<Self::Message> {
        if bytes[0] != 0xAA || bytes.get(1).is_some_and(|b| *b != 0x55) {
            return Verdict::Bad(FrameFault::Stray);
        }
        let Some(&length) = bytes.get(2) else {
            return Verdict::Wait;
        };
        let end = 3 + usize::from(length);
        let Some(&found) = bytes.get(end) else {
            return Verdict::Wait;
        };
        let payload = &bytes[3..end];
        let expected = payload.iter().fold(length, |sum, b| sum ^ b);
        if found != expected {
            return Verdict::Bad(FrameFault::Checksum { expected, found });
        }
        let mut control = None;
        let mut rest = payload;
        while let [id, size, data @ ..] = rest {
            let Some((data, after)) = data.split_at_checked(usize::from(*size)) else {
                return Verdict::Bad(FrameFault::Form);
            };
            if let (1, [a, b, c, d]) = (*id, data) {
                control = Some((i16::from_le_bytes([*a, *b]), i16::from_le_bytes([*c, *d])));
            }
            rest = after;
        }
        Verdict::Good {
            message: control,
            length: end + 1,
        }
    }
}

/// A Kobuki.
#[derive(Debug, Clone)]
pub struct KobukiEmulator {
    decoder: Scanner<CommandFraming>,
    wheels: [f64; 2],
    next: f64,
}

impl Default for KobukiEmulator {
    fn default() -> Self {
        Self {
            decoder: Scanner::new(CommandFraming),
            wheels: [0.0; 2],
            next: 0.0,
        }
    }
}

impl Emulator for KobukiEmulator {
    fn step(&mut self, bytes: &[u8], robot: &mut RobotView) -> Vec<u8> {
        for event in self.decoder.push(bytes) {
            if let Event::Message(Some((speed, radius))) = event {
                self.wheels = wheels_of(speed, radius);
                robot.drive(self.wheels);
            }
        }
        let now = robot.now();
        if now < self.next {
            return Vec::new();
        }
        self.next = now + 0.02;
        let [left, right] = robot.counts(COUNT);
        let [bump_left, bump_right] = robot.bumped();
        encode(&Sensors {
            time_ms: (now * 1000.0) as u64 as u16,
            bumpers: u8::from(bump_right) | u8::from(bump_left) << 2,
            wheel_drops: if robot.wheel_drop() { 0b11 } else { 0 },
            cliffs: if robot.cliff() { 0b111 } else { 0 },
            left: left as u16,
            right: right as u16,
            battery: 160,
        })
    }

    fn wheels(&self) -> Option<[f64; 2]> {
        Some(self.wheels)
    }
}
