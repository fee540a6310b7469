//! The guard's work: obeys the program, stops the base where the program no longer asks, until the wheels
//! stand.

use std::cell::Cell;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::BaseKind;
use super::pipe::{Reply, Request};
use super::port::{Interrupted, Latch, MAKES_WAY};
use super::program::{Program, ProgramGone, answer};
use super::wheels::Wheels;
use crate::serial::{
    Arduino, ArduinoParams, Create2, Create2Params, Kobuki, KobukiParams, LATCH, Port, SerialError,
    open,
};
use crate::{BaseStatus, Clock as _, DeviceError as _, DifferentialDrive, FaultKind, SystemClock};

/// A status that takes longer than this is asked for again, so that a silent base delays no stop [s].
const GLANCE: f64 = 0.04;
/// The same for a base that is asked, and answers when it can [s].
const ANSWER: f64 = 0.08;
/// Pause between two questions to such a base.
pub(super) const PAUSE: Duration = Duration::from_millis(20);
/// Without a program, a base that does not say that it stands, or does not come back, is waited for so
/// long [s].
pub(super) const LAST: f64 = 10.0;

/// The port is gone.
pub(super) struct PortGone;

/// A base under guard.
pub(super) struct Guard {
    base: Box<dyn DifferentialDrive<Error = SerialError>>,
    /// The port once more, for a stop that waits for nothing.
    pub(super) spare: Option<Port>,
    /// Motors are off where the base refuses.
    refusal_is_off: bool,
    pause: Duration,
    waiting: Arc<AtomicBool>,
    timeout: f64,
    clock: SystemClock,
    wheels: Wheels,
    latch: Latch,
}

impl Guard {
    /// Opens the base, which stops it. A port that exists is tried again for so many seconds.
    pub(super) fn open(
        kind: &BaseKind,
        (path, baud): (&str, u32),
        clock: SystemClock,
        waiting: Arc<AtomicBool>,
        held: f64,
    ) -> Result<Self, Reply> {
        let until = clock.now() + held;
        let port = loop {
            match open(path, baud, false) {
                Ok(port) => break port,
                Err(error) if clock.now() >= until || !Path::new(path).exists() => {
                    return Err(Reply::Fault(FaultKind::System, error.to_string()));
                }
                Err(_) => std::thread::sleep(PAUSE),
            }
        };
        let spare = port.again().ok();
        let latch = Latch::new(Cell::new(f64::INFINITY));
        let port = Interrupted {
            port,
            clock,
            // what the base answers to a question is heard to its end
            waiting: kind.interruptible().then(|| Arc::clone(&waiting)),
            latch: Rc::clone(&latch),
        };
        let base = driver(kind, port, clock).map_err(|e| Reply::fault(&e))?;
        Ok(Self {
            base,
            spare,
            refusal_is_off: matches!(kind, BaseKind::Create2(_)),
            pause: if kind.interruptible() {
                Duration::ZERO
            } else {
                PAUSE
            },
            timeout: kind.timeout(),
            waiting,
            clock,
            wheels: Wheels::default(),
            latch,
        })
    }

    /// Does what the program asks until it is gone, and stops the base where it no longer asks.
    pub(super) fn serve(&mut self, program: &Program) -> Result<(), PortGone> {
        let mut wanted = None;
        loop {
            let left = (self.latch.get() - self.clock.now()).max(0.0);
            let mut patience = self.pause.min(Duration::from_secs_f64(left.min(LATCH)));
            loop {
                match program.next(patience) {
                    Ok(None) => break,
                    Ok(Some((number, Request::Status))) => {
                        wanted = Some((number, self.clock.now() + self.timeout));
                    }
                    Ok(Some((number, request))) => self.obey(number, request)?,
                    Err(ProgramGone) => return Ok(()),
                }
                patience = Duration::ZERO;
            }
            if self.clock.now() >= self.latch.get() {
                self.halted();
            }
            if self.latch.get().is_infinite() && !self.wheels.stand() {
                self.stop()?;
            }
            let status = self.look();
            if status == Err(MAKES_WAY) {
                continue;
            }
            if let Some((number, until)) = wanted
                && let Some(reply) = self.told(&status, until)
            {
                answer(number, &reply);
                wanted = None;
            }
            gone(&status)?;
        }
    }

    fn obey(&mut self, number: u64, request: Request) -> Result<(), PortGone> {
        let now = self.clock.now();
        let (result, until) = match request {
            Request::Drive(command) => (self.base.drive(command), now + LATCH),
            _ => (self.base.stop(), f64::INFINITY),
        };
        if result.is_ok() && until.is_finite() {
            self.latch.set(until);
        } else {
            self.halted();
        }
        answer(
            number,
            &result.as_ref().map_or_else(Reply::fault, |()| Reply::Done),
        );
        gone(&result)
    }

    /// No command is in force, and that the wheels stand remains to be seen.
    fn halted(&mut self) {
        self.latch.set(f64::INFINITY);
        self.wheels.forget();
    }

    fn stop(&mut self) -> Result<(), PortGone> {
        // a stop that fails is sent again
        gone(&self.base.stop())
    }

    fn look(&mut self) -> Result<BaseStatus, SerialError> {
        let status = self.base.status();
        match &status {
            Ok(status) => self.wheels.hear(status.travel, status.stamp),
            Err(SerialError::Refused { .. }) if self.refusal_is_off => self.wheels.off(),
            Err(error) if *error == MAKES_WAY => {}
            Err(_) => self.wheels.forget(),
        }
        status
    }

    /// What the program is told of a status; nothing where another one may still come in time.
    fn told(&self, status: &Result<BaseStatus, SerialError>, until: f64) -> Option<Reply> {
        let now = self.clock.now();
        match status {
            Ok(status) => Some(Reply::State(BaseStatus {
                stamp: now - status.stamp,
                ..*status
            })),
            Err(SerialError::Silent { .. } | SerialError::Garbled { .. }) if now < until => None,
            Err(error) => Some(Reply::fault(error)),
        }
    }

    /// Stops the base until it says that the wheels stand.
    pub(super) fn settle(&mut self) -> Result<(), PortGone> {
        self.halted();
        let until = self.clock.now() + LAST;
        while !self.wheels.stand() && self.clock.now() < until {
            self.stop()?;
            // the program's end may be told a second time
            self.waiting.store(false, Ordering::SeqCst);
            gone(&self.look())?;
            std::thread::sleep(self.pause);
        }
        Ok(())
    }
}

fn gone<T>(result: &Result<T, SerialError>) -> Result<(), PortGone> {
    match result {
        Err(error) if error.kind() == FaultKind::Unplugged => Err(PortGone),
        _ => Ok(()),
    }
}

/// The base's driver, which keeps limits and stops what is not finite.
fn driver(
    kind: &BaseKind,
    port: Interrupted,
    clock: SystemClock,
) -> Result<Box<dyn DifferentialDrive<Error = SerialError>>, SerialError> {
    Ok(match *kind {
        BaseKind::Create2(params) => {
            let timeout = params.timeout.min(GLANCE);
            Box::new(Create2::open(
                port,
                clock,
                Create2Params { timeout, ..params },
            )?)
        }
        BaseKind::Kobuki(params) => {
            let timeout = params.timeout.min(GLANCE);
            Box::new(Kobuki::open(
                port,
                clock,
                KobukiParams { timeout, ..params },
            )?)
        }
        BaseKind::Arduino(params) => {
            let timeout = params.timeout.min(ANSWER);
            Box::new(Arduino::open(
                port,
                clock,
                ArduinoParams { timeout, ..params },
            )?)
        }
    })
}
