//! Devices on pseudo-terminals, in real time.

use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags};
use rustix::io::FdFlags;
use rustix::pty::OpenptFlags;
use rustix::termios::OptionalActions;

use super::Emulator;
use crate::Clock as _;
use crate::dice::Dice;
use crate::sim::Simulation;

/// What a bad line does to the bytes that a device sends.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LineFaults {
    /// Nothing comes through, in either direction.
    pub silent: bool,
    /// The terminal is gone; for good.
    pub unplugged: bool,
    /// Probability that a byte is lost.
    pub dropped: f64,
    /// Probability that a byte comes twice.
    pub doubled: f64,
    /// Probability that one bit of a byte is turned.
    pub flipped: f64,
}

impl LineFaults {
    fn through(&self, bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
        let mut out = Vec::with_capacity(bytes.len());
        for byte in bytes {
            let turned = dice.chance(self.flipped);
            let bit = 1_u8 << (dice.next() & 7);
            let byte = if turned { byte ^ bit } else { *byte };
            if !dice.chance(self.dropped) {
                out.push(byte);
            }
            if dice.chance(self.doubled) {
                out.push(byte);
            }
        }
        out
    }
}

/// A wheel command, and since when it is in force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelCommand {
    /// Since the emulation began [s].
    pub stamp: f64,
    /// Left and right [m/s].
    pub wheels: [f64; 2],
}

/// Most wheel commands that are kept.
const LOG: usize = 1_000_000;
/// Time between two steps.
const TICK: Duration = Duration::from_millis(1);

#[derive(Debug, Default)]
struct Shared {
    faults: Mutex<LineFaults>,
    log: Mutex<Vec<WheelCommand>>,
}

struct Device {
    /// Our end, and the other one held open so that a client may come and go.
    ends: Option<[OwnedFd; 2]>,
    emulator: Box<dyn Emulator>,
    shared: Arc<Shared>,
    dice: Dice,
}

/// Devices of one simulated robot on pseudo-terminals, until it is dropped.
#[derive(Debug)]
pub struct Emulation {
    devices: Vec<(PathBuf, Arc<Shared>)>,
    began: Instant,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Emulation {
    /// Puts the devices on pseudo-terminals and lets the robot's time pass as real time does. The seed is for
    /// the faults of the lines.
    ///
    /// # Errors
    /// The system's, where it has no pseudo-terminals.
    pub fn start(
        robot: &Simulation,
        emulators: Vec<Box<dyn Emulator>>,
        seed: u64,
    ) -> io::Result<Self> {
        let mut devices = Vec::new();
        let mut running = Vec::new();
        let mut dice = Dice::new(seed);
        for emulator in emulators {
            let (ends, path) = terminal()?;
            let shared = Arc::new(Shared::default());
            devices.push((path, Arc::clone(&shared)));
            running.push(Device {
                ends: Some(ends),
                emulator,
                shared,
                dice: Dice::new(dice.next()),
            });
        }
        let stop = Arc::new(AtomicBool::new(false));
        let (robot, stopped) = (robot.clone(), Arc::clone(&stop));
        let began = Instant::now();
        let thread = std::thread::spawn(move || {
            let mut clock = robot.clock();
            let start = clock.now();
            while !stopped.load(Ordering::Relaxed) {
                std::thread::sleep(TICK);
                let due = start + began.elapsed().as_secs_f64();
                clock.sleep(due - clock.now());
                for device in &mut running {
                    device.step(&robot, began.elapsed().as_secs_f64());
                }
            }
        });
        Ok(Self {
            devices,
            began,
            stop,
            thread: Some(thread),
        })
    }

    /// The time on the clock of [`WheelCommand::stamp`] [s].
    #[must_use]
    pub fn elapsed(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// How many devices there are.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.devices.len()
    }

    /// Whether there is none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.devices.is_empty()
    }

    /// The terminal of a device, in the order they were given.
    ///
    /// # Panics
    /// Where there is no such device.
    #[must_use]
    pub fn path(&self, device: usize) -> &Path {
        &self.devices[device].0
    }

    /// Sets the faults of a device's line from now on.
    ///
    /// # Panics
    /// Where there is no such device.
    pub fn set_faults(&self, device: usize, faults: LineFaults) {
        *lock(&self.devices[device].1.faults) = faults;
    }

    /// The wheel commands that came into force at a device so far; the last one is in force now.
    ///
    /// # Panics
    /// Where there is no such device.
    #[must_use]
    pub fn wheel_log(&self, device: usize) -> Vec<WheelCommand> {
        lock(&self.devices[device].1.log).clone()
    }
}

impl Drop for Emulation {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

impl Device {
    fn step(&mut self, robot: &Simulation, stamp: f64) {
        let faults = *lock(&self.shared.faults);
        if faults.unplugged {
            self.ends = None;
        }
        let mut bytes = [0; 1024];
        // nothing to read is no error here; nobody else has the other end
        let read = match &self.ends {
            Some([ours, _]) => rustix::io::read(ours, &mut bytes).unwrap_or(0),
            None => 0,
        };
        let come = if faults.silent { &[] } else { &bytes[..read] };
        let out = self.emulator.step(come, robot);
        if let Some([ours, _]) = &self.ends
            && !faults.silent
            && !out.is_empty()
        {
            // what does not fit is lost, as on a line that nobody reads
            rustix::io::write(ours, &faults.through(&out, &mut self.dice)).ok();
        }
        if let Some(wheels) = self.emulator.wheels() {
            let mut log = lock(&self.shared.log);
            let bits = |wheels: [f64; 2]| wheels.map(f64::to_bits);
            let changed = log
                .last()
                .is_none_or(|last| bits(last.wheels) != bits(wheels));
            if changed && log.len() < LOG {
                log.push(WheelCommand { stamp, wheels });
            }
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // whoever panicked left a value that is whole
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A pseudo-terminal in raw mode: our end, the other end, and its name.
fn terminal() -> io::Result<([OwnedFd; 2], PathBuf)> {
    // a child process that kept an end would keep a pulled plug in
    let ours = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    rustix::io::fcntl_setfd(&ours, FdFlags::CLOEXEC)?;
    rustix::pty::grantpt(&ours)?;
    rustix::pty::unlockpt(&ours)?;
    let name = rustix::pty::ptsname(&ours, Vec::new())?;
    let path = PathBuf::from(name.into_string().map_err(io::Error::other)?);
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let theirs = rustix::fs::open(&path, flags, Mode::empty())?;
    let mut mode = rustix::termios::tcgetattr(&theirs)?;
    mode.make_raw();
    rustix::termios::tcsetattr(&theirs, OptionalActions::Now, &mode)?;
    rustix::fs::fcntl_setfl(&ours, OFlags::RDWR | OFlags::NONBLOCK)?;
    Ok(([ours, theirs], path))
}
