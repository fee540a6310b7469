//! The kinds of devices that can be emulated.

use mobot_hw::emulate::{
    ArduinoEmulator, Create2Emulator, Emulator, FfEmulator, KobukiEmulator, MaestroEmulator,
    MaxBotixEmulator, Srf02Emulator, Urm37Emulator, Us100Emulator,
};
use mobot_hw::serial::{create2, kobuki};
use mobot_hw::sim::BaseParams;

use crate::uri::{self, Parts, Role, UriError};

/// A device to emulate, with the base that it makes of the robot where it is one.
pub(super) struct Kind {
    pub(super) emulator: Box<dyn Emulator>,
    pub(super) base: Option<BaseParams>,
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
        let mut base = None;
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
                Box::new(ArduinoEmulator::new(params))
            }
            "maxbotix" => Box::new(MaxBotixEmulator::new(uri::model(options)?)),
            "ff" => Box::new(FfEmulator::default()),
            "urm37" => Box::new(Urm37Emulator::default()),
            "us100" => Box::new(Us100Emulator::default()),
            "srf02" => Box::new(Srf02Emulator::at(uri::address(options)?)),
            "maestro" => Box::new(MaestroEmulator::default()),
            _ => return Ok(None),
        };
        Ok(Some(Self { emulator, base }))
    }
}
