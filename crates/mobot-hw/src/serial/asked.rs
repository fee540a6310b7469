//! US-100 and SRF02: asked by a byte or two, they answer with two bytes, high first, without framing or
//! checksum. A ping asks until two of three answers agree.
//!
//! US-100 (jumper set): 9600 baud 8N1, `55` gives mm. SRF02, after
//! robot-electronics.co.uk/htm/srf02techSer.htm: 9600 baud, two stop bits, address 0 to 15 and `54`
//! gives cm, 0 where nothing was heard, within 70 ms.

use std::io::{Read, Write};

use occgrid::Reading;

use super::burst::Burst;
use super::gate::Gate;
use super::line::{Line, LineCounts, SerialError, within};
use super::sonar_bounds::SonarBounds;
use crate::{Bearings, Clock, Ping, RangeFinder};

/// Baud rate of the line.
pub const BAUD: u32 = 9600;
/// US-100: measure.
pub const US100_RANGE: u8 = 0x55;
/// US-100: temperature, answered by one byte of degC + 45.
pub const US100_TEMPERATURE: u8 = 0x50;
/// SRF02: measure in cm and send the result.
pub const SRF02_RANGE_CM: u8 = 0x54;
/// SRF02: its software's version.
pub const SRF02_VERSION: u8 = 0x5D;

/// Finds the two bytes of an answer.
pub type Decoder = Burst<2>;

/// An answer.
#[must_use]
pub const fn encode(value: u16) -> [u8; 2] {
    value.to_be_bytes()
}

/// What makes one such sonar differ from another.
trait Question {
    /// What asks it.
    fn bytes(&self) -> impl AsRef<[u8]>;

    /// What its number counts [m].
    fn unit(&self) -> f64;

    /// No larger number comes from it.
    fn most(&self) -> u16;

    /// The ends of its range.
    fn bounds(&self) -> SonarBounds;

    /// Where it looks [rad], and how long a ping may take [s].
    fn bearing_and_timeout(&self) -> [f64; 2];
}

/// A sonar that is asked, by its parameters.
#[derive(Debug)]
pub struct Asked<P, C, K> {
    line: Line<P, C>,
    decoder: Decoder,
    params: K,
}

/// A US-100.
pub type Us100<P, C> = Asked<P, C, Us100Params>;

/// An SRF02.
pub type Srf02<P, C> = Asked<P, C, Srf02Params>;

impl<P: Read + Write, C: Clock, K> Asked<P, C, K> {
    /// On a port of [`BAUD`]; an SRF02's has two stop bits.
    #[must_use]
    pub fn new(port: P, clock: C, params: K) -> Self {
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

impl<P: Read + Write, C: Clock, K: Question> RangeFinder for Asked<P, C, K> {
    type Error = SerialError;

    fn bearings(&self) -> Bearings {
        Bearings::fixed(self.params.bearing_and_timeout()[0])
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, SerialError> {
        let [looks, timeout] = self.params.bearing_and_timeout();
        within(Bearings::fixed(looks), bearing)?;
        let (unit, bounds) = (self.params.unit(), self.params.bounds());
        let began = self.line.now();
        let mut gate = Gate::default();
        loop {
            let left = timeout - (self.line.now() - began);
            let question = self.params.bytes();
            let (stamp, bytes) = self.line.ask(question.as_ref(), &mut self.decoder, left)?;
            let reading = match u16::from_be_bytes(bytes) {
                0 => bounds.reading(f64::INFINITY),
                value if value > self.params.most() => Reading::Fault,
                value => bounds.reading(f64::from(value) * unit),
            };
            if let Some(reading) = gate.pass(reading) {
                return Ok(Ping {
                    stamp,
                    bearing: looks,
                    settled: true,
                    reading,
                });
            }
        }
    }
}

/// How a US-100 is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Us100Params {
    /// Direction in which it looks [rad, base frame]; 0 on a turret.
    pub bearing: f64,
    /// From here on it hears nothing [m].
    pub farthest: f64,
    /// A ping, of up to three measurements, may take this long [s].
    pub timeout: f64,
}

impl Default for Us100Params {
    fn default() -> Self {
        Self {
            bearing: 0.0,
            farthest: 4.5,
            timeout: 0.5,
        }
    }
}

impl Question for Us100Params {
    fn bytes(&self) -> impl AsRef<[u8]> {
        [US100_RANGE]
    }

    fn unit(&self) -> f64 {
        0.001
    }

    fn most(&self) -> u16 {
        // without an echo some send up to 11 m
        12_000
    }

    fn bounds(&self) -> SonarBounds {
        SonarBounds {
            nearest: 0.02,
            farthest: self.farthest,
        }
    }

    fn bearing_and_timeout(&self) -> [f64; 2] {
        [self.bearing, self.timeout]
    }
}

/// How an SRF02 is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Srf02Params {
    /// Its address on the line, 0 to 15.
    pub address: u8,
    /// Direction in which it looks [rad, base frame]; 0 on a turret.
    pub bearing: f64,
    /// Things nearer than this are too close [m].
    pub nearest: f64,
    /// From here on it hears nothing [m].
    pub farthest: f64,
    /// A ping, of up to three measurements, may take this long [s].
    pub timeout: f64,
}

impl Default for Srf02Params {
    fn default() -> Self {
        Self {
            address: 0,
            bearing: 0.0,
            nearest: 0.15,
            farthest: 6.0,
            timeout: 0.5,
        }
    }
}

impl Question for Srf02Params {
    fn bytes(&self) -> impl AsRef<[u8]> {
        [self.address & 0x0F, SRF02_RANGE_CM]
    }

    fn unit(&self) -> f64 {
        0.01
    }

    fn most(&self) -> u16 {
        1200
    }

    fn bounds(&self) -> SonarBounds {
        SonarBounds {
            nearest: self.nearest,
            farthest: self.farthest,
        }
    }

    fn bearing_and_timeout(&self) -> [f64; 2] {
        [self.bearing, self.timeout]
    }
}
