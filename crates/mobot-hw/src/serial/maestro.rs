//! Pololu Maestro: a servo that pans a sensor. After Pololu's manual 0J40, sections 4.e and 5.a to 5.e.
//!
//! Commands in the compact form. Over USB the Maestro listens only in the modes "USB Dual Port" and "USB
//! Chained"; as it leaves the factory it ignores the port. Its position is the one it commands, not the
//! shaft's, so the time for a turn is reckoned here. A hobby servo spans about 180 degrees.

use std::io::{Read, Write};

use super::burst::Burst;
use super::line::{Line, LineCounts, SerialError, within};
use crate::{Bearings, Clock, PanActuator};

/// Baud rate of the line; over USB any.
pub const BAUD: u32 = 9600;

/// A command to the Maestro.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Turn a channel's servo to a pulse width in quarter microseconds; 0 stops the pulses.
    Target(u8, u16),
    /// Limit a channel's speed, 0.25 us in 10 ms; 0 is no limit.
    Speed(u8, u16),
    /// Limit a channel's acceleration; 0 is no limit.
    Acceleration(u8, u16),
    /// Ask for a channel's pulse width: two bytes, low first.
    Position(u8),
    /// Ask whether any servo still moves: one byte.
    Moving,
    /// Ask for the errors since the last such question: two bytes, low first.
    Errors,
    /// Send all servos home.
    Home,
}

impl Command {
    /// Its bytes, in the compact form.
    #[must_use]
    pub fn bytes(self) -> Vec<u8> {
        // data bytes have seven bits
        let pair = |v: u16| [(v & 0x7F) as u8, (v >> 7 & 0x7F) as u8];
        let set = |command, channel, [low, high]: [u8; 2]| vec![command, channel & 0x7F, low, high];
        match self {
            Self::Target(channel, v) => set(0x84, channel, pair(v)),
            Self::Speed(channel, v) => set(0x87, channel, pair(v)),
            Self::Acceleration(channel, v) => set(0x89, channel, pair(v)),
            Self::Position(channel) => vec![0x90, channel & 0x7F],
            Self::Moving => vec![0x93],
            Self::Errors => vec![0xA1],
            Self::Home => vec![0xA2],
        }
    }
}

/// An answer of two bytes.
#[must_use]
pub const fn answer(value: u16) -> [u8; 2] {
    value.to_le_bytes()
}

/// How the servo is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaestroParams {
    /// Its channel.
    pub channel: u8,
    /// Pulse width at which the sensor looks straight ahead [us].
    pub centre_us: f64,
    /// Pulse width for one radian counter-clockwise [us]; negative for a servo mounted upside down.
    pub us_per_rad: f64,
    /// Least and largest pulse width [us]; the Maestro's own limits must allow them.
    pub limits_us: [f64; 2],
    /// Speed of the servo [rad/s], above 0; too fast a guess ends a turn before the servo does.
    pub speed: f64,
    /// Time the servo swings after a turn [s].
    pub settle: f64,
    /// An answer may take this long [s].
    pub timeout: f64,
}

impl Default for MaestroParams {
    /// A common servo: 1 ms for 90 degrees either side of 1.5 ms, within the Maestro's default limits.
    fn default() -> Self {
        Self {
            channel: 0,
            centre_us: 1500.0,
            us_per_rad: 1000.0 / std::f64::consts::PI,
            limits_us: [992.0, 2000.0],
            speed: 5.0,
            settle: 0.2,
            timeout: 0.1,
        }
    }
}

/// A servo on a Maestro.
#[derive(Debug)]
pub struct Maestro<P, C> {
    line: Line<P, C>,
    params: MaestroParams,
    stands_at: Option<f64>,
}

impl<P: Read + Write, C: Clock> Maestro<P, C> {
    /// On the Maestro's command port.
    #[must_use]
    pub const fn new(port: P, clock: C, params: MaestroParams) -> Self {
        Self {
            line: Line::new(port, clock),
            params,
            stands_at: None,
        }
    }

    /// What came over the line so far.
    #[must_use]
    pub const fn counts(&self) -> LineCounts {
        self.line.counts()
    }

    /// Where the servo was told to stand [rad], nowhere where it gets no pulses. Moves nothing.
    ///
    /// # Errors
    /// The line's.
    pub fn commanded(&mut self) -> Result<Option<f64>, SerialError> {
        let quarters = self.ask(Command::Position(self.params.channel))?;
        let us = f64::from(quarters) / 4.0;
        Ok((quarters > 0).then(|| self.bearing_of(us)))
    }

    fn bearing_of(&self, us: f64) -> f64 {
        (us - self.params.centre_us) / self.params.us_per_rad
    }

    fn ask(&mut self, command: Command) -> Result<u16, SerialError> {
        let mut decoder = Burst::<2>::default();
        let timeout = self.params.timeout;
        let (_, bytes) = self.line.ask(&command.bytes(), &mut decoder, timeout)?;
        Ok(u16::from_le_bytes(bytes))
    }
}

impl<P: Read + Write, C: Clock> PanActuator for Maestro<P, C> {
    type Error = SerialError;

    fn bearings(&self) -> Bearings {
        let ends = self.params.limits_us.map(|us| self.bearing_of(us));
        Bearings {
            from: ends[0].min(ends[1]),
            to: ends[0].max(ends[1]),
        }
    }

    /// Asks for errors and for the position afterwards: on any error the Maestro sends its servos home.
    fn turn_to(&mut self, bearing: f64) -> Result<f64, SerialError> {
        within(self.bearings(), bearing)?;
        let p = self.params;
        let target = ((p.centre_us + bearing * p.us_per_rad) * 4.0).round() as u16;
        let there = self.bearing_of(f64::from(target) / 4.0);
        let reach = self.bearings();
        let turn = self
            .stands_at
            .take()
            .map_or(reach.to - reach.from, |from| (there - from).abs());
        self.line
            .send(&Command::Target(p.channel, target).bytes())?;
        if turn > 1e-9 {
            self.line.sleep(turn / p.speed + p.settle);
        }
        if self.ask(Command::Errors)? != 0 {
            return Err(SerialError::Refused {
                reason: "the Maestro reports an error and has sent its servos home",
            });
        }
        if self.ask(Command::Position(p.channel))? != target {
            return Err(SerialError::Refused {
                reason: "the Maestro's own limits keep the servo from there",
            });
        }
        self.stands_at = Some(there);
        Ok(there)
    }
}
