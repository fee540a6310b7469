//! The driver: base, servo and sonar of one Arduino.

use std::io::{Read, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use occgrid::Reading;

use super::super::gate::Gate;
use super::super::line::{Line, LineCounts, SerialError, within};
use super::super::sonar_bounds::SonarBounds;
use super::super::wheels::{Governor, WheelLimits};
use super::counters::Counters;
use super::{Answer, BAUD, Command, Decoder};
use crate::serial::{Decode as _, FrameFault};
use crate::{
    BaseStatus, Bearings, Clock, DifferentialDrive, PanActuator, Ping, RangeFinder, Twist2,
    WheelTravel,
};

/// How the Arduino is built and used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArduinoParams {
    /// Distance between the wheels [m], above 0.
    pub track: f64,
    /// Counts of an encoder for one metre, above 0.
    pub counts_per_metre: f64,
    /// PID frames a second; the firmware's own 30 unless it was changed.
    pub frames_per_second: f64,
    /// The last limits of every command.
    pub limits: WheelLimits,
    /// Number of the servo that pans the sonar.
    pub servo: u8,
    /// Angle of the servo at which the sonar looks straight ahead [deg], 0 to 180.
    pub centre_deg: f64,
    /// Larger angles of the servo are clockwise.
    pub clockwise: bool,
    /// Speed of the servo [rad/s], above 0; too fast a guess ends a turn before the servo does.
    pub speed: f64,
    /// Time the servo swings after a turn [s].
    pub settle: f64,
    /// Pin of the sonar.
    pub pin: u8,
    /// Things nearer than this are too close [m].
    pub nearest: f64,
    /// From here on the sonar hears nothing [m].
    pub farthest: f64,
    /// An answer may take this long [s]; one of the sonar 1.1 s longer.
    pub timeout: f64,
}

impl Default for ArduinoParams {
    fn default() -> Self {
        Self {
            track: 0.2,
            counts_per_metre: 5000.0,
            frames_per_second: 30.0,
            limits: WheelLimits::default(),
            servo: 0,
            centre_deg: 90.0,
            clockwise: false,
            speed: 5.0,
            settle: 0.2,
            pin: 4,
            nearest: 0.03,
            farthest: 3.0,
            timeout: 0.15,
        }
    }
}

/// Longest that the firmware waits for an echo [s], and some.
const NO_ECHO: f64 = 1.1;

#[derive(Debug)]
struct Bridge<P: Read + Write, C: Clock> {
    line: Line<P, C>,
    decoder: Decoder,
    params: ArduinoParams,
    governor: Governor,
    in_step: bool,
    counters: Counters,
    stands_at: Option<f64>,
}

impl<P: Read + Write, C: Clock> Bridge<P, C> {
    fn ask(&mut self, command: Command, patience: f64) -> Result<(f64, Answer), SerialError> {
        let began = self.line.now();
        if !self.in_step {
            self.get_in_step(patience)?;
        }
        let left = patience - (self.line.now() - began);
        let (asked, answer) = self
            .line
            .ask(&command.bytes(), &mut self.decoder, left)
            .inspect_err(|_| self.in_step = false)?;
        let fits = match command {
            Command::Baud | Command::Ping(_) => matches!(answer, Answer::One(_)),
            Command::Encoders => matches!(answer, Answer::Two(..)),
            Command::Motors(..) | Command::Servo(..) => answer == Answer::Ok,
        };
        if !fits {
            self.in_step = false;
            let refused = SerialError::Refused {
                reason: "the firmware does not know the command",
            };
            let garbled = SerialError::Garbled {
                waited: self.line.now() - began,
                fault: FrameFault::Form,
            };
            return Err(if answer == Answer::Invalid {
                refused
            } else {
                garbled
            });
        }
        Ok((asked, answer))
    }

    /// Ends whatever the firmware has of a command, and asks what it must answer in one way.
    fn get_in_step(&mut self, patience: f64) -> Result<(), SerialError> {
        let began = self.line.now();
        self.line.send(b"\r")?;
        self.line.sleep(0.02);
        let left = patience - (self.line.now() - began);
        let baud = Answer::One(BAUD as i32);
        let (_, answer) = self
            .line
            .ask(&Command::Baud.bytes(), &mut self.decoder, left)?;
        self.in_step = answer == baud;
        if self.in_step {
            return Ok(());
        }
        Err(SerialError::Garbled {
            waited: self.line.now() - began,
            fault: FrameFault::Form,
        })
    }

    fn send(&mut self, wheels: [f64; 2]) -> Result<(), SerialError> {
        let p = &self.params;
        let counts = p.counts_per_metre / p.frames_per_second;
        let [left, right] = wheels.map(|w| (w * counts).round() as i16);
        self.ask(Command::Motors(left, right), self.params.timeout)?;
        Ok(())
    }

    fn stop(&mut self) -> Result<(), SerialError> {
        let now = self.line.now();
        let wheels = self.governor.halt(now);
        if !self.in_step {
            self.stop_unheard();
            return self.send(wheels);
        }
        // at once: nothing is waited for before it is sent
        self.decoder.reset();
        self.line.send(&Command::Motors(0, 0).bytes())?;
        let patience = self.params.timeout;
        let answer = self
            .line
            .listen(&mut self.decoder, patience, |a, _| Some(a));
        self.in_step = answer == Ok(Answer::Ok);
        answer.map(drop)
    }

    /// Sends a stop after whatever was cut off. Its answer is thrown away before the next question.
    fn stop_unheard(&mut self) {
        self.line.send(b"\r").ok();
        self.line.send(&Command::Motors(0, 0).bytes()).ok();
    }

    fn status(&mut self) -> Result<BaseStatus, SerialError> {
        let now = self.line.now();
        if self.governor.expired(now) {
            self.stop()?;
        }
        let stamp = loop {
            let left = self.params.timeout - (self.line.now() - now);
            let (stamp, answer) = self.ask(Command::Encoders, left)?;
            let Answer::Two(left, right) = answer else {
                continue;
            };
            let metres = 2.0 * self.params.limits.max_speed * (stamp - self.counters.heard) + 0.05;
            let most = metres * self.params.counts_per_metre;
            if self.counters.update([left, right], most, stamp) {
                break stamp;
            }
        };
        let per_metre = self.params.counts_per_metre;
        let [left, right] = self.counters.totals.map(|t| t as f64 / per_metre);
        Ok(BaseStatus {
            stamp,
            travel: WheelTravel { left, right },
            ..BaseStatus::default()
        })
    }

    fn sense(&self) -> f64 {
        if self.params.clockwise { -1.0 } else { 1.0 }
    }

    fn reach(&self) -> Bearings {
        let ends =
            [0.0, 180.0].map(|deg: f64| self.sense() * (deg - self.params.centre_deg).to_radians());
        Bearings {
            from: ends[0].min(ends[1]),
            to: ends[0].max(ends[1]),
        }
    }

    fn turn_to(&mut self, bearing: f64) -> Result<f64, SerialError> {
        let reach = self.reach();
        within(reach, bearing)?;
        let p = self.params;
        let deg = (p.centre_deg + self.sense() * bearing.to_degrees()).round();
        let there = self.sense() * (deg - p.centre_deg).to_radians();
        let turn = self
            .stands_at
            .take()
            .map_or(reach.to - reach.from, |from| (there - from).abs());
        self.ask(Command::Servo(p.servo, deg as u8), p.timeout)?;
        if turn > 1e-9 {
            self.line.sleep(turn / p.speed + p.settle);
        }
        self.stands_at = Some(there);
        Ok(there)
    }

    fn ping(&mut self) -> Result<Ping, SerialError> {
        let p = self.params;
        let bounds = SonarBounds {
            nearest: p.nearest,
            farthest: p.farthest,
        };
        let began = self.line.now();
        let mut gate = Gate::default();
        loop {
            let left = p.timeout + NO_ECHO - (self.line.now() - began);
            let (stamp, answer) = self.ask(Command::Ping(p.pin), left)?;
            let reading = match answer {
                // a silence takes the firmware a second: it is not asked for twice
                Answer::One(0) => Some(bounds.reading(f64::INFINITY)),
                Answer::One(cm @ 1..) => gate.pass(bounds.reading(f64::from(cm) / 100.0)),
                _ => gate.pass(Reading::Fault),
            };
            if let Some(reading) = reading {
                return Ok(Ping {
                    stamp,
                    bearing: 0.0,
                    settled: true,
                    reading,
                });
            }
        }
    }
}

impl<P: Read + Write, C: Clock> Drop for Bridge<P, C> {
    fn drop(&mut self) {
        // nobody is left to tell
        self.stop_unheard();
    }
}

/// An Arduino: base, pan and sonar in one. Clones are the same Arduino, so that each part can be given away.
#[derive(Debug)]
pub struct Arduino<P: Read + Write, C: Clock>(Arc<Mutex<Bridge<P, C>>>);

impl<P: Read + Write, C: Clock> Clone for Arduino<P, C> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<P: Read + Write, C: Clock> Arduino<P, C> {
    /// On a port of [`BAUD`]: waits until the firmware answers, at most 3 s, as most Arduinos start again
    /// when their port is opened, and stops the wheels.
    ///
    /// # Errors
    /// The line's.
    pub fn open(port: P, clock: C, params: ArduinoParams) -> Result<Self, SerialError> {
        let mut bridge = Bridge {
            line: Line::new(port, clock),
            decoder: Decoder::default(),
            params,
            governor: Governor::new(params.limits, params.track),
            in_step: false,
            counters: Counters::default(),
            stands_at: None,
        };
        let deadline = bridge.line.now() + 3.0;
        loop {
            match bridge.stop() {
                Ok(()) => return Ok(Self(Arc::new(Mutex::new(bridge)))),
                Err(SerialError::Silent { .. } | SerialError::Garbled { .. })
                    if bridge.line.now() < deadline => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// What came over the line so far.
    #[must_use]
    pub fn counts(&self) -> LineCounts {
        self.lock().line.counts()
    }

    fn lock(&self) -> MutexGuard<'_, Bridge<P, C>> {
        // whoever panicked left the line out of step at worst, and that is noticed
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<P: Read + Write, C: Clock> DifferentialDrive for Arduino<P, C> {
    type Error = SerialError;

    fn track(&self) -> f64 {
        self.lock().params.track
    }

    fn drive(&mut self, command: Twist2) -> Result<(), SerialError> {
        let mut bridge = self.lock();
        let now = bridge.line.now();
        let wheels = bridge.governor.allow(command, now);
        bridge.send(wheels)
    }

    fn stop(&mut self) -> Result<(), SerialError> {
        self.lock().stop()
    }

    fn status(&mut self) -> Result<BaseStatus, SerialError> {
        self.lock().status()
    }
}

impl<P: Read + Write, C: Clock> PanActuator for Arduino<P, C> {
    type Error = SerialError;

    fn bearings(&self) -> Bearings {
        self.lock().reach()
    }

    fn turn_to(&mut self, bearing: f64) -> Result<f64, SerialError> {
        self.lock().turn_to(bearing)
    }
}

impl<P: Read + Write, C: Clock> RangeFinder for Arduino<P, C> {
    type Error = SerialError;

    fn bearings(&self) -> Bearings {
        Bearings::fixed(0.0)
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, SerialError> {
        within(Bearings::fixed(0.0), bearing)?;
        self.lock().ping()
    }
}
