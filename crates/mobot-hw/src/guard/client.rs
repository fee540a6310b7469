//! The program's side of the pipe.

use std::io::{BufReader, Write as _};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::pipe::{Reply, Request, read_line};
use super::{BaseKind, GuardError};
use crate::{BaseStatus, Clock as _, DifferentialDrive, SystemClock, Twist2};

/// A guard answers within its driver's timeout; one that takes this much longer is as good as dead.
const PATIENCE: f64 = 0.4;
/// A base is opened, or not, within this time: an Arduino takes 3 s, a port still held by an earlier guard 1 s.
const OPENING: f64 = 6.0;

/// A base whose port belongs to a guard, see [the module](super). When it is dropped, the guard stops the
/// base and ends.
#[derive(Debug)]
pub struct GuardedBase {
    guard: Arc<Mutex<Child>>,
    /// None where the guard is known to be gone.
    requests: Option<ChildStdin>,
    replies: Receiver<(u64, Reply)>,
    asked: u64,
    patience: f64,
    track: f64,
    clock: SystemClock,
}

impl GuardedBase {
    /// Starts the guard, and waits until it has opened and stopped the base. `executable` is run with
    /// the arguments `guard`, and then those that [`run`](super::run) takes; `path` is the port, best by a
    /// stable name as in `/dev/serial/by-id`. Stamps are on `clock`.
    ///
    /// # Errors
    /// [`GuardError::Start`]; [`GuardError::Base`] where the base cannot be opened; [`GuardError::Gone`]
    /// where the guard ends without a word or says nothing for 6 s.
    pub fn spawn(
        executable: &Path,
        path: &str,
        baud: u32,
        base: &BaseKind,
        clock: SystemClock,
    ) -> Result<Self, GuardError> {
        let command = || {
            let mut command = Command::new(executable);
            // a group of its own: keys that interrupt or stop the program do not reach the guard
            command
                .args(["guard", path, &baud.to_string()])
                .args(base.words())
                .process_group(0);
            command
        };
        let mut guard = command()
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(GuardError::Start)?;
        let (requests, answers) = (guard.stdin.take(), guard.stdout.take());
        let guard = Arc::new(Mutex::new(guard));
        let (sender, replies) = mpsc::channel();
        if let Some(answers) = answers {
            let (watched, second) = (Arc::clone(&guard), command());
            std::thread::spawn(move || watch(answers, &sender, &watched, second));
        }
        let mut guarded = Self {
            guard,
            requests,
            replies,
            asked: 0,
            patience: base.timeout() + PATIENCE,
            track: base.track(),
            clock,
        };
        guarded.reply(OPENING)?;
        Ok(guarded)
    }

    /// The guard's process.
    #[must_use]
    pub fn guard_id(&self) -> u32 {
        lock(&self.guard).id()
    }

    fn ask(&mut self, request: Request) -> Result<Reply, GuardError> {
        self.asked += 1;
        let line = request.line(self.asked);
        let sent = self
            .requests
            .as_mut()
            .is_some_and(|pipe| pipe.write_all(line.as_bytes()).is_ok());
        if !sent {
            self.requests = None;
            return Err(GuardError::Gone);
        }
        self.reply(self.patience)
    }

    /// The answer to the last request.
    fn reply(&mut self, patience: f64) -> Result<Reply, GuardError> {
        let began = Instant::now();
        loop {
            let left = Duration::from_secs_f64(patience).saturating_sub(began.elapsed());
            match self.replies.recv_timeout(left) {
                Ok((number, reply)) if number == self.asked => {
                    return match reply {
                        Reply::Fault(kind, message) => Err(GuardError::Base { kind, message }),
                        reply => Ok(reply),
                    };
                }
                // of a request that was given up
                Ok(_) => {}
                Err(_) => {
                    // dead, or as good as that; the pipe's end has another one started
                    lock(&self.guard).kill().ok();
                    self.requests = None;
                    return Err(GuardError::Gone);
                }
            }
        }
    }
}

/// Hands answers over until the guard has ended. Where it did not end by itself, starts a second one to stop
/// the base: without a program to listen to it does nothing else.
fn watch(
    answers: ChildStdout,
    replies: &Sender<(u64, Reply)>,
    guard: &Mutex<Child>,
    mut second: Command,
) {
    let mut answers = BufReader::new(answers);
    let mut line = Vec::new();
    while let Ok(true) = read_line(&mut answers, &mut line) {
        if let Some(reply) = Reply::read(&line) {
            // nobody waits for it where the base was dropped
            replies.send(reply).ok();
        }
    }
    let ended = lock(guard).wait();
    if !ended.is_ok_and(|status| status.success()) {
        second.stdin(Stdio::null()).stdout(Stdio::null());
        second.status().ok();
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl DifferentialDrive for GuardedBase {
    type Error = GuardError;

    fn track(&self) -> f64 {
        self.track
    }

    fn drive(&mut self, command: Twist2) -> Result<(), GuardError> {
        self.ask(Request::Drive(command)).map(drop)
    }

    fn stop(&mut self) -> Result<(), GuardError> {
        self.ask(Request::Stop).map(drop)
    }

    fn status(&mut self) -> Result<BaseStatus, GuardError> {
        match self.ask(Request::Status)? {
            Reply::State(status) => Ok(BaseStatus {
                stamp: self.clock.now() - status.stamp,
                ..status
            }),
            _ => Err(GuardError::Gone),
        }
    }
}
