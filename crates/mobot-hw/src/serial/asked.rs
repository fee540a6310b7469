//! US-100 and SRF02: asked by a byte or two, they answer with two bytes, high first, without framing or
//! checksum. A ping asks until two of three answers agree.
//!
//! US-100 (jumper set): 9600 baud 8N1, `55` gives mm. SRF02, after
//! robot-electronics.co.uk/htm/srf02techSer.htm: 9600 baud, two stop bits, address 0 to 15 and `54`
//! gives cm, 0 where nothing was heard, within 70 ms.

use std::io::{Read, Write};

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

/// A sonar that is asked.
#[derive(Debug)]
struct Asked<P, C> {
    line: Line<P, C>,
    decoder: Decoder,
    command: [u8; 2],
    length: usize,
    unit: f64,
    bounds: SonarBounds,
    bearing: f64,
    timeout: f64,
}

impl<P: Read + Write, C: Clock> Asked<P, C> {
    fn ping(&mut self, bearing: f64) -> Result<Ping, SerialError> {
        within(Bearings::fixed(self.bearing), bearing)?;
        let began = self.line.now();
        let mut gate = Gate::default();
        loop {
            let left = self.timeout - (self.line.now() - began);
            let question = &self.command[..self.length];
            let (stamp, bytes) = self.line.ask(question, &mut self.decoder, left)?;
            let reading = match u16::from_be_bytes(bytes) {
                0 => self.bounds.reading(f64::INFINITY),
                value => self.bounds.reading(f64::from(value) * self.unit),
            };
            if let Some(reading) = gate.pass(reading) {
                return Ok(Ping {
                    stamp,
                    bearing: self.bearing,
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

/// A US-100.
#[derive(Debug)]
pub struct Us100<P, C>(Asked<P, C>);

impl<P: Read + Write, C: Clock> Us100<P, C> {
    /// On a port of [`BAUD`].
    #[must_use]
    pub fn new(port: P, clock: C, params: Us100Params) -> Self {
        Self(Asked {
            line: Line::new(port, clock),
            decoder: Decoder::default(),
            command: [US100_RANGE, 0],
            length: 1,
            unit: 0.001,
            bounds: SonarBounds {
                nearest: 0.02,
                farthest: params.farthest,
            },
            bearing: params.bearing,
            timeout: params.timeout,
        })
    }

    /// What came over the line so far.
    #[must_use]
    pub const fn counts(&self) -> LineCounts {
        self.0.line.counts()
    }
}

impl<P: Read + Write, C: Clock> RangeFinder for Us100<P, C> {
    type Error = SerialError;

    fn bearings(&self) -> Bearings {
        Bearings::fixed(self.0.bearing)
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, SerialError> {
        self.0.ping(bearing)
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

/// An SRF02.
#[derive(Debug)]
pub struct Srf02<P, C>(Asked<P, C>);

impl<P: Read + Write, C: Clock> Srf02<P, C> {
    /// On a port of [`BAUD`] with two stop bits.
    #[must_use]
    pub fn new(port: P, clock: C, params: Srf02Params) -> Self {
        Self(Asked {
            line: Line::new(port, clock),
            decoder: Decoder::default(),
            command: [params.address & 0x0F, SRF02_RANGE_CM],
            length: 2,
            unit: 0.01,
            bounds: SonarBounds {
                nearest: params.nearest,
                farthest: params.farthest,
            },
            bearing: params.bearing,
            timeout: params.timeout,
        })
    }

    /// What came over the line so far.
    #[must_use]
    pub const fn counts(&self) -> LineCounts {
        self.0.line.counts()
    }
}

impl<P: Read + Write, C: Clock> RangeFinder for Srf02<P, C> {
    type Error = SerialError;

    fn bearings(&self) -> Bearings {
        Bearings::fixed(self.0.bearing)
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, SerialError> {
        self.0.ping(bearing)
    }
}
