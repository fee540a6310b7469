//! Sonars that send `FF`, high, low, sum: JSN-SR04T, DFRobot A01, A02, ME007. After DFRobot's pages
//! SEN0311, SEN0312 and SEN0313: 9600 baud 8N1, millimetres, the sum is the low byte of the other three's.

use std::io::{Read, Write};

use super::decode::{Decode as _, Scanner};
use super::line::{Line, LineCounts, SerialError, link_time, within};
use super::sonar_bounds::SonarBounds;
use super::sum_frame::{SumFraming, sum_frame};
use crate::{Bearings, Clock, Ping, RangeFinder};

/// Baud rate of the line.
pub const BAUD: u32 = 9600;
/// Asks a sonar that waits to be asked.
pub const ASK: u8 = 0x55;
/// Largest distance of a frame [mm].
pub const MAX_MM: u16 = 0x27FF;

/// Finds distances in millimetres.
pub type Decoder = Scanner<SumFraming<0xFF, { (MAX_MM >> 8) as u8 }, false>>;

/// The frame of a distance [mm].
#[must_use]
pub const fn encode(mm: u16) -> [u8; 4] {
    let [high, low] = mm.to_be_bytes();
    sum_frame(0xFF, high, low)
}

/// How such a sonar is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FfParams {
    /// The sonar waits for `55` (JSN-SR04T with 120 kOhm at R27) instead of sending by itself.
    pub ask: bool,
    /// Time from one firing to the next where it sends by itself [s]; raising it delays a ping.
    pub cycle: f64,
    /// Things nearer than this are too close [m].
    pub nearest: f64,
    /// From here on it hears nothing [m]; such sonars then send 0 or their maximum.
    pub farthest: f64,
    /// Direction in which it looks [rad, base frame]; 0 on a turret.
    pub bearing: f64,
    /// A ping may take this long [s]; at least three cycles.
    pub timeout: f64,
}

impl Default for FfParams {
    /// A02: by itself, 0.03 to 4.5 m.
    fn default() -> Self {
        Self {
            ask: false,
            cycle: 0.1,
            nearest: 0.03,
            farthest: 4.5,
            bearing: 0.0,
            timeout: 0.6,
        }
    }
}

/// A sonar of the `FF` family.
#[derive(Debug)]
pub struct FfSonar<P, C> {
    line: Line<P, C>,
    decoder: Decoder,
    params: FfParams,
}

impl<P: Read + Write, C: Clock> FfSonar<P, C> {
    /// On a port of [`BAUD`].
    #[must_use]
    pub fn new(port: P, clock: C, params: FfParams) -> Self {
        Self {
            line: Line::new(port, clock),
            decoder: Decoder::default(),
            params,
        }
    }

    /// What came over the line so far.
    #[must_use]
    pub const fn counts(&self) -> LineCounts {
        self.line.counts()
    }
}

impl<P: Read + Write, C: Clock> RangeFinder for FfSonar<P, C> {
    type Error = SerialError;

    fn bearings(&self) -> Bearings {
        Bearings::fixed(self.params.bearing)
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, SerialError> {
        within(self.bearings(), bearing)?;
        let p = self.params;
        let bounds = SonarBounds {
            nearest: p.nearest,
            farthest: p.farthest,
        };
        if p.ask {
            self.line.drain()?;
            self.decoder.reset();
            self.line.send(&[ASK])?;
        }
        let began = self.line.now();
        let (mm, stamp) = self
            .line
            .listen(&mut self.decoder, p.timeout, |mm, heard| {
                let fired =
                    heard - link_time(4, f64::from(BAUD)) - if p.ask { 0.0 } else { p.cycle };
                (p.ask || fired >= began).then_some((mm, if p.ask { began } else { fired }))
            })?;
        let reading = match mm {
            0 => bounds.reading(f64::INFINITY),
            _ => bounds.reading(f64::from(mm) / 1000.0),
        };
        Ok(Ping {
            stamp,
            bearing: p.bearing,
            settled: true,
            reading,
        })
    }
}
