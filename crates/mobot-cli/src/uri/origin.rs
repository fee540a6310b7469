//! Which devices go together, and the simulated robot where they are its.

use anyhow::bail;
use mobot_hw::sim::{RobotParams, Simulation};

use super::{Base, Camera, SonarKind, Turret};
use crate::args::DeviceArgs;

/// Where a device comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    Simulated,
    Real,
    Recorded,
}

/// The simulated robot, where all devices are its. Simulated, real and recorded ones do not go together:
/// their times are on different clocks.
pub(super) fn simulation(args: &DeviceArgs) -> anyhow::Result<Option<Simulation>> {
    let devices = origins(args);
    let Some((name, text, origin)) = devices.first() else {
        return Ok(None);
    };
    if let Some((other, found, _)) = devices.iter().find(|d| d.2 != *origin) {
        bail!(
            "expected all devices simulated, all real or all recorded, found {name} {text} and {other} {found}"
        );
    }
    if *origin != Origin::Simulated {
        return Ok(None);
    }
    let world = crate::world::load(&args.world, args.robot_start)?;
    let params = RobotParams {
        base_from_sonar: args.sonar.device.mount,
        ..RobotParams::default()
    };
    Ok(Some(Simulation::new(world, params, args.seed)?))
}

/// The devices that come from anywhere, each with its flag and what was typed.
fn origins(args: &DeviceArgs) -> Vec<(&'static str, &str, Origin)> {
    let base = match args.base.device {
        Base::Sim => Origin::Simulated,
        Base::Replay(_) => Origin::Recorded,
        Base::Create2 { .. } | Base::Kobuki { .. } | Base::Arduino { .. } => Origin::Real,
    };
    let sonar = match args.sonar.device.kind {
        SonarKind::Sim => Origin::Simulated,
        SonarKind::Replay(_) => Origin::Recorded,
        _ => Origin::Real,
    };
    let turret = args.turret.as_ref().and_then(|uri| {
        let origin = match uri.device {
            Turret::None => return None,
            Turret::Sim => Origin::Simulated,
            Turret::Replay(_) => Origin::Recorded,
            Turret::Maestro { .. } | Turret::Urm37 { .. } => Origin::Real,
        };
        Some(("--turret", uri.text.as_str(), origin))
    });
    let camera = match args.camera.device {
        Camera::None => None,
        Camera::Sim => Some(Origin::Simulated),
        Camera::Replay(_) => Some(Origin::Recorded),
        _ => Some(Origin::Real),
    };
    let camera = camera.map(|origin| ("--camera", args.camera.text.as_str(), origin));
    [
        Some(("--base", args.base.text.as_str(), base)),
        Some(("--sonar", args.sonar.text.as_str(), sonar)),
        turret,
        camera,
    ]
    .into_iter()
    .flatten()
    .collect()
}
