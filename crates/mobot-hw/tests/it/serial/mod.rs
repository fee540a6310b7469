//! Serial protocols: bytes from the makers' documents, damaged streams, silent and vanishing ports.

mod arduino;
mod asked;
mod battery;
#[cfg(all(feature = "emulation", unix))]
mod commands;
mod create2;
mod ff;
mod kobuki;
mod maestro;
mod maxbotix;
mod rig;
mod urm37;
