//! Sonars, and the servo that turns them.

use occgrid::Reading;

use super::{Emulator, Later, RobotView};
use crate::serial::maxbotix::{self, MaxBotixModel};
use crate::serial::{asked, ff, maestro, urm37};

/// Fires, and gives the number that a sonar of this unit [m] sends; `silence` where it heard nothing.
fn measure(robot: &mut RobotView, unit: f64, [near, silence]: [u16; 2]) -> u16 {
    match robot.fire() {
        Reading::Echo { range } => {
            let number = (range / unit).round();
            (number as u16).clamp(near, near.max(silence))
        }
        Reading::TooClose => near,
        _ => silence,
    }
}

/// Whether a cycle of so many seconds is over; counts on from the last one.
fn cycle(next: &mut Option<f64>, seconds: f64, now: f64) -> bool {
    let due = *next.get_or_insert(now + seconds);
    if now < due {
        return false;
    }
    *next = Some((due + seconds).max(now));
    true
}

/// A MaxBotix sonar that fires by itself.
#[derive(Debug, Clone, Default)]
pub struct MaxBotixEmulator {
    /// Which family.
    pub model: MaxBotixModel,
    next: Option<f64>,
}

impl MaxBotixEmulator {
    /// One of this family.
    #[must_use]
    pub const fn new(model: MaxBotixModel) -> Self {
        Self { model, next: None }
    }
}

impl Emulator for MaxBotixEmulator {
    fn step(&mut self, _bytes: &[u8], robot: &mut RobotView) -> Vec<u8> {
        if !cycle(&mut self.next, self.model.cycle(), robot.now()) {
            return Vec::new();
        }
        let value = measure(robot, self.model.unit(), self.model.ends());
        maxbotix::encode(self.model, value, false)
    }
}

/// A sonar of the `FF` family that fires by itself, ten times a second.
#[derive(Debug, Clone, Default)]
pub struct FfEmulator(Option<f64>);

impl Emulator for FfEmulator {
    fn step(&mut self, _bytes: &[u8], robot: &mut RobotView) -> Vec<u8> {
        if !cycle(&mut self.0, 0.1, robot.now()) {
            return Vec::new();
        }
        ff::encode(measure(robot, 0.001, [30, 4500]) % 4500).to_vec()
    }
}

/// A US-100.
#[derive(Debug, Clone, Default)]
pub struct Us100Emulator(Later);

impl Emulator for Us100Emulator {
    fn step(&mut self, bytes: &[u8], robot: &mut RobotView) -> Vec<u8> {
        let now = robot.now();
        for byte in bytes {
            match *byte {
                asked::US100_RANGE => {
                    let mm = measure(robot, 0.001, [20, 4500]);
                    self.0.send(now + 0.03, asked::encode(mm));
                }
                asked::US100_TEMPERATURE => self.0.send(now + 0.003, [20 + 45]),
                _ => {}
            }
        }
        self.0.due(now)
    }
}

/// An SRF02.
#[derive(Debug, Clone, Default)]
pub struct Srf02Emulator {
    /// Its address, 0 to 15.
    pub address: u8,
    addressed: bool,
    later: Later,
}

impl Srf02Emulator {
    /// One at this address.
    #[must_use]
    pub fn at(address: u8) -> Self {
        Self {
            address,
            ..Self::default()
        }
    }
}

impl Emulator for Srf02Emulator {
    fn step(&mut self, bytes: &[u8], robot: &mut RobotView) -> Vec<u8> {
        let now = robot.now();
        for byte in bytes {
            if !std::mem::take(&mut self.addressed) {
                self.addressed = *byte == self.address;
            } else if *byte == asked::SRF02_RANGE_CM {
                let cm = measure(robot, 0.01, [15, 600]) % 600;
                self.later.send(now + 0.066, asked::encode(cm));
            } else if *byte == asked::SRF02_VERSION {
                self.later.send(now + 0.003, [6]);
            }
        }
        self.later.due(now)
    }
}

/// A URM37 whose servo turns the robot's sonar, 23 steps of 6 degrees being straight ahead.
#[derive(Debug, Clone, Default)]
pub struct Urm37Emulator {
    bytes: Vec<u8>,
    later: Later,
}

impl Emulator for Urm37Emulator {
    fn step(&mut self, bytes: &[u8], robot: &mut RobotView) -> Vec<u8> {
        let now = robot.now();
        for byte in bytes {
            self.bytes.push(*byte);
            if self.bytes.len() < 4 {
                continue;
            }
            let (command, steps) = (self.bytes[0], self.bytes[1]);
            let sum = self.bytes[..3].iter().fold(0_u8, |s, b| s.wrapping_add(*b));
            if sum != self.bytes[3] {
                self.bytes.remove(0);
                continue;
            }
            self.bytes.clear();
            if command == urm37::RANGE {
                if steps <= urm37::MAX_STEPS {
                    let off = (f64::from(steps) - 23.0) * 6.0;
                    robot.aim(off.to_radians());
                }
                let cm = match measure(robot, 0.01, [4, 500]) {
                    500.. => urm37::INVALID,
                    cm => cm,
                };
                self.later.send(now + 0.05, urm37::answer(command, cm));
            } else if command == urm37::TEMPERATURE {
                self.later.send(now + 0.01, urm37::answer(command, 215));
            }
        }
        self.later.due(now)
    }
}

/// A Maestro whose channel 0 turns the robot's sonar, 1 ms of pulse width being half a turn.
#[derive(Debug, Clone)]
pub struct MaestroEmulator {
    command: Vec<u8>,
    target: u16,
    errors: u16,
}

impl Default for MaestroEmulator {
    fn default() -> Self {
        Self {
            command: Vec::new(),
            target: 6000,
            errors: 0,
        }
    }
}

/// The Maestro's bit for a protocol error.
const PROTOCOL_ERROR: u16 = 1 << 4;

impl MaestroEmulator {
    fn run(&mut self, robot: &mut RobotView) -> Option<Vec<u8>> {
        let answer = match *self.command.as_slice() {
            [0x84, channel, low, high] => {
                if channel == 0 {
                    let target = u16::from(low) | u16::from(high) << 7;
                    self.target = target.clamp(992 * 4, 2000 * 4);
                    let us = f64::from(self.target) / 4.0;
                    robot.aim((us - 1500.0) * std::f64::consts::PI / 1000.0);
                }
                Vec::new()
            }
            [0x87 | 0x89, ..] if self.command.len() == 4 => Vec::new(),
            [0x90, _] => maestro::answer(self.target).to_vec(),
            [0x93] => vec![0],
            [0xA1] => maestro::answer(std::mem::take(&mut self.errors)).to_vec(),
            [0xA2] => Vec::new(),
            [0x84 | 0x87 | 0x89 | 0x90, ..] => return None,
            _ => {
                self.errors |= PROTOCOL_ERROR;
                Vec::new()
            }
        };
        self.command.clear();
        Some(answer)
    }
}

impl Emulator for MaestroEmulator {
    fn step(&mut self, bytes: &[u8], robot: &mut RobotView) -> Vec<u8> {
        let mut out = Vec::new();
        for byte in bytes {
            if *byte >= 0x80 && !self.command.is_empty() {
                self.errors |= PROTOCOL_ERROR;
                self.command.clear();
            }
            self.command.push(*byte);
            out.extend(self.run(robot).unwrap_or_default());
        }
        out
    }
}
