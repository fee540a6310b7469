//! The guard itself.

use std::io::Write as _;
use std::sync::Arc;

use super::pipe::Reply;
use super::program::{Program, ProgramGone, answer};
use super::watch::{Guard, LAST, PAUSE, PortGone};
use super::{BaseKind, GuardError};
use crate::serial::SerialError;
use crate::{Clock as _, SystemClock};

/// A port may still be held for this long by an earlier guard [s].
const HELD: f64 = 1.0;

/// Guards a base until the program has gone and the wheels stand. `arguments` are those after `guard`, with
/// which [`GuardedBase`](super::GuardedBase) starts this program; standard input and output are its pipe.
/// Signals that ask it to end are ignored: only the pipe's end ends it.
///
/// # Errors
/// [`GuardError::Arguments`]. Whatever happens to the base is told over the pipe.
pub fn run(arguments: impl IntoIterator<Item = String>) -> Result<(), GuardError> {
    let arguments: Vec<String> = arguments.into_iter().collect();
    let Some((port, kind)) = read(&arguments) else {
        return Err(GuardError::Arguments { found: arguments });
    };
    outlive_signals();
    let clock = SystemClock::start();
    let waiting = Arc::default();
    let opened = Guard::open(&kind, port, clock, Arc::clone(&waiting), HELD);
    answer(0, &opened.as_ref().err().cloned().unwrap_or(Reply::Done));
    let Ok(mut guard) = opened else {
        return Ok(());
    };
    let (mut spare, stop) = (guard.spare.take(), kind.stop());
    let program = Program::listen(waiting, move || {
        if let Some(port) = &mut spare {
            // one that fails is sent again
            port.write_all(&stop).ok();
        }
    });
    let end = guard.serve(&program).and_then(|()| guard.settle());
    if let Err(PortGone) = end {
        drop(guard);
        stop_when_back(&kind, port, clock, &program);
    }
    Ok(())
}

/// The port, its baud rate, and the base.
fn read(arguments: &[String]) -> Option<((&str, u32), BaseKind)> {
    let [path, baud, name, numbers @ ..] = arguments else {
        return None;
    };
    let kind = BaseKind::from_words(name, numbers)?;
    Some(((path, baud.parse().ok()?), kind))
}

/// A stopped service, or an interrupted terminal, ends all of a program's processes at once.
fn outlive_signals() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
    for signal in [SIGHUP, SIGINT, SIGQUIT, SIGTERM] {
        // a flag that nobody reads; where it cannot be set, the signal ends the guard as it ever would
        signal_hook::flag::register(signal, Arc::default()).ok();
    }
}

/// The port is gone: waits until it is back, and stops the base. Nothing is driven any more.
fn stop_when_back(kind: &BaseKind, port: (&str, u32), clock: SystemClock, program: &Program) {
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
        if let Ok(mut guard) = Guard::open(kind, port, clock, Arc::default(), 0.0)
            && guard.settle().is_ok()
        {
            return;
        }
    }
}
