//! From device URIs to devices behind the traits.

use anyhow::{Context as _, bail};
use mobot_hw::guard::{BaseKind, GuardedBase};
use mobot_hw::serial::{
    FfParams, FfSonar, Maestro, MaxBotix, Port, Srf02, Srf02Params, Urm37, Urm37Params, Us100,
    Us100Params,
};
use mobot_hw::sim::{RobotParams, Simulation};
use mobot_hw::{PanActuator, SystemClock};
use occgrid::SonarModel;

use super::again::open_again;
use super::boxed::{BoxedBase, BoxedCamera, BoxedClock, BoxedSonar, Mounted, Plain};
use super::{Base, Camera, SerialLine, Sonar, SonarKind, Turret, Uri};
use crate::args::DeviceArgs;
use crate::nav::Devices;
use crate::run_log::Again;

/// A robot that is ready.
pub struct Opened {
    /// What it is driven with. Where its sonar has one bearing alone, it has to turn on the spot to look around.
    pub devices: Devices<BoxedBase, BoxedSonar, BoxedCamera, BoxedClock>,
    /// The sonar as a map sees it: its mount, its nearest and farthest echo.
    pub sensor: SonarModel,
    /// The simulated robot, where they are its devices: for its truth, which is for scoring alone.
    pub simulation: Option<Simulation>,
    /// The log that the devices answer from, where they do.
    pub again: Option<Again>,
}

/// Opens devices.
///
/// # Errors
/// Where they do not go together, or one cannot be opened; the message names it.
pub fn open(args: &DeviceArgs) -> anyhow::Result<Opened> {
    if let Some(log) = &args.from_log {
        return open_again(args, log);
    }
    let simulation = simulation(args)?;
    let clock = SystemClock::start();
    // the base last: once it is open, nothing but driving takes time
    let sonar = open_sonar(
        &args.sonar,
        args.turret.as_ref(),
        simulation.as_ref(),
        clock,
    )?;
    let camera = open_camera(&args.camera, simulation.as_ref())?;
    let base = open_base(&args.base, simulation.as_ref(), clock)?;
    let clock: BoxedClock = match &simulation {
        Some(robot) => Box::new(robot.clock()),
        None => Box::new(clock),
    };
    Ok(Opened {
        devices: Devices {
            base,
            sonar,
            camera,
            clock,
        },
        sensor: args.sonar.device.sensor(),
        simulation,
        again: None,
    })
}

/// The simulated robot, where all devices are its. Simulated and real ones do not go together.
fn simulation(args: &DeviceArgs) -> anyhow::Result<Option<Simulation>> {
    let base = match args.base.device {
        Base::Sim => Some(true),
        Base::Replay(_) => None,
        _ => Some(false),
    };
    let sonar = match args.sonar.device.kind {
        SonarKind::Sim => Some(true),
        SonarKind::Replay(_) => None,
        _ => Some(false),
    };
    let turret = args.turret.as_ref().and_then(|t| match t.device {
        Turret::Sim => Some(true),
        Turret::None => None,
        Turret::Maestro { .. } | Turret::Urm37 { .. } => Some(false),
    });
    let camera = match args.camera.device {
        Camera::Sim => Some(true),
        Camera::None | Camera::Replay(_) => None,
        Camera::V4l2 { .. } | Camera::Mjpeg { .. } => Some(false),
    };
    let devices = [
        ("--base", &args.base.text, base),
        ("--sonar", &args.sonar.text, sonar),
        (
            "--turret",
            args.turret.as_ref().map_or(&args.sonar.text, |t| &t.text),
            turret,
        ),
        ("--camera", &args.camera.text, camera),
    ];
    let first = |simulated| devices.iter().find(|d| d.2 == Some(simulated));
    if let (Some(sim), Some(real)) = (first(true), first(false)) {
        bail!(
            "expected either simulated devices or real ones, found {} {} and {} {}",
            sim.0,
            sim.1,
            real.0,
            real.1
        );
    }
    if first(true).is_none() {
        return Ok(None);
    }
    let world = crate::world::load(&args.world, args.robot_start)?;
    let params = RobotParams {
        base_from_sonar: args.sonar.device.mount,
        ..RobotParams::default()
    };
    Ok(Some(Simulation::new(world, params, args.seed)?))
}

/// A port with the device's name before what goes wrong with it.
fn port(line: &SerialLine, two_stop_bits: bool) -> anyhow::Result<Port> {
    Ok(mobot_hw::serial::open(
        &line.port,
        line.baud,
        two_stop_bits,
    )?)
}

/// Opens a base.
pub(crate) fn open_base(
    uri: &Uri<Base>,
    robot: Option<&Simulation>,
    clock: SystemClock,
) -> anyhow::Result<BoxedBase> {
    let open = || -> anyhow::Result<BoxedBase> {
        Ok(match (&uri.device, robot) {
            (Base::Sim, Some(robot)) => Box::new(Plain(robot.base())),
            (Base::Sim, None) => bail!("there is no simulated robot here"),
            (Base::Create2 { line, params }, _) => {
                guarded(line, &BaseKind::Create2(*params), clock)?
            }
            (Base::Kobuki { line, params }, _) => guarded(line, &BaseKind::Kobuki(*params), clock)?,
            (Base::Arduino { line, params }, _) => {
                guarded(line, &BaseKind::Arduino(*params), clock)?
            }
            (Base::Replay(_), _) => bail!("recordings cannot be opened here"),
        })
    };
    open().with_context(|| uri.text.clone())
}

/// Has a process of its own drive a base, which stops it whatever becomes of this one.
fn guarded(line: &SerialLine, base: &BaseKind, clock: SystemClock) -> anyhow::Result<BoxedBase> {
    let mobot = std::env::current_exe()?;
    let base = GuardedBase::spawn(&mobot, &line.port, line.baud, base, clock)?;
    Ok(Box::new(Plain(base)))
}

/// Opens a sonar on what turns it. Without a word about that, a simulated one and a URM37 turn by themselves,
/// others do not.
pub(crate) fn open_sonar(
    uri: &Uri<Sonar>,
    turret: Option<&Uri<Turret>>,
    robot: Option<&Simulation>,
    clock: SystemClock,
) -> anyhow::Result<BoxedSonar> {
    let device = turret.map(|uri| &uri.device);
    range_finder(&uri.device, device, robot, clock).with_context(|| match turret {
        Some(turret) => format!("{uri} on {turret}"),
        None => uri.text.clone(),
    })
}

fn range_finder(
    Sonar { mount, kind }: &Sonar,
    turret: Option<&Turret>,
    robot: Option<&Simulation>,
    clock: SystemClock,
) -> anyhow::Result<BoxedSonar> {
    let yaw = mount.theta;
    match (kind, turret, robot) {
        (SonarKind::Sim, None | Some(Turret::Sim), Some(robot)) => {
            Ok(Box::new(Mounted::at(yaw, Plain(robot.turret()))))
        }
        (SonarKind::Sim, Some(Turret::None), Some(robot)) => {
            Ok(Box::new(Mounted::at(yaw, Plain(robot.sonar()))))
        }
        (SonarKind::Sim, Some(_), Some(_)) => {
            bail!("expected --turret none or sim: with a simulated sonar")
        }
        (SonarKind::Sim, _, None) => bail!("there is no simulated robot here"),
        (SonarKind::Replay(_), ..) => bail!("recordings cannot be opened here"),
        (SonarKind::Urm37 { line }, None, _) => {
            let sonar = Urm37::new(port(line, false)?, clock, Urm37Params::default());
            Ok(Box::new(Mounted::at(yaw, Plain(sonar))))
        }
        (SonarKind::Urm37 { line }, Some(Turret::Urm37 { params }), _) => {
            let sonar = Urm37::new(port(line, false)?, clock, *params);
            Ok(Box::new(Mounted::at(yaw, Plain(sonar))))
        }
        (SonarKind::Urm37 { line }, Some(Turret::None), _) => {
            let sonar = Urm37::new(port(line, false)?, clock, Urm37Params::default());
            Ok(Box::new(Mounted::fixed(yaw, Plain(sonar))))
        }
        (_, Some(Turret::Urm37 { .. }), _) => {
            bail!("expected a urm37 sonar, the only one with a servo of its own")
        }
        (_, Some(Turret::Sim), _) => bail!("expected a simulated sonar with --turret sim:"),
        (kind, turned, _) => {
            let sonar = fixed(kind, clock)?;
            let Some(Turret::Maestro { line, params }) = turned else {
                return Ok(Box::new(Mounted::fixed(yaw, sonar)));
            };
            let pan = Maestro::new(port(line, false)?, clock, *params);
            Ok(turned_by(yaw, sonar, pan))
        }
    }
}

fn turned_by<P>(yaw: f64, sonar: BoxedSonar, pan: P) -> BoxedSonar
where
    P: PanActuator + Send + 'static,
{
    let turret = mobot_hw::Turret {
        sonar,
        pan: Plain(pan),
    };
    Box::new(Mounted::at(yaw, Plain(turret)))
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

/// Opens a camera.
pub(crate) fn open_camera(
    uri: &Uri<Camera>,
    robot: Option<&Simulation>,
) -> anyhow::Result<Option<BoxedCamera>> {
    let open = || -> anyhow::Result<Option<BoxedCamera>> {
        Ok(match (&uri.device, robot) {
            (Camera::None, _) => None,
            (Camera::Sim, Some(robot)) => Some(Box::new(Plain(robot.camera()))),
            (Camera::Sim, None) => bail!("there is no simulated robot here"),
            (Camera::V4l2 { .. } | Camera::Mjpeg { .. }, _) => {
                bail!("real cameras cannot be opened here")
            }
            (Camera::Replay(_), _) => bail!("recordings cannot be opened here"),
        })
    };
    open().with_context(|| uri.text.clone())
}
