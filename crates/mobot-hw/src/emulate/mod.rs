//! The simulated robot's devices as others know them: their bytes, on pseudo-terminals, in real time.
//!
//! An [`Emulator`] is a pure step over the simulated robot: bytes in, bytes out. [`Emulation`] runs several
//! of them over one robot, so that any driver can be tried on them, and keeps its own record of the wheel
//! command in force.

mod arduino;
mod create2;
mod kobuki;
mod line_faults;
mod robot_view;
mod run;
mod sonars;
mod terminal;

pub use arduino::ArduinoEmulator;
pub use create2::Create2Emulator;
pub use kobuki::KobukiEmulator;
pub use line_faults::LineFaults;
pub use robot_view::{DeviceFaults, RobotView, Stuck};
pub use run::{Emulation, WheelCommand};
pub use sonars::{
    FfEmulator, MaestroEmulator, MaxBotixEmulator, Srf02Emulator, Urm37Emulator, Us100Emulator,
};

/// The device's end of a serial line.
pub trait Emulator: Send {
    /// Takes what has come since the last step, and gives what is sent until now.
    fn step(&mut self, bytes: &[u8], robot: &mut RobotView) -> Vec<u8>;

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
