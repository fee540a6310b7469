//! MaxBotix sonars with ASCII output: LV, XL, HRLV, HRUSB, HRXL. After the maker's sheets PD11832 (LV-EZ),
//! PD12141 (HRUSB), PD11500 (HRXL-WR).
//!
//! They fire by themselves and send `R`, digits and a carriage return once a cycle, 9600 baud 8N1, HRUSB
//! with a space before the return. There is no checksum: a ping takes two readings that agree. The signal
//! has RS-232 polarity at logic levels; a wrong adaptor shows as faults only.

use std::io::{Read, Write};

use super::decode::{Decode, Event, FrameFault};
use super::gate::Gate;
use super::line::{Line, LineCounts, SerialError, link_time, within};
use super::sonar_bounds::SonarBounds;
use crate::{Bearings, Clock, Ping, RangeFinder};

/// Baud rate of the line.
pub const BAUD: u32 = 9600;

/// A family of sonars.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum MaxBotixModel {
    /// LV-MaxSonar-EZ: inches, 6 to 254.
    #[default]
    Lv,
    /// XL-MaxSonar: cm, 20 to 765.
    Xl,
    /// XL-MaxSonar of 10 m: cm in four digits, 20 to 1068.
    XlLong,
    /// HRLV-MaxSonar and HRUSB-MaxSonar: mm, 300 to 5000.
    Hrlv,
    /// HRXL-MaxSonar of 5 m: mm, 300 to 5000.
    Hrxl,
    /// HRXL-MaxSonar of 10 m: mm, 500 to 9999.
    HrxlLong,
}

impl MaxBotixModel {
    /// Digits of a reading.
    #[must_use]
    pub const fn digits(self) -> usize {
        match self {
            Self::Lv | Self::Xl => 3,
            Self::XlLong | Self::Hrlv | Self::Hrxl | Self::HrxlLong => 4,
        }
    }

    /// What a reading counts [m].
    #[must_use]
    pub const fn unit(self) -> f64 {
        match self {
            Self::Lv => 0.0254,
            Self::Xl | Self::XlLong => 0.01,
            Self::Hrlv | Self::Hrxl | Self::HrxlLong => 0.001,
        }
    }

    /// Number for things nearer than it measures, and the least number that says it heard nothing.
    #[must_use]
    pub const fn ends(self) -> [u16; 2] {
        match self {
            Self::Lv => [6, 254],
            Self::Xl => [20, 765],
            Self::XlLong => [20, 1068],
            Self::Hrlv | Self::Hrxl => [300, 5000],
            Self::HrxlLong => [500, 9999],
        }
    }

    /// Time from one reading to the next [s], of the slowest of the family.
    #[must_use]
    pub const fn cycle(self) -> f64 {
        match self {
            Self::Lv => 0.049,
            Self::Xl | Self::XlLong => 0.099,
            Self::Hrlv => 0.1,
            Self::Hrxl | Self::HrxlLong => 0.181,
        }
    }

    fn bounds(self) -> SonarBounds {
        let [nearest, farthest] = self.ends().map(|n| f64::from(n) * self.unit());
        SonarBounds { nearest, farthest }
    }
}

/// A line of a sonar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Message {
    /// A reading, in the model's unit.
    Range(u16),
    /// A ParkSonar, `R008 P1`: it holds readings for seconds, and is of no use for a map.
    ParkSonar,
}

/// Longest line that is kept; longer ones are no readings.
const LONGEST: usize = 16;

/// Finds lines. Any line but `R`, the model's number of digits and perhaps a space is dropped whole.
#[derive(Debug, Clone)]
pub struct Decoder {
    digits: usize,
    line: [u8; LONGEST],
    length: usize,
    event: Option<Event<Message>>,
}

impl Decoder {
    /// At the beginning of a stream.
    #[must_use]
    pub const fn new(model: MaxBotixModel) -> Self {
        Self {
            digits: model.digits(),
            line: [0; LONGEST],
            length: 0,
            event: None,
        }
    }

    fn read(&self) -> Result<Message, FrameFault> {
        let line = self.line.get(..self.length).ok_or(FrameFault::Form)?;
        let rest = line.strip_prefix(b"R").ok_or(FrameFault::Stray)?;
        let digits = rest.iter().take_while(|b| b.is_ascii_digit()).count();
        if rest.get(digits..) == Some(b" P1") || rest.get(digits..) == Some(b" P0") {
            return Ok(Message::ParkSonar);
        }
        if digits != self.digits || !matches!(&rest[digits..], b"" | b" ") {
            return Err(FrameFault::Form);
        }
        let value = rest[..digits]
            .iter()
            .fold(0, |value, digit| value * 10 + u16::from(digit - b'0'));
        Ok(Message::Range(value))
    }
}

impl Decode for Decoder {
    type Message = Message;

    fn feed(&mut self, byte: u8) {
        if byte == b'\r' {
            self.event = Some(match self.read() {
                Ok(message) => Event::Message(message),
                Err(fault) => Event::Fault(fault),
            });
            self.length = 0;
        } else {
            if let Some(place) = self.line.get_mut(self.length) {
                *place = byte;
            }
            self.length = self.length.saturating_add(1);
        }
    }

    fn quiet(&mut self) {
        if self.length > 0 {
            self.event = Some(Event::Fault(FrameFault::Half));
        }
        self.length = 0;
    }

    fn reset(&mut self) {
        self.length = 0;
        self.event = None;
    }

    fn poll(&mut self) -> Option<Event<Message>> {
        self.event.take()
    }
}

/// The line that a sonar sends for a number in its unit, HRUSB with a space.
#[must_use]
pub fn encode(model: MaxBotixModel, value: u16, space: bool) -> Vec<u8> {
    let width = model.digits();
    let space = if space { " " } else { "" };
    format!("R{value:0width$}{space}\r").into_bytes()
}

/// How a MaxBotix sonar is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaxBotixParams {
    /// Which family.
    pub model: MaxBotixModel,
    /// Direction in which it looks [rad, base frame]; 0 on a turret.
    pub bearing: f64,
    /// A ping may take this long [s]; at least five cycles let it find two readings that agree.
    pub timeout: f64,
}

impl Default for MaxBotixParams {
    fn default() -> Self {
        Self {
            model: MaxBotixModel::default(),
            bearing: 0.0,
            timeout: 1.0,
        }
    }
}

/// A MaxBotix sonar.
#[derive(Debug)]
pub struct MaxBotix<P, C> {
    line: Line<P, C>,
    decoder: Decoder,
    params: MaxBotixParams,
}

impl<P: Read + Write, C: Clock> MaxBotix<P, C> {
    /// On a port of [`BAUD`].
    #[must_use]
    pub const fn new(port: P, clock: C, params: MaxBotixParams) -> Self {
        Self {
            line: Line::new(port, clock),
            decoder: Decoder::new(params.model),
            params,
        }
    }

    /// What came over the line so far.
    #[must_use]
    pub const fn counts(&self) -> LineCounts {
        self.line.counts()
    }
}

impl<P: Read + Write, C: Clock> RangeFinder for MaxBotix<P, C> {
    type Error = SerialError;

    fn bearings(&self) -> Bearings {
        Bearings::fixed(self.params.bearing)
    }

    /// The next reading of a firing after the call that agrees with another such one;
    /// [`Reading::Fault`](occgrid::Reading::Fault) where of three no two agree.
    fn ping(&mut self, bearing: f64) -> Result<Ping, SerialError> {
        within(self.bearings(), bearing)?;
        let MaxBotixParams { model, timeout, .. } = self.params;
        let bounds = model.bounds();
        let began = self.line.now();
        let mut gate = Gate::default();
        // a line goes out at the end of the cycle that fired it
        let firing = model.cycle();
        let sent = link_time(model.digits() + 2, f64::from(BAUD));
        let result = self
            .line
            .listen(&mut self.decoder, timeout, |message, now| {
                let Message::Range(value) = message else {
                    return Some(Err(SerialError::Refused {
                        reason: "a ParkSonar holds its readings",
                    }));
                };
                let stamp = now - firing.max(sent);
                if stamp < began {
                    return None;
                }
                let reading = gate.pass(bounds.reading(f64::from(value) * model.unit()))?;
                Some(Ok((stamp, reading)))
            })?;
        let (stamp, reading) = result?;
        Ok(Ping {
            stamp,
            bearing: self.params.bearing,
            settled: true,
            reading,
        })
    }
}

#[cfg(test)]
mod tests {
    use occgrid::Reading;

    use super::*;

    #[test]
    fn ends_of_the_range_are_no_distances() {
        let lv = MaxBotixModel::Lv.bounds();
        assert_eq!(lv.reading(6.0 * 0.0254), Reading::TooClose);
        assert!(matches!(lv.reading(254.0 * 0.0254), Reading::NoEcho { .. }));
        assert!(matches!(lv.reading(253.0 * 0.0254), Reading::Echo { .. }));
    }
}
