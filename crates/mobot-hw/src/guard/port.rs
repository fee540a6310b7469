//! The port, of which the guard lets go where something else cannot wait.

use std::cell::Cell;
use std::io::{self, Read, Write};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::serial::{Port, SerialError};
use crate::{Clock as _, SystemClock};

/// A port whose reads fail while a request waits or a command has run out, so that a status that is waited
/// for makes way; without `waiting` they never do.
pub(super) struct Interrupted {
    pub(super) port: Port,
    pub(super) clock: SystemClock,
    pub(super) waiting: Option<Arc<AtomicBool>>,
    pub(super) latch: Latch,
}

/// Until when the command in force holds [s]; infinite without one.
pub(super) type Latch = Rc<Cell<f64>>;

/// How the driver tells of such a read.
pub(super) const MAKES_WAY: SerialError = SerialError::System(io::ErrorKind::Other);

impl Read for Interrupted {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let waits = |flag: &Arc<AtomicBool>| {
            flag.load(Ordering::SeqCst) || self.clock.now() >= self.latch.get()
        };
        if self.waiting.as_ref().is_some_and(waits) {
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
