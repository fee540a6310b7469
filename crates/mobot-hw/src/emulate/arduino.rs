//! An Arduino with the firmware `ROSArduinoBridge`: base, servo 0 under the sonar, sonar.

use super::{Emulator, Later, RobotView};
use crate::serial::arduino::{Answer, ArduinoParams, BAUD};
use occgrid::Reading;

/// The firmware stops the wheels so long after the last command [s].
const AUTO_STOP: f64 = 2.0;
/// An argument of the firmware holds so many characters.
const ARGUMENT: usize = 15;

/// An Arduino of this build.
#[derive(Debug, Clone)]
pub struct ArduinoEmulator {
    params: ArduinoParams,
    line: Vec<u8>,
    wheels: [f64; 2],
    commanded: f64,
    servo_deg: i32,
    later: Later,
}

impl ArduinoEmulator {
    /// The build whose driver has these parameters.
    #[must_use]
    pub fn new(params: ArduinoParams) -> Self {
        Self {
            params,
            line: Vec::new(),
            wheels: [0.0; 2],
            commanded: 0.0,
            servo_deg: params.centre_deg as i32,
            later: Later::default(),
        }
    }

    fn run(&mut self, robot: &mut RobotView, now: f64) {
        let line = std::mem::take(&mut self.line);
        let text = String::from_utf8_lossy(&line);
        let mut words = text.split(' ').filter(|w| w.len() <= ARGUMENT);
        let command = words.next().unwrap_or_default();
        let mut number = || {
            words
                .next()
                .and_then(|w| w.parse::<i32>().ok())
                .unwrap_or(0)
        };
        let p = self.params;
        let mut after = 0.001;
        let answer = match command {
            "b" => Answer::One(BAUD as i32),
            "e" => {
                let [left, right] = robot.counts(1.0 / p.counts_per_metre);
                Answer::Two(left as i32, right as i32)
            }
            "m" => {
                let speed = p.frames_per_second / p.counts_per_metre;
                self.wheels = [f64::from(number()) * speed, f64::from(number()) * speed];
                self.commanded = now;
                robot.drive(self.wheels);
                Answer::Ok
            }
            "s" => {
                let (servo, deg) = (number(), number().clamp(0, 180));
                if servo == i32::from(p.servo) {
                    self.servo_deg = deg;
                    let off = (f64::from(deg) - p.centre_deg).to_radians();
                    robot.aim(if p.clockwise { -off } else { off });
                }
                Answer::Ok
            }
            "t" => Answer::One(self.servo_deg),
            "p" => match robot.fire() {
                Reading::Echo { range } => {
                    after = range / 170.0;
                    Answer::One((range * 100.0) as i32)
                }
                Reading::TooClose => Answer::One(1),
                _ => {
                    after = 1.0;
                    Answer::One(0)
                }
            },
            _ => Answer::Invalid,
        };
        self.later.send(now + after, answer.bytes());
    }
}

impl Emulator for ArduinoEmulator {
    fn step(&mut self, bytes: &[u8], robot: &mut RobotView) -> Vec<u8> {
        let now = robot.now();
        for byte in bytes {
            if *byte == b'\r' {
                self.run(robot, now);
            } else if self.line.len() < 64 {
                self.line.push(*byte);
            }
        }
        let turning = self.wheels.iter().any(|w| *w != 0.0);
        if turning && now - self.commanded > AUTO_STOP {
            self.wheels = [0.0; 2];
            robot.drive(self.wheels);
        }
        self.later.due(now)
    }

    fn wheels(&self) -> Option<[f64; 2]> {
        Some(self.wheels)
    }
}
