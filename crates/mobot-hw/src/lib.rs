#![doc = include_str!("../README.md")]

#[cfg(feature = "simulation")]
pub mod sim;
