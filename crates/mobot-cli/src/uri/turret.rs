//! `--turret none | maestro:PORT | urm37 | sim: | replay:FILE`

use std::path::PathBuf;

use mobot_hw::serial::{MaestroParams, Urm37Params, maestro, urm37};

use super::{Options, Parts, Role, SerialLine, UriError};

/// What turns the sonar.
#[derive(Debug, Clone, PartialEq)]
pub enum Turret {
    /// Nothing: the robot turns on the spot.
    None,
    /// The simulated robot's pan.
    Sim,
    /// A servo on a Maestro.
    Maestro {
        /// Its line.
        line: SerialLine,
        /// How it is used.
        params: MaestroParams,
    },
    /// The URM37's own servo.
    Urm37 {
        /// How it is used.
        params: Urm37Params,
    },
    /// A recorded one.
    Replay(PathBuf),
}

impl Role for Turret {
    const EXPECTED: &'static str =
        "none, maestro:PORT, urm37, sim:, replay:FILE or record:FILE,maestro:PORT";

    fn read(parts: &mut Parts<'_>) -> Result<Option<Self>, UriError> {
        Ok(Some(match parts.scheme {
            "none" => {
                parts.unnamed()?;
                Self::None
            }
            "sim" => {
                parts.unnamed()?;
                Self::Sim
            }
            "maestro" => {
                let line = SerialLine::read(parts, maestro::BAUD)?;
                let params = maestro_params(&mut parts.options)?;
                Self::Maestro { line, params }
            }
            "urm37" => {
                parts.unnamed()?;
                let params = urm37_params(&mut parts.options)?;
                Self::Urm37 { params }
            }
            "replay" => Self::Replay(parts.named("a recorded FILE")?.into()),
            _ => return Ok(None),
        }))
    }
}

/// The servo's angle at which the sonar looks straight ahead [deg], and whether larger ones are to the left.
fn zero_and_sense(options: &mut Options, usual: f64) -> Result<(f64, bool), UriError> {
    let centre = options.number("centre_deg", "0 to 360", [0.0, 360.0])?;
    let sign = options.take("sign", "1 or -1", |text| match text {
        "1" | "+1" => Some(true),
        "-1" => Some(false),
        _ => None,
    })?;
    Ok((centre.unwrap_or(usual), sign.unwrap_or(true)))
}

fn maestro_params(options: &mut Options) -> Result<MaestroParams, UriError> {
    let default = MaestroParams::default();
    let (centre, left) = zero_and_sense(options, 90.0)?;
    let channel = options.take("channel", "0 to 23", |text| {
        text.parse().ok().filter(|channel| *channel < 24)
    })?;
    let us_per_rad = default.us_per_rad;
    Ok(MaestroParams {
        channel: channel.unwrap_or(default.channel),
        centre_us: default.centre_us + (centre - 90.0).to_radians() * us_per_rad,
        us_per_rad: if left { us_per_rad } else { -us_per_rad },
        ..default
    })
}

fn urm37_params(options: &mut Options) -> Result<Urm37Params, UriError> {
    let default = Urm37Params::default();
    let step = options.number("step_deg", "1 to 30", [1.0, 30.0])?;
    let step = step.unwrap_or(default.step.to_degrees());
    let (centre, left) = zero_and_sense(options, f64::from(default.centre) * step)?;
    let steps = (centre / step).round();
    if steps > f64::from(urm37::MAX_STEPS) {
        return Err(UriError::Value {
            key: "centre_deg",
            expected: "an angle that the servo reaches in 46 steps",
            found: centre.to_string(),
        });
    }
    Ok(Urm37Params {
        step: step.to_radians(),
        centre: steps as u8,
        clockwise: !left,
        ..default
    })
}
