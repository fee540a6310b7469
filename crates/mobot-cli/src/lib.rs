#![doc = include_str!("../README.md")]

pub mod args;
pub mod cmd;
pub mod frame;
pub mod interrupt;
pub mod nav;
pub mod output;
pub mod picture;
pub mod report;
pub mod run_log;
pub mod score;
pub mod uri;
pub mod world;
