//! The guard's side of the pipe.

use std::io::{self, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use super::pipe::{Reply, Request, read_line};

/// The pipe's other end.
pub(super) struct Program {
    requests: Receiver<(u64, Request)>,
    waiting: Arc<AtomicBool>,
    ended: Arc<AtomicBool>,
}

pub(super) struct ProgramGone;

impl Program {
    /// Reads requests from now on, and sets `waiting` where there is one, and at their end. Then it also does
    /// `last`, at once, whatever the guard is waiting for.
    pub(super) fn listen(waiting: Arc<AtomicBool>, last: impl FnOnce() + Send + 'static) -> Self {
        let (sender, requests) = mpsc::channel();
        let ended = Arc::new(AtomicBool::new(false));
        let [flag, end] = [&waiting, &ended].map(Arc::clone);
        std::thread::spawn(move || {
            let mut pipe = io::stdin().lock();
            let mut line = Vec::new();
            while let Ok(true) = read_line(&mut pipe, &mut line) {
                let Some(request) = Request::read(&line) else {
                    continue;
                };
                // nobody takes it where the guard is about to end
                sender.send(request).ok();
                flag.store(true, Ordering::SeqCst);
            }
            end.store(true, Ordering::SeqCst);
            last();
            drop(sender);
            flag.store(true, Ordering::SeqCst);
        });
        Self {
            requests,
            waiting,
            ended,
        }
    }

    /// The next request; none where none comes in time. What a program asked that is gone is not done.
    pub(super) fn next(&self, patience: Duration) -> Result<Option<(u64, Request)>, ProgramGone> {
        self.waiting.store(false, Ordering::SeqCst);
        if self.ended.load(Ordering::SeqCst) {
            return Err(ProgramGone);
        }
        match self.requests.recv_timeout(patience) {
            Ok(request) => Ok(Some(request)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(ProgramGone),
        }
    }
}

/// Answers a request.
pub(super) fn answer(number: u64, reply: &Reply) {
    let mut out = io::stdout().lock();
    // a program that is gone is noticed at the other pipe
    let written = out.write_all(reply.line(number).as_bytes());
    written.and_then(|()| out.flush()).ok();
}
