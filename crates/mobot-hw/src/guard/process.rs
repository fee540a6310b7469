//! The guard itself.

use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use super::pipe::{Reply, Request, read_line};
use super::wheels::Wheels;
use super::{BaseKind, GuardError};
use crate::serial::{
    Arduino, ArduinoParams, Create2, Create2Params, Kobuki, KobukiParams, LATCH, Port, SerialError,
    arduino, create2, kobuki, open,
};
use crate::{BaseStatus, Clock as _, DeviceError as _, DifferentialDrive, FaultKind, SystemClock};

/// A status that takes longer than this is asked for again, so that a silent base delays no stop [s].
const GLANCE: f64 = 0.04;
/// The same for a base that is asked, and answers when it can [s].
const ANSWER: f64 = 0.08;
/// Pause between two questions to such a base.
const PAUSE: Duration = Duration::from_millis(20);
/// A port may still be held for this long by an earlier guard [s].
const HELD: f64 = 1.0;
/// Without a program, a base that does not say that it stands, or does not come back, is waited for so
/// long [s].
const LAST: f64 = 10.0;

/// Guards a base until the program has gone and the wheels stand. `arguments` are those after `guard`, with
/// which [`GuardedBase`](super::GuardedBase) starts this program; standard input and output are its pipe.
/// Signals that ask it to end are ignored: only the pipe's end ends it.
///
/// # Errors
/// [`GuardError::Arguments`]. Whatever happens to the base is told over the pipe.
pub fn run(arguments: impl IntoIterator<Item = String>) -> Result<(), GuardError> {
    let arguments: Vec<String> = arguments.into_iter().collect();
    let [path, name, numbers @ ..] = &arguments[..] else {
        return Err(GuardError::Arguments { found: arguments });
    };
    let Some(kind) = BaseKind::from_words(name, numbers) else {
        return Err(GuardError::Arguments { found: arguments });
    };
    outlive_signals();
    let clock = SystemClock::start();
    let waiting = Arc::new(AtomicBool::new(false));
    let opened = Guard::open(&kind, path, clock, Arc::clone(&waiting), HELD);
    answer(0, &opened.as_ref().err().cloned().unwrap_or(Reply::Done));
    let Ok(mut guard) = opened else {
        return Ok(());
    };
    let program = Program::listen(waiting, kind.interruptible());
    let end = guard.serve(&program).and_then(|()| guard.settle());
    if let Err(PortGone) = end {
        drop(guard);
        stop_when_back(&kind, path, clock, &program);
    }
    Ok(())
}

/// A stopped service, or an interrupted terminal, ends all of a program's processes at once.
fn outlive_signals() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
    for signal in [SIGHUP, SIGINT, SIGQUIT, SIGTERM] {
        // a flag that nobody reads; where it cannot be set, the signal ends the guard as it ever would
        signal_hook::flag::register(signal, Arc::default()).ok();
    }
}

fn answer(number: u64, reply: &Reply) {
    let mut out = io::stdout().lock();
    // a program that is gone is noticed at the other pipe
    let written = out.write_all(reply.line(number).as_bytes());
    written.and_then(|()| out.flush()).ok();
}

/// The pipe's other end.
struct Program {
    requests: Receiver<(u64, Request)>,
    waiting: Arc<AtomicBool>,
}

struct ProgramGone;

impl Program {
    /// Reads requests from now on, and sets `waiting` at their end, and where `each` asks for it for each one.
    fn listen(waiting: Arc<AtomicBool>, each: bool) -> Self {
        let (sender, requests) = mpsc::channel();
        let flag = Arc::clone(&waiting);
        std::thread::spawn(move || {
            let mut pipe = io::stdin().lock();
            let mut line = Vec::new();
            while let Ok(true) = read_line(&mut pipe, &mut line) {
                let Some(request) = Request::read(&line) else {
                    continue;
                };
                // nobody takes it where the guard is about to end
                sender.send(request).ok();
                flag.fetch_or(each, Ordering::SeqCst);
            }
            drop(sender);
            flag.store(true, Ordering::SeqCst);
        });
        Self { requests, waiting }
    }

    /// The next request; none where none comes in time.
    fn next(&self, patience: Duration) -> Result<Option<(u64, Request)>, ProgramGone> {
        self.waiting.store(false, Ordering::SeqCst);
        match self.requests.recv_timeout(patience) {
            Ok(request) => Ok(Some(request)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(ProgramGone),
        }
    }
}

/// A port whose reads fail while a request waits, so that a status that is waited for makes way.
struct Interrupted {
    port: Port,
    waiting: Arc<AtomicBool>,
}

/// How the driver tells of such a read.
const MAKES_WAY: SerialError = SerialError::System(io::ErrorKind::Other);

impl Read for Interrupted {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.waiting.load(Ordering::SeqCst) {
            return Err(io::ErrorKind::Other.into());
        }
        self.port.read(bytes)
    }
}

impl Write for Interrupted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.port.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.port.flush()
    }
}

struct PortGone;

struct Guard {
    base: Box<dyn DifferentialDrive<Error = SerialError>>,
    /// Motors are off where the base refuses.
    refusal_is_off: bool,
    pause: Duration,
    waiting: Arc<AtomicBool>,
    timeout: f64,
    clock: SystemClock,
    wheels: Wheels,
    /// When the command in force was given [s].
    driven: Option<f64>,
}

impl Guard {
    /// Opens the base, which stops it. A port that exists is tried again for so many seconds.
    fn open(
        kind: &BaseKind,
        path: &str,
        clock: SystemClock,
        waiting: Arc<AtomicBool>,
        held: f64,
    ) -> Result<Self, Reply> {
        let baud = match kind {
            BaseKind::Create2(_) => create2::BAUD,
            BaseKind::Kobuki(_) => kobuki::BAUD,
            BaseKind::Arduino(_) => arduino::BAUD,
        };
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
        let port = Interrupted {
            port,
            waiting: Arc::clone(&waiting),
        };
        let base = driver(kind, port, clock).map_err(|e| Reply::fault(&e))?;
        Ok(Self {
            base,
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
            driven: None,
        })
    }

    /// Does what the program asks until it is gone, and stops the base where it no longer asks.
    fn serve(&mut self, program: &Program) -> Result<(), PortGone> {
        let mut wanted = None;
        loop {
            let mut patience = self.pause.min(self.latch());
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
            if self.latch().is_zero() {
                self.halted();
            }
            if self.driven.is_none() && !self.wheels.stand() {
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
        let result = match request {
            Request::Drive(command) => {
                let result = self.base.drive(command);
                self.driven = result.is_ok().then(|| self.clock.now());
                result
            }
            _ => self.base.stop(),
        };
        if self.driven.is_none() || request == Request::Stop {
            self.halted();
        }
        answer(
            number,
            &result.as_ref().map_or_else(Reply::fault, |()| Reply::Done),
        );
        gone(&result)
    }

    /// How long the command in force still is; the longest time without one.
    fn latch(&self) -> Duration {
        self.driven.map_or(Duration::MAX, |then| {
            let left = then + LATCH - self.clock.now();
            Duration::from_secs_f64(left.max(0.0))
        })
    }

    /// No command is in force, and that the wheels stand remains to be seen.
    fn halted(&mut self) {
        self.driven = None;
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
    fn settle(&mut self) -> Result<(), PortGone> {
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

/// The port is gone: waits until it is back, and stops the base. Nothing is driven any more.
fn stop_when_back(kind: &BaseKind, path: &str, clock: SystemClock, program: &Program) {
    let mut alone_since = None;
    loop {
        match program.next(PAUSE) {
            Ok(Some((number, _))) => answer(number, &Reply::fault(&SerialError::Unplugged)),
            Ok(None) => {}
            Err(ProgramGone) => {
                let since = *alone_since.get_or_insert(clock.now());
                if clock.now() - since > LAST {
                    return;
                }
                std::thread::sleep(PAUSE);
            }
        }
        if let Ok(mut guard) = Guard::open(kind, path, clock, Arc::default(), 0.0)
            && guard.settle().is_ok()
        {
            return;
        }
    }
}
