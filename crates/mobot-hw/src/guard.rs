//! A process that owns the base's port and stops the base when the program no longer can.
//!
//! Most bases obey their last command for ever, so a program that is killed, hangs or is stopped leaves
//! them driving. [`GuardedBase`] is a [`DifferentialDrive`](crate::DifferentialDrive) for the program; the
//! driver runs in a second process, the guard, and is told over a pipe. The program's executable is its
//! own guard: started with `guard` as the first argument it calls [`run`].
//!
//! The guard sends the base's stop where the pipe is closed, and where no command to drive came for
//! [`LATCH`](crate::serial::LATCH) seconds: commands are the heartbeat. A stop is repeated until the base's
//! counters say that the wheels stand. Limits, and what is not finite, are dealt with in the guard's driver, last.
//!
//! The other way round, a guard that dies or does not answer is noticed: calls fail as
//! [`Unplugged`](crate::FaultKind::Unplugged), and another one is started that only stops the base. Where
//! the port vanishes, the guard waits for it and stops the base as soon as it is back. It never goes on
//! driving then: that takes a new [`GuardedBase`].
//!
//! Not covered: both processes killed at once, a machine that dies, a line on which nothing comes
//! through, and firmware that does not listen (an Arduino's, for a second, while its sonar hears no echo).

mod base;
mod client;
mod error;
mod pipe;
mod port;
mod process;
mod program;
mod watch;
mod wheels;

pub use base::BaseKind;
pub use client::GuardedBase;
pub use error::GuardError;
pub use process::run;
