//! Devices that answer from the log of a mission.

use std::path::Path;

use anyhow::Context as _;

use super::boxed::{BoxedCamera, Plain};
use super::{Camera, Opened};
use crate::args::DeviceArgs;
use crate::nav::Devices;
use crate::run_log::Again;

/// The devices of a log, as many as were typed when it was written. None is opened.
pub(super) fn open_again(args: &DeviceArgs, log: &Path) -> anyhow::Result<Opened> {
    let again = Again::open(log).with_context(|| format!("{}", log.display()))?;
    let device = || Plain(again.replay.clone());
    let camera: Option<BoxedCamera> = match args.camera.device {
        Camera::None => None,
        _ => Some(Box::new(device())),
    };
    Ok(Opened {
        devices: Devices {
            base: Box::new(device()),
            sonar: Box::new(device()),
            camera,
            clock: Box::new(again.replay.clone()),
        },
        sensor: args.sonar.device.sensor(),
        simulation: None,
        again: Some(again),
    })
}
