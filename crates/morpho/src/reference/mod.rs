//! The definitions as plain code, pixel by pixel: the twins that the fast kernels are tested against.

pub mod distance;
pub mod fill;
pub mod homotopic;
pub mod ops;
pub mod thin;
