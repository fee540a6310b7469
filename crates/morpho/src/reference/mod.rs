//! The definitions as plain code, pixel by pixel: the twins that the fast kernels are tested against.

pub mod distance;
pub mod ops;
pub mod thin;
