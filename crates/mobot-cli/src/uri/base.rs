//! `--base sim: | create2:PORT | kobuki:PORT | arduino:PORT | replay:FILE`

use std::path::PathBuf;

use mobot_hw::serial::{
    ArduinoParams, Create2Params, KobukiParams, WheelLimits, arduino, create2, kobuki,
};

use super::{Options, Parts, Role, SerialLine, UriError};

/// A base.
#[derive(Debug, Clone, PartialEq)]
pub enum Base {
    /// The simulated robot's.
    Sim,
    /// iRobot Create 2, Roomba 500 to 800.
    Create2 {
        /// Its line.
        line: SerialLine,
        /// How it is used.
        params: Create2Params,
    },
    /// Yujin Kobuki.
    Kobuki {
        /// Its line.
        line: SerialLine,
        /// How it is used.
        params: KobukiParams,
    },
    /// ROSArduinoBridge.
    Arduino {
        /// Its line.
        line: SerialLine,
        /// How it is built.
        params: ArduinoParams,
    },
    /// A recorded one.
    Replay(PathBuf),
}

impl Role for Base {
    const EXPECTED: &'static str =
        "sim:, create2:PORT, kobuki:PORT, arduino:PORT, replay:FILE or record:FILE,DEVICE";

    fn read(parts: &mut Parts<'_>) -> Result<Option<Self>, UriError> {
        Ok(Some(match parts.scheme {
            "sim" => {
                parts.unnamed()?;
                Self::Sim
            }
            "create2" => Self::Create2 {
                line: SerialLine::read(parts, create2::BAUD)?,
                params: Create2Params {
                    limits: limits(&mut parts.options)?,
                    ..Create2Params::default()
                },
            },
            "kobuki" => Self::Kobuki {
                line: SerialLine::read(parts, kobuki::BAUD)?,
                params: KobukiParams {
                    limits: limits(&mut parts.options)?,
                    ..KobukiParams::default()
                },
            },
            "arduino" => Self::Arduino {
                line: SerialLine::read(parts, arduino::BAUD)?,
                params: arduino_params(&mut parts.options)?,
            },
            "replay" => Self::Replay(parts.named("a recorded FILE")?.into()),
            _ => return Ok(None),
        }))
    }
}

fn limits(options: &mut Options) -> Result<WheelLimits, UriError> {
    let default = WheelLimits::default();
    let expected = "a speed of 0.01 to 2 m/s";
    Ok(WheelLimits {
        max_speed: options
            .number("max_speed", expected, [0.01, 2.0])?
            .unwrap_or(default.max_speed),
        ..default
    })
}

pub(crate) fn arduino_params(options: &mut Options) -> Result<ArduinoParams, UriError> {
    let default = ArduinoParams::default();
    let track = "a distance between the wheels of 0.02 to 2 m";
    let counts = "1 to 10000000 counts of an encoder a metre";
    Ok(ArduinoParams {
        limits: limits(options)?,
        track: options
            .number("track", track, [0.02, 2.0])?
            .unwrap_or(default.track),
        counts_per_metre: options
            .number("counts_per_metre", counts, [1.0, 1e7])?
            .unwrap_or(default.counts_per_metre),
        ..default
    })
}
