//! `mobot explore` on the command line.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::DeviceArgs;
use crate::nav::Hand;

/// The hand that stays on the wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum HandArg {
    /// Anticlockwise round a room.
    Right,
    /// Clockwise round a room.
    Left,
}

impl From<HandArg> for Hand {
    fn from(hand: HandArg) -> Self {
        match hand {
            HandArg::Right => Self::Right,
            HandArg::Left => Self::Left,
        }
    }
}

/// `mobot explore`
#[derive(Debug, Args)]
pub struct ExploreArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "flattened: its fields are documented")]
    pub devices: DeviceArgs,
    /// Folder for map, sonar log, roadmap, pictures and run log.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// End after so much time of the robot's clock [s], whatever is left.
    #[arg(long, value_name = "SECONDS", default_value_t = 3600.0)]
    pub budget: f64,
    /// Shots of a survey, equally all round.
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub shots: u32,
    /// From stop to stop along a wall [m].
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    pub step: f64,
    /// The hand that stays on the wall.
    #[arg(long, default_value = "right")]
    pub hand: HandArg,
}
