//! DFRobot URM37 (SEN0001): one command turns its servo and measures. After the maker's page
//! wiki.dfrobot.com/sen0001: 9600 baud 8N1, commands and answers of four bytes, the last the low byte of
//! the sum of the others. `22 angle 00` turns and measures, the answer `22 high low` is in cm, `FF FF` is
//! no echo; `11 00 00` asks for the temperature in 0.1 degC.

use std::io::{Read, Write};

use super::decode::Scanner;
use super::line::{Line, LineCounts, SerialError, within};
use super::sonar_bounds::SonarBounds;
use super::sum_frame::{SumFraming, sum_frame};
use crate::{Bearings, Clock, Ping, RangeFinder};

/// Baud rate of the line.
pub const BAUD: u32 = 9600;
/// Command that turns and measures.
pub const RANGE: u8 = 0x22;
/// Command that asks for the temperature.
pub const TEMPERATURE: u8 = 0x11;
/// An answer that is none: no echo, no temperature.
pub const INVALID: u16 = 0xFFFF;
/// Most steps of the servo.
pub const MAX_STEPS: u8 = 46;

/// A command: turn to so many steps and measure.
#[must_use]
pub const fn command(steps: u8) -> [u8; 4] {
    sum_frame(RANGE, steps, 0)
}

/// An answer.
#[must_use]
pub const fn answer(command: u8, value: u16) -> [u8; 4] {
    let [high, low] = value.to_be_bytes();
    sum_frame(command, high, low)
}

/// Finds the distances in cm, at most 1023 or [`INVALID`].
pub type Decoder = Scanner<SumFraming<RANGE, 3, true>>;

/// How a URM37 is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Urm37Params {
    /// Angle of one step of the servo [rad]. Default 6 degrees (46 steps are 270 degrees); firmware from
    /// V4.0 differs: check it with a scan of a known wall.
    pub step: f64,
    /// Steps at which it looks straight ahead, 0 to 46.
    pub centre: u8,
    /// More steps turn it clockwise.
    pub clockwise: bool,
    /// Speed of the servo [rad/s], above 0; too fast a guess measures while it still turns.
    pub speed: f64,
    /// Time the servo swings after a turn [s].
    pub settle: f64,
    /// Things nearer than this are too close [m].
    pub nearest: f64,
    /// From here on it hears nothing [m].
    pub farthest: f64,
    /// One answer may take this long [s].
    pub timeout: f64,
}

impl Default for Urm37Params {
    fn default() -> Self {
        Self {
            step: 6.0_f64.to_radians(),
            centre: 23,
            clockwise: false,
            speed: 5.0,
            settle: 0.2,
            nearest: 0.04,
            farthest: 5.0,
            timeout: 0.3,
        }
    }
}

/// A URM37 with its servo.
#[derive(Debug)]
pub struct Urm37<P, C> {
    line: Line<P, C>,
    decoder: Decoder,
    params: Urm37Params,
    stands_at: Option<u8>,
}

impl<P: Read + Write, C: Clock> Urm37<P, C> {
    /// On a port of [`BAUD`].
    #[must_use]
    pub fn new(port: P, clock: C, params: Urm37Params) -> Self {
        Self {
            line: Line::new(port, clock),
            decoder: Decoder::default(),
            params,
            stands_at: None,
        }
    }

    /// What came over the line so far.
    #[must_use]
    pub const fn counts(&self) -> LineCounts {
        self.line.counts()
    }

    fn bearing_of(&self, steps: u8) -> f64 {
        let off = (f64::from(steps) - f64::from(self.params.centre)) * self.params.step;
        if self.params.clockwise { -off } else { off }
    }

    fn steps_to(&self, bearing: f64) -> u8 {
        let off = if self.params.clockwise {
            -bearing
        } else {
            bearing
        };
        let steps = f64::from(self.params.centre) + off / self.params.step;
        steps.round().clamp(0.0, f64::from(MAX_STEPS)) as u8
    }

    /// Sends the command; gives when [s], and the answer [cm].
    fn ask(&mut self, steps: u8) -> Result<(f64, u16), SerialError> {
        self.stands_at = None;
        let timeout = self.params.timeout;
        let answer = self.line.ask(&command(steps), &mut self.decoder, timeout)?;
        self.stands_at = Some(steps);
        Ok(answer)
    }
}

impl<P: Read + Write, C: Clock> RangeFinder for Urm37<P, C> {
    type Error = SerialError;

    fn bearings(&self) -> Bearings {
        let ends = [self.bearing_of(0), self.bearing_of(MAX_STEPS)];
        Bearings {
            from: ends[0].min(ends[1]),
            to: ends[0].max(ends[1]),
        }
    }

    /// Aims at the step nearest to `bearing`. Where that means a turn, a first command turns, its reading
    /// is thrown away, and a second one measures.
    fn ping(&mut self, bearing: f64) -> Result<Ping, SerialError> {
        within(self.bearings(), bearing)?;
        let p = self.params;
        let steps = self.steps_to(bearing);
        if self.stands_at != Some(steps) {
            let turn = self.stands_at.map_or(f64::from(MAX_STEPS), |from| {
                (f64::from(from) - f64::from(steps)).abs()
            });
            self.ask(steps)?;
            self.line.sleep(turn * p.step / p.speed + p.settle);
        }
        let (stamp, cm) = self.ask(steps)?;
        let bounds = SonarBounds {
            nearest: p.nearest,
            farthest: p.farthest,
        };
        let reading = match cm {
            INVALID => bounds.reading(f64::INFINITY),
            _ => bounds.reading(f64::from(cm) / 100.0),
        };
        Ok(Ping {
            stamp,
            bearing: self.bearing_of(steps),
            settled: true,
            reading,
        })
    }
}
