//! Yujin Kobuki. After the "Kobuki protocol" page of kobuki.readthedocs.io and kobuki_core's sources:
//! 115200 baud 8N1, little-endian; `AA 55`, length, payload, exclusive or of length and payload. A payload
//! is made of parts: id, length, data.
//!
//! No watchdog is documented. The driver stops the base where a command was not renewed for 0.2 s and the
//! driver is called at all, and when it is dropped.

use std::io::{Read, Write};

use super::decode::{FrameFault, Framing, Scanner, Verdict};
use super::line::{Line, LineCounts, SerialError};
use super::wheels::{Governor, JUST_NOW, UNREAD, Unwrapped, WheelLimits};
use crate::{BaseStatus, Clock, DifferentialDrive, Twist2, WheelTravel};

/// Baud rate of the line.
pub const BAUD: u32 = 115_200;
/// Distance between the wheels [m].
pub const TRACK: f64 = 0.23;
/// Way of a wheel for one count: 35 mm radius, 0.002 436 916 871 rad [m].
pub const COUNT: f64 = 0.035 * 0.002_436_916_871;

/// Longest payload that is waited for.
const LONGEST: usize = 160;

/// A frame around a payload of at most 255 bytes.
#[must_use]
pub fn frame(payload: &[u8]) -> Vec<u8> {
    let length = payload.len() as u8;
    let sum = payload.iter().fold(length, |sum, b| sum ^ b);
    let mut frame = vec![0xAA, 0x55, length];
    frame.extend(payload);
    frame.push(sum);
    frame
}

/// A base command: speed [mm/s], and radius [mm], 0 straight on, 1 on the spot.
#[must_use]
pub fn base_control(speed: i16, radius: i16) -> Vec<u8> {
    let ([a, b], [c, d]) = (speed.to_le_bytes(), radius.to_le_bytes());
    frame(&[1, 4, a, b, c, d])
}

/// Speed and radius of a velocity, in the base's way: the speed is the outer wheel's.
#[must_use]
pub fn speed_and_radius(command: Twist2) -> (i16, i16) {
    let (v, w) = (command.linear * 1000.0, command.angular);
    let half = TRACK * 500.0;
    let radius = v / w;
    if w == 0.0 || radius.abs() > f64::from(i16::MAX) {
        return (v.round() as i16, 0);
    }
    if radius.abs() < 1.5 {
        return ((w * half).round() as i16, 1);
    }
    let outer = (radius + half.copysign(radius)) * w;
    (outer.round() as i16, radius.round() as i16)
}

/// The wheel speeds that a base command means, left and right [m/s].
#[must_use]
pub fn wheels_of(speed: i16, radius: i16) -> [f64; 2] {
    let (speed, half) = (f64::from(speed) / 1000.0, TRACK / 2.0);
    if radius == 0 {
        return [speed; 2];
    }
    if radius == 1 {
        return [-speed, speed];
    }
    let radius = f64::from(radius) / 1000.0;
    let w = speed / (radius + half.copysign(radius));
    [(radius - half) * w, (radius + half) * w]
}

/// What the basic part of a frame tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sensors {
    /// The base's own time [ms], wraps at 65 535.
    pub time_ms: u16,
    /// Bit 0 right, 1 centre, 2 left.
    pub bumpers: u8,
    /// Bit 0 right, 1 left.
    pub wheel_drops: u8,
    /// Bit 0 right, 1 centre, 2 left.
    pub cliffs: u8,
    /// Count of the left wheel, wraps at 65 535.
    pub left: u16,
    /// Count of the right wheel, wraps at 65 535.
    pub right: u16,
    /// Battery [0.1 V].
    pub battery: u8,
}

/// The frame with a basic part that tells this.
#[must_use]
pub fn encode(sensors: &Sensors) -> Vec<u8> {
    let mut payload = vec![1, 15];
    payload.extend(sensors.time_ms.to_le_bytes());
    payload.extend([sensors.bumpers, sensors.wheel_drops, sensors.cliffs]);
    payload.extend(sensors.left.to_le_bytes());
    payload.extend(sensors.right.to_le_bytes());
    // duty of the motors, buttons, charger, battery, overcurrent
    payload.extend([0, 0, 0, 0, sensors.battery, 0]);
    frame(&payload)
}

/// The form of the base's frames, and the basic part in them. A frame counts once the next one begins or
/// the line is quiet.
#[derive(Debug, Clone, Copy, Default)]
pub struct PartFraming;

impl Framing for PartFraming {
    type Message = Sensors;

    fn longest(&self) -> usize {
        3 + LONGEST + 1 + 2
    }

    fn inspect(&self, bytes: &[u8], ended: bool) -> Verdict<Sensors> {
        if bytes[0] != 0xAA {
            return Verdict::Bad(FrameFault::Stray);
        }
        if bytes.get(1).is_some_and(|b| *b != 0x55) {
            return Verdict::Bad(FrameFault::Stray);
        }
        let Some(&length) = bytes.get(2) else {
            return Verdict::Wait;
        };
        let length = usize::from(length);
        if !(17..=LONGEST).contains(&length) {
            return Verdict::Bad(FrameFault::Form);
        }
        let come = &bytes[3..bytes.len().min(3 + length)];
        if !parts_fit(come, length) {
            return Verdict::Bad(FrameFault::Form);
        }
        let Some(&found) = bytes.get(3 + length) else {
            return Verdict::Wait;
        };
        let expected = come.iter().fold(length as u8, |sum, b| sum ^ b);
        if found != expected {
            return Verdict::Bad(FrameFault::Checksum { expected, found });
        }
        let next = &bytes[4 + length..];
        let header = &[0xAA, 0x55][..next.len().min(2)];
        if !next.starts_with(header) {
            return Verdict::Bad(FrameFault::Form);
        }
        if next.len() < 2 && !ended {
            return Verdict::Wait;
        }
        let word = |at: usize| u16::from_le_bytes([come[at], come[at + 1]]);
        Verdict::Good {
            message: Sensors {
                time_ms: word(2),
                bumpers: come[4],
                wheel_drops: come[5],
                cliffs: come[6],
                left: word(7),
                right: word(9),
                battery: come[15],
            },
            length: 4 + length,
        }
    }
}

/// Whether a payload, as far as it has come, begins with the basic part and its parts end where it does.
fn parts_fit(come: &[u8], length: usize) -> bool {
    if come.first().is_some_and(|id| *id != 1) || come.get(1).is_some_and(|n| *n != 15) {
        return false;
    }
    let mut place = 0;
    while place < length {
        let Some(&part) = come.get(place + 1) else {
            return place + 1 < length;
        };
        place += 2 + usize::from(part);
    }
    place == length
}

/// Finds frames with a basic part.
pub type Decoder = Scanner<PartFraming>;

/// How a Kobuki is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KobukiParams {
    /// The last limits of every command.
    pub limits: WheelLimits,
    /// A status may take this long [s]; the base sends one every 20 ms.
    pub timeout: f64,
}

impl Default for KobukiParams {
    fn default() -> Self {
        Self {
            limits: WheelLimits::default(),
            timeout: 0.1,
        }
    }
}

/// A Kobuki.
#[derive(Debug)]
pub struct Kobuki<P: Read + Write, C: Clock> {
    line: Line<P, C>,
    decoder: Decoder,
    params: KobukiParams,
    governor: Governor,
    counts: [Unwrapped; 2],
    read_at: f64,
}

impl<P: Read + Write, C: Clock> Kobuki<P, C> {
    /// On a port of [`BAUD`]: stops it, and waits for its first frame, at most 1 s.
    ///
    /// # Errors
    /// The line's.
    pub fn open(port: P, clock: C, params: KobukiParams) -> Result<Self, SerialError> {
        let mut base = Self {
            line: Line::new(port, clock),
            decoder: Decoder::default(),
            params,
            governor: Governor::new(params.limits, TRACK),
            counts: [Unwrapped::default(); 2],
            read_at: f64::NEG_INFINITY,
        };
        base.stop()?;
        base.line.drain()?;
        base.read(1.0)?;
        Ok(base)
    }

    /// What came over the line so far.
    #[must_use]
    pub const fn counts(&self) -> LineCounts {
        self.line.counts()
    }

    fn read(&mut self, timeout: f64) -> Result<(Sensors, f64), SerialError> {
        let Self {
            line,
            decoder,
            counts,
            read_at,
            ..
        } = self;
        let began = line.now();
        // bytes that waited while nobody read are of an unknown age
        let waiting = began - *read_at > UNREAD;
        let newest = line.listen(decoder, timeout, |sensors, heard| {
            counts[0].update(sensors.left);
            counts[1].update(sensors.right);
            let old = waiting && heard - began < JUST_NOW;
            (!old).then_some((sensors, heard))
        });
        *read_at = line.now();
        newest
    }

    fn send(&mut self, wheels: [f64; 2]) -> Result<(), SerialError> {
        let (speed, radius) = speed_and_radius(Twist2::from_wheels(wheels, TRACK));
        self.line.send(&base_control(speed, radius))
    }
}

impl<P: Read + Write, C: Clock> DifferentialDrive for Kobuki<P, C> {
    type Error = SerialError;

    fn track(&self) -> f64 {
        TRACK
    }

    fn drive(&mut self, command: Twist2) -> Result<(), SerialError> {
        let now = self.line.now();
        let wheels = self.governor.allow(command, now);
        self.send(wheels)
    }

    fn stop(&mut self) -> Result<(), SerialError> {
        let now = self.line.now();
        let wheels = self.governor.halt(now);
        self.send(wheels)
    }

    fn status(&mut self) -> Result<BaseStatus, SerialError> {
        let now = self.line.now();
        if self.governor.expired(now) {
            self.stop()?;
        }
        let (sensors, stamp) = self.read(self.params.timeout)?;
        Ok(BaseStatus {
            stamp,
            travel: WheelTravel {
                left: self.counts[0].total as f64 * COUNT,
                right: self.counts[1].total as f64 * COUNT,
            },
            bump_left: sensors.bumpers & 0b110 != 0,
            bump_right: sensors.bumpers & 0b011 != 0,
            cliff: sensors.cliffs != 0,
            wheel_drop: sensors.wheel_drops != 0,
        })
    }
}

impl<P: Read + Write, C: Clock> Drop for Kobuki<P, C> {
    fn drop(&mut self) {
        // nobody is left to tell
        self.line.send(&base_control(0, 0)).ok();
    }
}
