//! The simulated robot's devices as others know them: their bytes, on pseudo-terminals, in real time.
//!
//! An [`Emulator`] is a pure step over the simulated robot: bytes in, bytes out. [`Emulation`] runs several
//! of them over one robot, so that any driver can be tried on them, and keeps its own record of the wheel
//! command in force.

mod arduino;
mod create2;
mod kobuki;
mod run;
mod sonars;

use crate::Twist2;
use crate::sim::Simulation;

pub use arduino::ArduinoEmulator;
pub use create2::Create2Emulator;
pub use kobuki::KobukiEmulator;
pub use run::{Emulation, LineFaults, WheelCommand};
pub use sonars::{
    FfEmulator, MaestroEmulator, MaxBotixEmulator, Srf02Emulator, Urm37Emulator, Us100Emulator,
};

/// The device's end of a serial line.
pub trait Emulator: Send {
    /// Takes what has come since the last step, and gives what is sent until now, the robot's time.
    fn step(&mut self, bytes: &[u8], robot: &Simulation) -> Vec<u8>;

    /// The wheel speeds in force, left and right [m/s], where the device has wheels.
    fn wheels(&self) -> Option<[f64; 2]> {
        None
    }
}

/// Answers that are on their way.
#[derive(Debug, Clone, Default)]
struct Later(Vec<(f64, Vec<u8>)>);

impl Later {
    fn send(&mut self, at: f64, bytes: impl Into<Vec<u8>>) {
        self.0.push((at, bytes.into()));
    }

    fn due(&mut self, now: f64) -> Vec<u8> {
        let mut due = Vec::new();
        self.0.retain(|(at, bytes)| {
            if *at <= now {
                due.extend_from_slice(bytes);
            }
            *at > now
        });
        due
    }
}

/// The robot's time [s].
fn now(robot: &Simulation) -> f64 {
    robot.lock().time
}

/// Sets the speeds of the robot's wheels [m/s].
fn drive(robot: &Simulation, wheels: [f64; 2]) {
    let mut state = robot.lock();
    let track = state.params.base.track;
    state.base.command(Twist2::from_wheels(wheels, track));
}

/// What the robot's wheels have rolled, left and right, in counts of so many metres.
fn counts(robot: &Simulation, count: f64) -> [i64; 2] {
    let travel = robot.lock().base.travel();
    [travel.left, travel.right].map(|way| (way / count).round() as i64)
}
