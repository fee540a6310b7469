//! iRobot Create 2 and Roomba 500 to 800, their Open Interface. After "iRobot Create 2 Open Interface
//! (OI) Specification based on the iRobot Roomba 600", 2018: 115200 baud 8N1, big-endian.
//!
//! The base has no watchdog: the last drive command runs for ever. The driver stops it where a command
//! was not renewed for 0.2 s and the driver is called at all, and when it is dropped; for a program that
//! was killed or hangs something else must hold the port.

use std::io::{Read, Write};

use super::decode::{Decode as _, FrameFault, Framing, Scanner, Verdict};
use super::line::{Line, LineCounts, SerialError};
use super::wheels::{Governor, JUST_NOW, UNREAD, Unwrapped, WheelLimits, moves};
use crate::{
    BaseStatus, Clock, DeviceError as _, DifferentialDrive, FaultKind, Twist2, WheelTravel,
};

/// Baud rate of the line.
pub const BAUD: u32 = 115_200;
/// Distance between the wheels [m].
pub const TRACK: f64 = 0.235;
/// Way of a wheel for one count: 72 mm wheels, 508.8 counts a turn [m].
pub const COUNT: f64 = 0.072 * std::f64::consts::PI / 508.8;
/// Fastest that a wheel may be told [mm/s].
pub const MAX_MM_S: i16 = 500;

/// Puts the interface into passive mode.
pub const START: u8 = 128;
/// Puts it into safe mode: it drives, and stops by itself at cliffs.
pub const SAFE: u8 = 131;
/// Asks for a stream of packets.
pub const STREAM: u8 = 148;
/// Pauses (0) or resumes (1) the stream.
pub const PAUSE: u8 = 150;
/// Drives the wheels, right first.
pub const DRIVE_DIRECT: u8 = 145;

/// The packets of the driver's stream and their sizes: bumps and wheel drops, four cliffs, the counters,
/// the mode. The one that a lost byte could shift is of one byte and last.
pub const PACKETS: [(u8, usize); 8] = [
    (7, 1),
    (9, 1),
    (10, 1),
    (11, 1),
    (12, 1),
    (43, 2),
    (44, 2),
    (35, 1),
];

/// A drive command for speeds of left and right wheel [mm/s].
#[must_use]
pub const fn drive_direct(left: i16, right: i16) -> [u8; 5] {
    let ([rh, rl], [lh, ll]) = (right.to_be_bytes(), left.to_be_bytes());
    [DRIVE_DIRECT, rh, rl, lh, ll]
}

/// The mode that the interface is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Mode {
    /// It does not listen.
    #[default]
    Off,
    /// It tells, and does not drive.
    Passive,
    /// It drives, and leaves for passive mode at a cliff, a wheel drop or a charger.
    Safe,
    /// It drives, whatever happens.
    Full,
}

/// What one frame of the driver's stream tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sensors {
    /// Bit 0 right bumper, 1 left bumper, 2 right wheel drop, 3 left wheel drop.
    pub bumps_and_drops: u8,
    /// Whether the floor ends: left, front left, front right, right.
    pub cliffs: [bool; 4],
    /// Count of the left wheel, wraps at 65 535.
    pub left: u16,
    /// Count of the right wheel, wraps at 65 535.
    pub right: u16,
    /// The mode.
    pub mode: Mode,
}

/// Bytes of a frame: header, length, an id before each packet, checksum.
const FRAME: usize = 3 + 8 + 10;

/// The stream frame that tells this.
#[must_use]
pub fn encode(sensors: &Sensors) -> Vec<u8> {
    let cliffs = sensors.cliffs.map(u8::from);
    let ([lh, ll], [rh, rl]) = (sensors.left.to_be_bytes(), sensors.right.to_be_bytes());
    let mut frame = vec![19, FRAME as u8 - 3, 7, sensors.bumps_and_drops];
    for (id, cliff) in (9..).zip(cliffs) {
        frame.extend([id, cliff]);
    }
    frame.extend([43, lh, ll, 44, rh, rl, 35, sensors.mode as u8]);
    let sum = frame.iter().fold(0_u8, |sum, b| sum.wrapping_add(*b));
    frame.push(sum.wrapping_neg());
    frame
}

/// The form of the driver's stream frames: header 19, length, and every id at its place. All bytes of a
/// frame add up to 0.
#[derive(Debug, Clone, Copy, Default)]
pub struct StreamFraming;

impl Framing for StreamFraming {
    type Message = Sensors;

    fn longest(&self) -> usize {
        FRAME
    }

    fn self_evident(&self) -> bool {
        true
    }

    fn inspect(&self, bytes: &[u8], _ended: bool) -> Verdict<Sensors> {
        if bytes[0] != 19 {
            return Verdict::Bad(FrameFault::Stray);
        }
        if bytes.get(1).is_some_and(|n| *n != FRAME as u8 - 3) {
            return Verdict::Bad(FrameFault::Form);
        }
        let mut place = 2;
        for (id, size) in PACKETS {
            if bytes.get(place).is_some_and(|found| *found != id) {
                return Verdict::Bad(FrameFault::Form);
            }
            place += 1 + size;
        }
        let Some(frame) = bytes.get(..FRAME) else {
            return Verdict::Wait;
        };
        let sum = frame.iter().fold(0_u8, |sum, b| sum.wrapping_add(*b));
        let found = frame[FRAME - 1];
        if sum != 0 {
            let expected = found.wrapping_sub(sum);
            return Verdict::Bad(FrameFault::Checksum { expected, found });
        }
        let mode = match frame[19] {
            0 => Mode::Off,
            1 => Mode::Passive,
            2 => Mode::Safe,
            3 => Mode::Full,
            _ => return Verdict::Bad(FrameFault::Form),
        };
        Verdict::Good {
            message: Sensors {
                bumps_and_drops: frame[3],
                cliffs: [frame[5], frame[7], frame[9], frame[11]].map(|c| c & 1 == 1),
                left: u16::from_be_bytes([frame[13], frame[14]]),
                right: u16::from_be_bytes([frame[16], frame[17]]),
                mode,
            },
            length: FRAME,
        }
    }
}

/// Finds the frames of the driver's stream.
pub type Decoder = Scanner<StreamFraming>;

/// How a Create 2 is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Create2Params {
    /// The last limits of every command, at most 0.5 m/s.
    pub limits: WheelLimits,
    /// A status may take this long [s]; the base sends one every 15 ms.
    pub timeout: f64,
}

impl Default for Create2Params {
    fn default() -> Self {
        Self {
            limits: WheelLimits::default(),
            timeout: 0.1,
        }
    }
}

/// Time in which it enters safe mode, or does not [s].
const START_UP: f64 = 1.0;
/// Time between two commands that change the mode [s].
const MODE_CHANGE: f64 = 0.02;

/// A Create 2, in safe mode.
#[derive(Debug)]
pub struct Create2<P: Read + Write, C: Clock> {
    line: Line<P, C>,
    decoder: Decoder,
    params: Create2Params,
    governor: Governor,
    counts: [Unwrapped; 2],
    read_at: f64,
    mode: Mode,
}

impl<P: Read + Write, C: Clock> Create2<P, C> {
    /// On a port of [`BAUD`]: stops, starts the interface and its stream, and waits for safe mode, at most
    /// 1 s.
    ///
    /// # Errors
    /// The line's; [`SerialError::Refused`] where the base does not enter safe mode.
    pub fn open(port: P, clock: C, params: Create2Params) -> Result<Self, SerialError> {
        let max_speed = params.limits.max_speed.min(f64::from(MAX_MM_S) / 1000.0);
        let limits = WheelLimits {
            max_speed,
            ..params.limits
        };
        let mut base = Self {
            line: Line::new(port, clock),
            decoder: Decoder::default(),
            params,
            governor: Governor::new(limits, TRACK),
            counts: [Unwrapped::default(); 2],
            read_at: f64::NEG_INFINITY,
            mode: Mode::Off,
        };
        base.rearm()?;
        Ok(base)
    }

    /// Stops and enters safe mode again, after the base has left it or the line has failed.
    ///
    /// # Errors
    /// As [`Create2::open`].
    pub fn rearm(&mut self) -> Result<(), SerialError> {
        // a command that was cut off swallows the first one's bytes, never the second's
        let stops = [drive_direct(0, 0), drive_direct(0, 0)].concat();
        let mut stream = vec![STREAM, PACKETS.len() as u8];
        stream.extend(PACKETS.map(|(id, _)| id));
        for command in [&stops[..], &[PAUSE, 0], &[START], &[SAFE]] {
            self.line.send(command)?;
            self.line.sleep(MODE_CHANGE);
        }
        self.line.drain()?;
        self.decoder.reset();
        self.line.send(&stream)?;
        self.line.send(&drive_direct(0, 0))?;
        let now = self.line.now();
        self.governor.halt(now);
        let deadline = now + START_UP;
        loop {
            // the first frames may be late, or cut off
            let heard = self.read(self.params.timeout);
            let over = self.line.now() >= deadline;
            match heard {
                Ok(_) if matches!(self.mode, Mode::Safe | Mode::Full) => return Ok(()),
                Ok(_) if over => break,
                Err(error) if over || error.kind() == FaultKind::Unplugged => return Err(error),
                _ => {}
            }
        }
        Err(SerialError::Refused {
            reason: "it does not enter safe mode: a cliff, a lifted wheel or the charger",
        })
    }

    /// What came over the line so far.
    #[must_use]
    pub const fn counts(&self) -> LineCounts {
        self.line.counts()
    }

    /// The newest frame and when it came [s].
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
        let newest = newest?;
        self.mode = newest.0.mode;
        Ok(newest)
    }

    fn send(&mut self, wheels: [f64; 2]) -> Result<(), SerialError> {
        let [left, right] = wheels.map(|w| (w * 1000.0).round() as i16);
        let result = self.line.send(&drive_direct(left, right));
        if let Err(SerialError::HalfWritten { .. }) = result {
            // the rest of the command is missing: one stop is swallowed, the next one counts
            let stops = [drive_direct(0, 0), drive_direct(0, 0)].concat();
            self.line.send(&stops).ok();
            let now = self.line.now();
            self.governor.halt(now);
        }
        result
    }
}

impl<P: Read + Write, C: Clock> DifferentialDrive for Create2<P, C> {
    type Error = SerialError;

    fn track(&self) -> f64 {
        TRACK
    }

    /// Refused where the base was last heard to have left safe mode; a stop never is.
    fn drive(&mut self, command: Twist2) -> Result<(), SerialError> {
        let now = self.line.now();
        let wheels = self.governor.allow(command, now);
        if moves(wheels) && !matches!(self.mode, Mode::Safe | Mode::Full) {
            self.stop()?;
            return Err(SerialError::Refused {
                reason: "it has left safe mode",
            });
        }
        self.send(wheels)
    }

    fn stop(&mut self) -> Result<(), SerialError> {
        let now = self.line.now();
        let wheels = self.governor.halt(now);
        self.send(wheels)
    }

    /// The newest frame. Refused where the base has left safe mode and nothing else tells why.
    fn status(&mut self) -> Result<BaseStatus, SerialError> {
        let now = self.line.now();
        if self.governor.expired(now) {
            self.stop()?;
        }
        let (sensors, stamp) = self.read(self.params.timeout)?;
        let bits = sensors.bumps_and_drops;
        let status = BaseStatus {
            stamp,
            travel: WheelTravel {
                left: self.counts[0].total as f64 * COUNT,
                right: self.counts[1].total as f64 * COUNT,
            },
            bump_left: bits & 0b10 != 0,
            bump_right: bits & 0b01 != 0,
            cliff: sensors.cliffs.contains(&true),
            wheel_drop: bits & 0b1100 != 0,
        };
        if !matches!(self.mode, Mode::Safe | Mode::Full) {
            self.governor.halt(now);
            if !status.in_trouble() {
                return Err(SerialError::Refused {
                    reason: "it has left safe mode",
                });
            }
        }
        Ok(status)
    }
}

impl<P: Read + Write, C: Clock> Drop for Create2<P, C> {
    fn drop(&mut self) {
        // nobody is left to tell
        self.line.send(&drive_direct(0, 0)).ok();
    }
}
