//! Drivers for devices on serial lines, over anything that reads and writes.
//!
//! Each protocol has its bytes (a decoder without I/O, and an encoder for the other side) and its driver
//! apart. A driver takes a port and a clock. The port's reads must return within some milliseconds, with
//! [`TimedOut`](std::io::ErrorKind::TimedOut) or [`WouldBlock`](std::io::ErrorKind::WouldBlock) where
//! nothing came; `open` (feature `serial`) makes such ports. Then every call returns within
//! its timeout and one such read.

mod burst;
mod decode;
mod gate;
mod line;
#[cfg(feature = "serial")]
mod open;
mod sonar_bounds;
mod sum_frame;
mod wheels;

pub mod arduino;
pub mod asked;
pub mod create2;
pub mod ff;
pub mod kobuki;
pub mod maestro;
pub mod maxbotix;
pub mod urm37;

pub use arduino::{Arduino, ArduinoParams};
pub use asked::{Asked, Srf02, Srf02Params, Us100, Us100Params};
pub use burst::Burst;
pub use create2::{Create2, Create2Params};
pub use decode::{Decode, Event, FrameFault, Framing, Pushed, Scanner, Verdict};
pub use ff::{FfParams, FfSonar};
pub use kobuki::{Kobuki, KobukiParams};
pub use line::{Line, LineCounts, SerialError};
pub use maestro::{Maestro, MaestroParams};
pub use maxbotix::{MaxBotix, MaxBotixModel, MaxBotixParams};
#[cfg(feature = "serial")]
pub use open::{OpenError, Port, open};
pub use sum_frame::SumFraming;
pub use urm37::{Urm37, Urm37Params};
pub use wheels::{LATCH, WheelLimits};
