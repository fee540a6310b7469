//! The kinds of devices that can be emulated.

use mobot_hw::emulate::{
    ArduinoEmulator, Create2Emulator, Emulator, FfEmulator, KobukiEmulator, MaestroEmulator,
    MaxBotixEmulator, Srf02Emulator, Urm37Emulator, Us100Emulator,
};
use mobot_hw::serial::{FfParams, Srf02Params, Urm37Params, Us100Params, create2, kobuki};
use mobot_hw::sim::BaseParams;

use crate::uri::{self, Parts, Role, UriError};

/// A device to emulate, and what it makes of the robot.
pub(super) struct Kind {
    pub(super) emulator: Box<dyn Emulator>,
    /// Where it is a base.
    pub(super) base: Option<BaseParams>,
    /// How far it hears, where it is a sonar [m].
    pub(super) max_range: Option<f64>,
}

impl Role for Kind {
    const EXPECTED: &'static str =
        "create2, kobuki, arduino, maxbotix, ff, urm37, us100, srf02 or maestro";

    fn read(parts: &mut Parts<'_>) -> Result<Option<Self>, UriError> {
        parts.unnamed()?;
        let options = &mut parts.options;
        let wheels = |track, tick| {
            Some(BaseParams {
                track,
                tick,
                ..BaseParams::default()
            })
        };
        let (mut base, mut max_range) = (None, None);
        let emulator: Box<dyn Emulator> = match parts.scheme {
            "create2" => {
                base = wheels(create2::TRACK, create2::COUNT);
                Box::new(Create2Emulator::default())
            }
            "kobuki" => {
                base = wheels(kobuki::TRACK, kobuki::COUNT);
                Box::new(KobukiEmulator::default())
            }
            "arduino" => {
                let params = uri::arduino_params(options)?;
                base = wheels(params.track, 1.0 / params.counts_per_metre);
                max_range = Some(params.farthest);
                Box::new(ArduinoEmulator::new(params))
            }
            "maxbotix" => {
                let model = uri::model(options)?;
                max_range = Some(f64::from(model.ends()[1]) * model.unit());
                Box::new(MaxBotixEmulator::new(model))
            }
            "ff" => {
                max_range = Some(FfParams::default().farthest);
                Box::new(FfEmulator::default())
            }
            "urm37" => {
                max_range = Some(Urm37Params::default().farthest);
                Box::new(Urm37Emulator::default())
            }
            "us100" => {
                max_range = Some(Us100Params::default().farthest);
                Box::new(Us100Emulator::default())
            }
            "srf02" => {
                max_range = Some(Srf02Params::default().farthest);
                Box::new(Srf02Emulator::at(uri::address(options)?))
            }
            "maestro" => Box::new(MaestroEmulator::default()),
            _ => return Ok(None),
        };
        Ok(Some(Self {
            emulator,
            base,
            max_range,
        }))
    }
}
