//! An emulated base, programs that drive it, and what its own log says of them.

use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};

use mobot_hw::emulate::{
    ArduinoEmulator, Create2Emulator, Emulation, Emulator, KobukiEmulator, WheelCommand,
};
use mobot_hw::serial::ArduinoParams;
use mobot_hw::sim::{Building, RobotParams, Simulation, World};
use rustix::process::{Pid, Signal};

use crate::stalls;

pub(crate) const BASES: [&str; 3] = ["create2", "kobuki", "arduino"];

/// So many trials, or the long form's where the long batteries are asked for.
pub(crate) fn trials(short: usize, long: usize) -> usize {
    let asked = std::env::var_os("MOBOT_LONG").is_some();
    if asked { long } else { short }
}

pub(crate) fn pause(seconds: f64) {
    std::thread::sleep(Duration::from_secs_f64(seconds));
}

/// Starts an emulation of one device, on an endless floor.
pub(crate) fn emulation(emulator: Box<dyn Emulator>) -> Emulation {
    let world = World::new(&Building::default()).expect("a world");
    let robot = Simulation::new(world, RobotParams::default(), 1).expect("a robot");
    Emulation::start(&robot, vec![emulator], 1).expect("a pseudo-terminal")
}

/// A base, and a stable name of its port, never used again: a guard may still wait for its return.
pub(crate) struct Stage {
    pub(crate) name: &'static str,
    pub(crate) base: Emulation,
    port: PathBuf,
}

impl Stage {
    pub(crate) fn new(name: &'static str) -> Self {
        let emulator: Box<dyn Emulator> = match name {
            "create2" => Box::new(Create2Emulator::default()),
            "kobuki" => Box::new(KobukiEmulator::default()),
            _ => Box::new(ArduinoEmulator::new(ArduinoParams::default())),
        };
        static STAGES: AtomicUsize = AtomicUsize::new(0);
        let number = STAGES.fetch_add(1, Ordering::Relaxed);
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let stage = Self {
            name,
            base: emulation(emulator),
            port: folder.join(format!("base-{}-{number}", std::process::id())),
        };
        stage.leads_to(stage.base.path(0));
        stage
    }

    pub(crate) fn port(&self) -> &str {
        self.port.to_str().expect("a name")
    }

    /// Makes the stable name lead to another terminal.
    pub(crate) fn leads_to(&self, terminal: &Path) {
        let new = self.port.with_extension("new");
        std::os::unix::fs::symlink(terminal, &new).expect("a link");
        std::fs::rename(new, &self.port).expect("a link");
    }

    pub(crate) fn program(&self) -> Program {
        Program::start(self.name, self.port())
    }

    /// The speed of the faster wheel in force now [m/s].
    pub(crate) fn speed(&self) -> f64 {
        let last = self.base.wheel_log(0).last().copied();
        last.map_or(0.0, |c| c.wheels[0].abs().max(c.wheels[1].abs()))
    }

    /// Has the base driven, renewed for `seconds` at 25 Hz.
    pub(crate) fn drives(&self, program: &mut Program, seconds: f64) {
        let until = self.base.elapsed() + seconds;
        loop {
            program.say("drive 0.1 0");
            pause(0.04);
            if self.base.elapsed() >= until && self.speed() > 0.0 {
                return;
            }
            assert!(
                self.base.elapsed() < until + 2.0,
                "{} does not drive",
                self.name
            );
        }
    }

    /// How long after a time the wheels were told to stand [s]; nothing where they stood already, or where
    /// the machine stood still meanwhile.
    pub(crate) fn stopped_after(&self, time: f64) -> Option<f64> {
        let began = Instant::now() - Duration::from_secs_f64(self.base.elapsed() - time);
        let stands = |c: &WheelCommand| c.wheels.iter().all(|w| *w == 0.0);
        for _ in 0..2000 {
            let log = self.base.wheel_log(0);
            let later = log.partition_point(|c| c.stamp < time);
            if log[..later].last().is_none_or(stands) {
                return None;
            }
            if let Some(stop) = log[later..].iter().find(|c| stands(c)) {
                return (!stalls::since(began)).then_some(stop.stamp - time);
            }
            pause(0.002);
        }
        panic!(
            "{} drives on: {:?}",
            self.name,
            self.base.wheel_log(0).last()
        );
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        std::fs::remove_file(&self.port).ok();
    }
}

/// A process that drives the base; killed where it is still there in the end.
pub(crate) struct Program {
    child: Child,
    pub(crate) guard: Pid,
    orders: ChildStdin,
    words: Receiver<String>,
}

impl Program {
    pub(crate) fn start(name: &str, port: &str) -> Self {
        let mut program = Self::try_start(name, port);
        let ready = program.hears();
        let id = ready.strip_prefix("ready ").and_then(|id| id.parse().ok());
        program.guard = id
            .and_then(Pid::from_raw)
            .unwrap_or_else(|| panic!("{ready}"));
        program
    }

    /// One that need not come to drive.
    pub(crate) fn try_start(name: &str, port: &str) -> Self {
        let mut child = Command::new(std::env::current_exe().expect("this executable"))
            .args(["program", name, port])
            // a panic would look for names of functions before it closes anything
            .env("RUST_BACKTRACE", "0")
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("a process");
        let orders = child.stdin.take().expect("a pipe");
        let lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
        let (sender, words) = mpsc::channel();
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                sender.send(line).ok();
            }
        });
        let guard = Pid::from_child(&child);
        Self {
            child,
            guard,
            orders,
            words,
        }
    }

    pub(crate) fn say(&mut self, order: &str) {
        writeln!(self.orders, "{order}").expect("a program that listens");
    }

    /// The next thing that it says.
    pub(crate) fn hears(&mut self) -> String {
        let word = self.words.recv_timeout(Duration::from_secs(8));
        word.expect("a program that answers")
    }

    /// What it says to this.
    pub(crate) fn asked(&mut self, order: &str) -> String {
        while self.words.try_recv().is_ok() {}
        self.say(order);
        self.hears()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        signal_to(Pid::from_child(&self.child), signal);
    }

    /// As a terminal's keys do it.
    pub(crate) fn signal_group(&self, signal: Signal) {
        let group = Pid::from_child(&self.child);
        rustix::process::kill_process_group(group, signal).expect("a group");
    }

    pub(crate) fn waits_for_its_end(&mut self) {
        self.child.wait().expect("an end");
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

pub(crate) fn signal_to(process: Pid, signal: Signal) {
    rustix::process::kill_process(process, signal).expect("a process");
}
