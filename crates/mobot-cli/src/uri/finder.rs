//! Opens sonars on what turns them.

use anyhow::{Context as _, bail};
use mobot_hw::serial::{
    FfParams, FfSonar, Maestro, MaxBotix, Port, Srf02, Srf02Params, Urm37, Urm37Params, Us100,
    Us100Params,
};
use mobot_hw::sim::Simulation;
use mobot_hw::wrap::Device;
use mobot_hw::{SystemClock, Turret as Turned};

use super::boxed::{BoxedPan, BoxedSonar, Mounted, Plain};
use super::tapes::{Tapes, replayed};
use super::{SerialLine, Sonar, SonarKind, Turret, Uri};

/// Opens a sonar on what turns it. Without a word about that, a simulated one and a URM37 turn by themselves,
/// others do not; a recorded one turns as it did.
pub(crate) fn open_sonar(
    uri: &Uri<Sonar>,
    turret: Option<&Uri<Turret>>,
    robot: Option<&Simulation>,
    clock: SystemClock,
    tapes: &mut Tapes,
) -> anyhow::Result<BoxedSonar> {
    let mut open = || match (turret, turret.map(|uri| &uri.device)) {
        (Some(uri_of_pan), Some(Turret::Maestro { line, params })) => {
            let maestro = Maestro::new(port(line, false)?, clock, *params);
            let pan: BoxedPan = Box::new(Plain(maestro));
            let pan = tapes.on(uri_of_pan, pan, |p| Box::new(p))?;
            let sonar = fixed(&uri.device.kind, clock)?;
            let turned = Plain(Turned { sonar, pan });
            Ok::<BoxedSonar, anyhow::Error>(Box::new(Mounted::at(uri.device.mount.theta, turned)))
        }
        (_, turret) => by_itself(&uri.device, turret, robot, clock),
    };
    let sonar = open().with_context(|| match turret {
        Some(turret) => format!("{uri} on {turret}"),
        None => uri.text.clone(),
    })?;
    tapes.on(uri, sonar, |s| Box::new(s))
}

/// A sonar that turns by itself or not at all.
fn by_itself(
    Sonar { mount, kind }: &Sonar,
    turret: Option<&Turret>,
    robot: Option<&Simulation>,
    clock: SystemClock,
) -> anyhow::Result<BoxedSonar> {
    let yaw = mount.theta;
    Ok(match (kind, turret) {
        (SonarKind::Sim, turret) => {
            let robot = robot.context("there is no simulated robot here")?;
            match turret {
                None | Some(Turret::Sim) => Box::new(Mounted::at(yaw, Plain(robot.turret()))),
                _ => Box::new(Mounted::fixed(yaw, Plain(robot.sonar()))),
            }
        }
        (SonarKind::Replay(file), _) => Box::new(Plain(replayed(file, Device::RangeFinder)?)),
        (SonarKind::Urm37 { line }, None) => {
            let sonar = Urm37::new(port(line, false)?, clock, Urm37Params::default());
            Box::new(Mounted::at(yaw, Plain(sonar)))
        }
        (SonarKind::Urm37 { line }, Some(Turret::Urm37 { params })) => {
            let sonar = Urm37::new(port(line, false)?, clock, *params);
            Box::new(Mounted::at(yaw, Plain(sonar)))
        }
        (_, Some(Turret::Urm37 { .. })) => {
            bail!("expected a urm37 sonar, the only one with a servo of its own")
        }
        (kind, _) => Box::new(Mounted::fixed(yaw, fixed(kind, clock)?)),
    })
}

/// A sonar that looks along its own axis.
fn fixed(kind: &SonarKind, clock: SystemClock) -> anyhow::Result<BoxedSonar> {
    Ok(match kind {
        SonarKind::MaxBotix { line, model } => {
            let params = Sonar::maxbotix_params(*model);
            Box::new(Plain(MaxBotix::new(port(line, false)?, clock, params)))
        }
        SonarKind::Ff { line, ask } => {
            let params = FfParams {
                ask: *ask,
                ..FfParams::default()
            };
            Box::new(Plain(FfSonar::new(port(line, false)?, clock, params)))
        }
        SonarKind::Us100 { line } => {
            let params = Us100Params::default();
            Box::new(Plain(Us100::new(port(line, false)?, clock, params)))
        }
        SonarKind::Srf02 { line, address } => {
            let params = Srf02Params {
                address: *address,
                ..Srf02Params::default()
            };
            Box::new(Plain(Srf02::new(port(line, true)?, clock, params)))
        }
        SonarKind::Urm37 { line } => {
            let params = Urm37Params::default();
            Box::new(Plain(Urm37::new(port(line, false)?, clock, params)))
        }
        SonarKind::Sim | SonarKind::Replay(_) => bail!("expected a sonar on a port"),
    })
}

/// A port with its name before what goes wrong with it.
fn port(line: &SerialLine, two_stop_bits: bool) -> anyhow::Result<Port> {
    Ok(mobot_hw::serial::open(
        &line.port,
        line.baud,
        two_stop_bits,
    )?)
}
