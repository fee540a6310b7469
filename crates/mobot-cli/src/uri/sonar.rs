//! `--sonar sim: | maxbotix:PORT | ff:PORT | urm37:PORT | us100:PORT | srf02:PORT | replay:FILE`

use std::path::PathBuf;

use mobot_hw::serial::{
    FfParams, MaxBotixModel, MaxBotixParams, Srf02Params, Us100Params, asked, ff, maxbotix, urm37,
};
use occgrid::{Pose2, SonarModel};

use super::{Options, Parts, Role, SerialLine, UriError};

/// A sonar, and where it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Sonar {
    /// Pose in the base frame: of the sonar, or of the axle of the motor that turns it.
    pub mount: Pose2,
    /// Which one.
    pub kind: SonarKind,
}

/// Which sonar.
#[derive(Debug, Clone, PartialEq)]
pub enum SonarKind {
    /// The simulated robot's.
    Sim,
    /// MaxBotix with ASCII output.
    MaxBotix {
        /// Its line.
        line: SerialLine,
        /// Which family.
        model: MaxBotixModel,
    },
    /// JSN-SR04T, A01, A02, ME007.
    Ff {
        /// Its line.
        line: SerialLine,
        /// It waits to be asked.
        ask: bool,
    },
    /// URM37.
    Urm37 {
        /// Its line.
        line: SerialLine,
    },
    /// US-100.
    Us100 {
        /// Its line.
        line: SerialLine,
    },
    /// SRF02.
    Srf02 {
        /// Its line.
        line: SerialLine,
        /// Its address, 0 to 15.
        address: u8,
    },
    /// A recorded one, with its turret.
    Replay(PathBuf),
}

impl Role for Sonar {
    const EXPECTED: &'static str = "sim:, maxbotix:PORT, ff:PORT, urm37:PORT, us100:PORT, srf02:PORT, replay:FILE or record:FILE,DEVICE";

    fn read(parts: &mut Parts<'_>) -> Result<Option<Self>, UriError> {
        let kind = match parts.scheme {
            "sim" => {
                parts.unnamed()?;
                SonarKind::Sim
            }
            "maxbotix" => SonarKind::MaxBotix {
                model: model(&mut parts.options)?,
                line: SerialLine::read(parts, maxbotix::BAUD)?,
            },
            "ff" => SonarKind::Ff {
                ask: parts
                    .options
                    .take("ask", "true or false", |text| text.parse().ok())?
                    .unwrap_or(false),
                line: SerialLine::read(parts, ff::BAUD)?,
            },
            "urm37" => SonarKind::Urm37 {
                line: SerialLine::read(parts, urm37::BAUD)?,
            },
            "us100" => SonarKind::Us100 {
                line: SerialLine::read(parts, asked::BAUD)?,
            },
            "srf02" => SonarKind::Srf02 {
                address: address(&mut parts.options)?,
                line: SerialLine::read(parts, asked::BAUD)?,
            },
            "replay" => SonarKind::Replay(parts.named("a recorded FILE")?.into()),
            _ => return Ok(None),
        };
        let mount =
            parts
                .options
                .take("mount", "X,Y,YAW in the base frame [m, m, rad]", |text| {
                    let numbers: Vec<f64> = text.split(',').flat_map(str::parse).collect();
                    let whole = numbers.iter().all(|n| n.is_finite());
                    match numbers[..] {
                        [x, y, yaw] if whole && text.split(',').count() == 3 => {
                            Some(Pose2::new(x, y, yaw))
                        }
                        _ => None,
                    }
                })?;
        Ok(Some(Self {
            mount: mount.unwrap_or(Pose2::new(0.0, 0.0, 0.0)),
            kind,
        }))
    }
}

/// The family of a MaxBotix; by default the LV.
pub(crate) fn model(options: &mut Options) -> Result<MaxBotixModel, UriError> {
    let expected = "lv, xl, xl_long, hrlv, hrxl or hrxl_long";
    let model = options.take("model", expected, |text| {
        Some(match text {
            "lv" => MaxBotixModel::Lv,
            "xl" => MaxBotixModel::Xl,
            "xl_long" => MaxBotixModel::XlLong,
            "hrlv" => MaxBotixModel::Hrlv,
            "hrxl" => MaxBotixModel::Hrxl,
            "hrxl_long" => MaxBotixModel::HrxlLong,
            _ => return None,
        })
    })?;
    Ok(model.unwrap_or_default())
}

/// The address of an SRF02; by default 0.
pub(crate) fn address(options: &mut Options) -> Result<u8, UriError> {
    let address = options.take("address", "0 to 15", |text| {
        text.parse().ok().filter(|address| *address < 16)
    })?;
    Ok(address.unwrap_or_default())
}

impl Sonar {
    /// The sensor that a map is made with: mount, nearest and farthest echo, and rounding of this kind; the
    /// beam as [`SonarModel`] has it.
    #[must_use]
    pub fn sensor(&self) -> SonarModel {
        let [blanking, max_range, unit] = match &self.kind {
            SonarKind::MaxBotix { model, .. } => {
                let [nearest, farthest] = model.ends().map(|n| f64::from(n) * model.unit());
                [nearest, farthest, model.unit()]
            }
            SonarKind::Ff { .. } => {
                let FfParams {
                    nearest, farthest, ..
                } = FfParams::default();
                [nearest, farthest, 0.001]
            }
            SonarKind::Us100 { .. } => [0.02, Us100Params::default().farthest, 0.001],
            SonarKind::Srf02 { .. } => {
                let Srf02Params {
                    nearest, farthest, ..
                } = Srf02Params::default();
                [nearest, farthest, 0.01]
            }
            SonarKind::Urm37 { .. } => [0.04, 5.0, 0.01],
            SonarKind::Sim | SonarKind::Replay(_) => [0.2, 5.0, 0.01],
        };
        SonarModel {
            mount: self.mount,
            blanking,
            max_range,
            sigma: 0.05_f64.max(unit),
            ..SonarModel::default()
        }
    }

    /// The parameters of a MaxBotix of a family.
    pub(crate) fn maxbotix_params(model: MaxBotixModel) -> MaxBotixParams {
        // two readings that agree of three, fired after the call
        MaxBotixParams {
            model,
            timeout: (6.0 * model.cycle()).max(0.3),
            ..MaxBotixParams::default()
        }
    }
}
