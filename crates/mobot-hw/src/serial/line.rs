//! A port and a clock: bytes sent whole, messages waited for until a deadline, faults named.

use std::io::{ErrorKind, Read, Write};

use thiserror::Error;

use super::decode::{Decode, Event, FrameFault};
use crate::{Bearings, Clock, DeviceError, FaultKind};

/// Why a device on a serial line failed.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum SerialError {
    /// Nothing of use came.
    #[error("no answer within {waited:.3} s")]
    Silent {
        /// [s]
        waited: f64,
    },
    /// Something came, and was no answer.
    #[error("no valid answer within {waited:.3} s, the last fault: {fault}")]
    Garbled {
        /// [s]
        waited: f64,
        /// What was wrong with it.
        fault: FrameFault,
    },
    /// The port took only some of a command's bytes.
    #[error("command written in part: expected {expected} bytes, found {found}")]
    HalfWritten {
        /// Length of the command.
        expected: usize,
        /// What was written.
        found: usize,
    },
    /// The port is gone.
    #[error("the port is gone")]
    Unplugged,
    /// Not a direction it can be aimed at.
    #[error("bearing must be {} to {} rad, found {found}", .reach.from, .reach.to)]
    Bearing {
        /// What it reaches.
        reach: Bearings,
        /// [rad]
        found: f64,
    },
    /// The device says no.
    #[error("the device refuses: {reason}")]
    Refused {
        /// As far as it is known.
        reason: &'static str,
    },
    /// The operating system failed.
    #[error("port: {0}")]
    System(ErrorKind),
}

impl DeviceError for SerialError {
    fn kind(&self) -> FaultKind {
        match self {
            Self::Silent { .. } => FaultKind::Silent,
            Self::Garbled { .. } => FaultKind::Garbled,
            Self::Unplugged => FaultKind::Unplugged,
            Self::Bearing { .. } | Self::Refused { .. } => FaultKind::Refused,
            Self::HalfWritten { .. } | Self::System(_) => FaultKind::System,
        }
    }
}

/// What came over a line so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LineCounts {
    /// Bytes.
    pub bytes: u64,
    /// Good messages.
    pub messages: u64,
    /// Runs of bytes that were none.
    pub faults: u64,
}

/// Quiet for this long, a message has ended [s]. USB adaptors hold bytes back for up to 16 ms.
const QUIET: f64 = 0.025;
/// A message that was begun this long before a call is not heard to its end [s].
const FORGOTTEN: f64 = 0.25;
/// Old bytes are thrown away for at most this long [s].
const DRAIN: f64 = 0.05;

/// A port with a clock.
#[derive(Debug)]
pub struct Line<P, C> {
    port: P,
    clock: C,
    counts: LineCounts,
    heard: Option<f64>,
}

impl<P: Read + Write, C: Clock> Line<P, C> {
    /// Takes a port whose reads return soon, see [the module](crate::serial).
    #[must_use]
    pub const fn new(port: P, clock: C) -> Self {
        Self {
            port,
            clock,
            counts: LineCounts {
                bytes: 0,
                messages: 0,
                faults: 0,
            },
            heard: None,
        }
    }

    /// What came so far.
    #[must_use]
    pub const fn counts(&self) -> LineCounts {
        self.counts
    }

    /// The clock's time [s].
    #[must_use]
    pub fn now(&self) -> f64 {
        self.clock.now()
    }

    /// Waits [s].
    pub fn sleep(&mut self, seconds: f64) {
        self.clock.sleep(seconds);
    }

    /// Sends a command whole, in one write.
    ///
    /// # Errors
    /// The port's; [`SerialError::HalfWritten`] where it took only some bytes. They are not sent again.
    pub fn send(&mut self, command: &[u8]) -> Result<(), SerialError> {
        let began = self.clock.now();
        let written = match self.port.write(command) {
            Ok(written) => written,
            Err(error) if nothing_yet(error.kind()) => {
                let waited = self.clock.now() - began;
                return Err(SerialError::Silent { waited });
            }
            Err(error) => return Err(named(&error)),
        };
        if written < command.len() {
            return Err(SerialError::HalfWritten {
                expected: command.len(),
                found: written,
            });
        }
        Ok(())
    }

    /// Throws away what has come and was not read.
    ///
    /// # Errors
    /// The port's.
    pub fn drain(&mut self) -> Result<(), SerialError> {
        let deadline = self.clock.now() + DRAIN;
        let mut bytes = [0; 256];
        while self.clock.now() < deadline && self.read(&mut bytes)? > 0 {}
        Ok(())
    }

    /// Hears what comes until `take` has made something of a message, at most `timeout` [s]. `take` gets
    /// each message and the time when its last byte had come [s]; of several results that come at once
    /// the newest counts.
    ///
    /// # Errors
    /// The port's; [`SerialError::Silent`] or [`SerialError::Garbled`] when the time is over.
    pub fn listen<D: Decode, T>(
        &mut self,
        decoder: &mut D,
        timeout: f64,
        mut take: impl FnMut(D::Message, f64) -> Option<T>,
    ) -> Result<T, SerialError> {
        let began = self.clock.now();
        let mut fault = None;
        let mut result = None;
        let mut bytes = [0; 1024];
        if self.heard.is_some_and(|heard| began - heard >= FORGOTTEN) {
            // of an age that no result may have
            self.heard = None;
            decoder.reset();
        }
        loop {
            let read = self.read(&mut bytes)?;
            let now = self.clock.now();
            let waited = now - began;
            if read > 0 {
                self.heard = Some(now);
            }
            let quiet = self.heard.is_some_and(|heard| now - heard >= QUIET);
            let over = quiet || waited >= timeout;
            for ended in [false, true].into_iter().take(1 + usize::from(over)) {
                if ended {
                    self.heard = None;
                    decoder.quiet();
                }
                for event in decoder.push(if ended { &[] } else { &bytes[..read] }) {
                    match event {
                        Event::Message(message) => {
                            self.counts.messages += 1;
                            result = take(message, now).or(result);
                        }
                        Event::Fault(found) => {
                            self.counts.faults += 1;
                            fault = Some(found);
                        }
                    }
                }
            }
            // a full buffer: newer bytes wait
            let more = read == bytes.len() && waited < timeout;
            if let Some(result) = result.take_if(|_| !more) {
                return Ok(result);
            }
            if waited >= timeout {
                return Err(fault.map_or(SerialError::Silent { waited }, |fault| {
                    SerialError::Garbled { waited, fault }
                }));
            }
        }
    }

    /// Throws away old bytes, sends a question, and hears its answer. Gives when it was asked [s], too.
    ///
    /// # Errors
    /// As [`Line::send`] and [`Line::listen`], in `timeout` [s] together.
    pub fn ask<D: Decode>(
        &mut self,
        question: &[u8],
        decoder: &mut D,
        timeout: f64,
    ) -> Result<(f64, D::Message), SerialError> {
        let began = self.clock.now();
        self.drain()?;
        decoder.reset();
        self.send(question)?;
        let asked = self.clock.now();
        let answer = self.listen(decoder, timeout - (asked - began), |answer, _| Some(answer))?;
        Ok((asked, answer))
    }

    /// What has come, or comes soon; 0 where nothing does.
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, SerialError> {
        match self.port.read(bytes) {
            Ok(0) => Err(SerialError::Unplugged),
            Ok(read) => {
                self.counts.bytes += read as u64;
                Ok(read)
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                self.clock.sleep(0.001);
                Ok(0)
            }
            Err(error) if nothing_yet(error.kind()) => Ok(0),
            Err(error) => Err(named(&error)),
        }
    }
}

fn nothing_yet(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
    )
}

/// What a system's error means: EIO, ENXIO and ENODEV are what reads and writes of a vanished terminal
/// give on Linux.
fn named(error: &std::io::Error) -> SerialError {
    let gone = matches!(
        error.kind(),
        ErrorKind::BrokenPipe
            | ErrorKind::NotFound
            | ErrorKind::NotConnected
            | ErrorKind::UnexpectedEof
            | ErrorKind::ConnectionReset
            | ErrorKind::ConnectionAborted
    ) || matches!(error.raw_os_error(), Some(5 | 6 | 19));
    if gone {
        SerialError::Unplugged
    } else {
        SerialError::System(error.kind())
    }
}

/// Time that bytes take on a line of eight data bits, one start and one stop bit [s].
pub(crate) fn link_time(bytes: usize, baud: f64) -> f64 {
    10.0 * bytes as f64 / baud
}

/// Whether a device can be aimed at a bearing.
pub(crate) fn within(reach: Bearings, bearing: f64) -> Result<(), SerialError> {
    if reach.contain(bearing) {
        return Ok(());
    }
    Err(SerialError::Bearing {
        reach,
        found: bearing,
    })
}
