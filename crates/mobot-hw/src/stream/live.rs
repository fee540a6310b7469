//! The newest frame of a stream that does not wait.

use std::io::{self, ErrorKind, Read};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::split::{Cut, Splitter};
use super::{Coded, Next};
use crate::FrameFault;

/// Bytes taken at once: a pipe holds 65 536.
const CHUNK: usize = 1 << 16;
/// How long the reader rests where a port has nothing, and says so.
const REST: Duration = Duration::from_millis(1);

#[derive(Default)]
struct Slot {
    newest: Option<Coded>,
    fault: Option<FrameFault>,
    cuts: u64,
    passed_over: u64,
    lost: u64,
    end: Option<Option<ErrorKind>>,
    dropped: bool,
}

#[derive(Default)]
struct Shared {
    slot: Mutex<Slot>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

pub(super) struct Live(Arc<Shared>);

impl Live {
    /// Opens on the reader's thread, since opening a named pipe waits for its writer.
    pub(super) fn begin<R: Read>(
        open: impl FnOnce() -> io::Result<R> + Send + 'static,
        frame_limit: usize,
    ) -> io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        thread::Builder::new()
            .name("mjpeg reader".to_owned())
            .spawn(move || {
                let end = open()
                    .and_then(|reader| drain(reader, &theirs, frame_limit))
                    .err();
                theirs.lock().end = Some(end.map(|error| error.kind()));
                theirs.changed.notify_all();
            })?;
        Ok(Self(shared))
    }

    /// Waits as long as `wait` at most.
    pub(super) fn next(&mut self, wait: Duration) -> Next {
        let nothing = |slot: &mut Slot| slot.newest.is_none() && slot.end.is_none();
        let slot = self.0.lock();
        let (mut slot, _) = self
            .0
            .changed
            .wait_timeout_while(slot, wait, nothing)
            .unwrap_or_else(PoisonError::into_inner);
        let fault = slot.fault.take();
        if let Some(coded) = slot.newest.take() {
            return Next::Frame(coded);
        }
        match (slot.end, fault) {
            (Some(end), _) => Next::End(end),
            (None, Some(fault)) => Next::Lost(fault),
            (None, None) => Next::Nothing,
        }
    }

    /// Frames passed over, and lost.
    pub(super) fn counts(&self) -> (u64, u64) {
        let slot = self.0.lock();
        (slot.passed_over, slot.lost)
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.0.lock().dropped = true;
    }
}

fn drain(mut reader: impl Read, shared: &Shared, frame_limit: usize) -> io::Result<()> {
    let mut splitter = Splitter::new(frame_limit);
    let mut chunk = vec![0; CHUNK];
    let mut began = None;
    loop {
        let count = match reader.read(&mut chunk) {
            Ok(0) => return Ok(()),
            Ok(count) => count,
            Err(error) => match error.kind() {
                ErrorKind::Interrupted => continue,
                ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                    if shared.lock().dropped {
                        return Ok(());
                    }
                    thread::sleep(REST);
                    continue;
                }
                _ => return Err(error),
            },
        };
        let now = Instant::now();
        splitter.push(&chunk[..count]);
        while let Some(cut) = splitter.next() {
            // a frame whose start came earlier is as old as that
            let arrived = began.take().unwrap_or(now);
            shared.lock().put(cut, arrived);
            shared.changed.notify_all();
        }
        began = splitter.inside().then(|| began.unwrap_or(now));
        if shared.lock().dropped {
            return Ok(());
        }
    }
}

impl Slot {
    fn put(&mut self, cut: Cut<'_>, arrived: Instant) {
        match cut {
            Cut::Frame(frame) => {
                let coded = Coded {
                    bytes: frame.bytes.to_vec(),
                    shape: frame.shape,
                    arrived,
                    sequence: self.cuts,
                };
                self.passed_over += u64::from(self.newest.replace(coded).is_some());
            }
            Cut::Lost(fault) => {
                self.lost += 1;
                self.fault = Some(fault);
            }
        }
        self.cuts += 1;
    }
}
