//! Times when the machine had no time for this process, or for its terminals: what they delay says nothing
//! of the guard.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags};
use rustix::pty::OpenptFlags;
use rustix::termios::OptionalActions;

/// A thread that sleeps for a millisecond or two, sends a byte through a pseudo-terminal and has it this much
/// later was kept from running, or the byte was: a worker of the kernel's carries it, which waits for a
/// processor as all do.
const STALL: Duration = Duration::from_millis(20);

static STALLS: Mutex<Vec<[Instant; 2]>> = Mutex::new(Vec::new());

/// Watches for stalls as long as the process lives.
pub(crate) fn watch() {
    let (mut theirs, mut ours) = terminal().expect("a pseudo-terminal");
    std::thread::spawn(move || {
        let mut before = Instant::now();
        loop {
            std::thread::sleep(Duration::from_millis(2));
            theirs.write_all(b"x").expect("a terminal");
            ours.read_exact(&mut [0]).expect("a terminal");
            let now = Instant::now();
            if now - before > STALL {
                STALLS.lock().expect("a list").push([before, now]);
            }
            before = now;
        }
    });
}

/// Whether there was one since a time.
pub(crate) fn since(time: Instant) -> bool {
    // one that is just over may not be in the list yet
    std::thread::sleep(Duration::from_millis(4));
    let stalls = STALLS.lock().expect("a list");
    stalls.iter().rev().any(|[_, end]| *end > time)
}

/// Whether this took so long that the machine was busy with something else.
pub(crate) fn is_one(time: Duration) -> bool {
    time > STALL
}

/// A device's end of a pseudo-terminal in raw mode, and the other one.
fn terminal() -> rustix::io::Result<(File, File)> {
    let ours = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    rustix::pty::grantpt(&ours)?;
    rustix::pty::unlockpt(&ours)?;
    let path = rustix::pty::ptsname(&ours, Vec::new())?;
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let theirs = rustix::fs::open(&*path, flags, Mode::empty())?;
    let mut mode = rustix::termios::tcgetattr(&theirs)?;
    mode.make_raw();
    rustix::termios::tcsetattr(&theirs, OptionalActions::Now, &mode)?;
    Ok((theirs.into(), ours.into()))
}
