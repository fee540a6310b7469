//! Devices on pseudo-terminals, in real time.

use std::fs::DirBuilder;
use std::io;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::Emulator;
use super::line_faults::{FaultyLine, LineFaults};
use super::robot_view::{DeviceFaults, RobotView};
use super::terminal::Terminal;
use crate::Clock as _;
use crate::dice::Dice;
use crate::sim::Simulation;

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
/// A machine that needs longer for a step is not waited for.
const LONGEST_STEP: Duration = Duration::from_secs(1);

#[derive(Debug, Default)]
struct Shared {
    faults: Mutex<(LineFaults, DeviceFaults)>,
    log: Mutex<Vec<WheelCommand>>,
}

struct Device {
    link: PathBuf,
    terminal: Option<Terminal>,
    line: FaultyLine,
    emulator: Box<dyn Emulator>,
    robot: RobotView,
    shared: Arc<Shared>,
}

/// Devices of one simulated robot on pseudo-terminals, until it is dropped.
#[derive(Debug)]
pub struct Emulation {
    devices: Vec<(PathBuf, Arc<Shared>)>,
    began: Instant,
    stop: Arc<AtomicBool>,
    steps: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
    /// Made for the links, and gone with them.
    folder: Option<LinkFolder>,
}

impl Emulation {
    /// Puts the devices on pseudo-terminals and lets the robot's time pass as real time does. The seed is for
    /// the faults of the lines. The links to the terminals are in a folder of their own, for temporary files.
    ///
    /// # Errors
    /// The system's, where it has no pseudo-terminals.
    pub fn start(
        robot: &Simulation,
        emulators: Vec<Box<dyn Emulator>>,
        seed: u64,
    ) -> io::Result<Self> {
        let folder = LinkFolder::new()?;
        let named = emulators
            .into_iter()
            .enumerate()
            .map(|(k, emulator)| (folder.0.join(k.to_string()), emulator));
        let mut emulation = Self::start_at(robot, named.collect(), seed)?;
        emulation.folder = Some(folder);
        Ok(emulation)
    }

    /// The same, each device under the link that is named beside it.
    ///
    /// # Errors
    /// The system's, where it has no pseudo-terminals, or where a link cannot be made: a link of that name is
    /// replaced, anything else is not.
    pub fn start_at(
        robot: &Simulation,
        emulators: Vec<(PathBuf, Box<dyn Emulator>)>,
        seed: u64,
    ) -> io::Result<Self> {
        let mut devices = Vec::new();
        let mut running = Vec::new();
        let mut dice = Dice::new(seed);
        for (link, emulator) in emulators {
            let terminal = Terminal::open(&link)?;
            let shared = Arc::new(Shared::default());
            devices.push((link.clone(), Arc::clone(&shared)));
            running.push(Device {
                link,
                terminal: Some(terminal),
                line: FaultyLine::new(Dice::new(dice.next())),
                emulator,
                robot: RobotView::new(robot),
                shared,
            });
        }
        let stop = Arc::new(AtomicBool::new(false));
        let steps = Arc::new(AtomicU64::new(0));
        let (mut clock, stopped) = (robot.clock(), Arc::clone(&stop));
        let counted = Arc::clone(&steps);
        let (began, start) = (Instant::now(), clock.now());
        let thread = std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                std::thread::sleep(TICK);
                let due = start + began.elapsed().as_secs_f64();
                clock.sleep(due - clock.now());
                for device in &mut running {
                    device.step(began.elapsed().as_secs_f64());
                }
                counted.fetch_add(1, Ordering::Release);
            }
        });
        Ok(Self {
            devices,
            began,
            stop,
            steps,
            thread: Some(thread),
            folder: None,
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

    /// The link to a device's terminal, in the order they were given.
    ///
    /// # Panics
    /// Where there is no such device.
    #[must_use]
    pub fn path(&self, device: usize) -> &Path {
        &self.devices[device].0
    }

    /// Sets the faults of a device's line; returns once they are in force.
    ///
    /// # Panics
    /// Where there is no such device.
    pub fn set_faults(&self, device: usize, faults: LineFaults) {
        lock(&self.devices[device].1.faults).0 = faults;
        self.wait_for_a_step();
    }

    /// Sets what is wrong with a device itself; returns once it is in force.
    ///
    /// # Panics
    /// Where there is no such device.
    pub fn set_device_faults(&self, device: usize, faults: DeviceFaults) {
        lock(&self.devices[device].1.faults).1 = faults;
        self.wait_for_a_step();
    }

    /// Waits until a step that begins after now is over; not for ever.
    fn wait_for_a_step(&self) {
        let before = self.steps.load(Ordering::Acquire);
        let called = Instant::now();
        while self.steps.load(Ordering::Acquire) < before + 2 && called.elapsed() < LONGEST_STEP {
            std::thread::sleep(TICK / 4);
        }
    }

    /// The wheel commands that came into force at a device so far; the last one is in force now.
    ///
    /// # Panics
    /// Where there is no such device.
    #[must_use]
    pub fn wheel_log(&self, device: usize) -> Vec<WheelCommand> {
        self.wheel_log_from(device, 0)
    }

    /// The same without the first so many.
    ///
    /// # Panics
    /// Where there is no such device.
    #[must_use]
    pub fn wheel_log_from(&self, device: usize, first: usize) -> Vec<WheelCommand> {
        let log = lock(&self.devices[device].1.log);
        log.get(first..).unwrap_or_default().to_vec()
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
    fn step(&mut self, now: f64) {
        let (line, device) = *lock(&self.shared.faults);
        if line.unplugged {
            self.terminal = None;
        } else if self.terminal.is_none() {
            // without a terminal to be had now it stays unplugged
            self.terminal = Terminal::open(&self.link).ok();
        }
        let mut bytes = [0; 1024];
        let terminal = self.terminal.as_ref();
        let read = terminal.map_or(0, |t| t.read(&mut bytes));
        let come = if line.silent { &[] } else { &bytes[..read] };
        self.robot.tick(device);
        let sent = self.emulator.step(come, &mut self.robot);
        let arrived = self.line.carry(&sent, &line, now);
        if let Some(terminal) = terminal.filter(|_| !arrived.is_empty()) {
            terminal.write(&arrived);
        }
        self.record(now);
    }

    /// Keeps the wheel command in force where it has changed.
    fn record(&self, stamp: f64) {
        let Some(wheels) = self.emulator.wheels() else {
            return;
        };
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

/// A new folder that only this user can read; dropped, it is gone.
#[derive(Debug)]
struct LinkFolder(PathBuf);

impl LinkFolder {
    fn new() -> io::Result<Self> {
        // never the same name twice: who waits for a device of before must not find one of now
        static MADE: AtomicU64 = AtomicU64::new(0);
        let process = std::process::id();
        loop {
            let count = MADE.fetch_add(1, Ordering::Relaxed);
            let folder = std::env::temp_dir().join(format!("mobot-emulate-{process}-{count}"));
            match DirBuilder::new().mode(0o700).create(&folder) {
                Ok(()) => return Ok(Self(folder)),
                // left over from another process of this number
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && count < 10_000 => {}
                Err(error) => return Err(error),
            }
        }
    }
}

impl Drop for LinkFolder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // whoever panicked left a value that is whole
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
