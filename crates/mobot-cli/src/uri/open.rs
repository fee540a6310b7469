//! From device URIs to devices behind the traits.

use std::path::Path;

use anyhow::Context as _;
use mobot_hw::SystemClock;
use mobot_hw::guard::{BaseKind, GuardedBase};
use mobot_hw::sim::Simulation;
use mobot_hw::stream::{MjpegCamera, MjpegParams};
use mobot_hw::wrap::{Device, Recorded};
use occgrid::SonarModel;

use super::again::open_again;
use super::boxed::{BoxedBase, BoxedCamera, BoxedClock, BoxedSonar, Plain};
use super::finder::open_sonar;
use super::origin::simulation;
use super::tapes::{Tapes, replayed};
use super::{Base, Camera, SerialLine, Uri};
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

/// Opens devices, for the `mobot` command itself: it is its own guard, see [`open_guarded_by`].
///
/// # Errors
/// Where they do not go together, or one cannot be opened; the message names it.
pub fn open(args: &DeviceArgs) -> anyhow::Result<Opened> {
    open_guarded_by(&std::env::current_exe()?, args)
}

/// Opens devices. A real base's port belongs to a guard, a process of the executable `guard`: the `mobot`
/// command, see [`mobot_hw::guard`]. The clock is recorded with the first device that is.
///
/// # Errors
/// As [`open`].
pub fn open_guarded_by(guard: &Path, args: &DeviceArgs) -> anyhow::Result<Opened> {
    if let Some(log) = &args.from_log {
        return open_again(args, log);
    }
    let simulation = simulation(args)?;
    let robot = simulation.as_ref();
    let clock = SystemClock::start();
    let mut tapes = Tapes::default();
    // the base last: once it is open, nothing but driving takes time
    let sonar = open_sonar(&args.sonar, args.turret.as_ref(), robot, clock, &mut tapes)?;
    let camera = open_camera(&args.camera, robot, clock, &mut tapes)?;
    let base = open_base(&args.base, robot, clock, guard, &mut tapes)?;
    let clock: BoxedClock = match (robot, &args.base.device) {
        (Some(robot), _) => Box::new(robot.clock()),
        (None, Base::Replay(file)) => Box::new(replayed(file, Device::Clock)?),
        _ => Box::new(clock),
    };
    let clock = match tapes.first() {
        Some(tape) => Box::new(Recorded::new(clock, tape)),
        None => clock,
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

/// Opens a base. A real one belongs to a guard, a process of the executable `guard`.
pub(crate) fn open_base(
    uri: &Uri<Base>,
    robot: Option<&Simulation>,
    clock: SystemClock,
    guard: &Path,
    tapes: &mut Tapes,
) -> anyhow::Result<BoxedBase> {
    let guarded = |line: &SerialLine, kind| -> anyhow::Result<BoxedBase> {
        let base = GuardedBase::spawn(guard, &line.port, line.baud, &kind, clock)?;
        Ok(Box::new(Plain(base)))
    };
    let open = || -> anyhow::Result<BoxedBase> {
        Ok(match &uri.device {
            Base::Sim => {
                let robot = robot.context("there is no simulated robot here")?;
                Box::new(Plain(robot.base()))
            }
            Base::Create2 { line, params } => guarded(line, BaseKind::Create2(*params))?,
            Base::Kobuki { line, params } => guarded(line, BaseKind::Kobuki(*params))?,
            Base::Arduino { line, params } => guarded(line, BaseKind::Arduino(*params))?,
            Base::Replay(file) => Box::new(Plain(replayed(file, Device::Base)?)),
        })
    };
    let base = open().with_context(|| uri.text.clone())?;
    tapes.on(uri, base, |b| Box::new(b))
}

/// Opens a camera, where there is one.
pub(crate) fn open_camera(
    uri: &Uri<Camera>,
    robot: Option<&Simulation>,
    clock: SystemClock,
    tapes: &mut Tapes,
) -> anyhow::Result<Option<BoxedCamera>> {
    let open = || -> anyhow::Result<Option<BoxedCamera>> {
        Ok(Some(match &uri.device {
            Camera::None => return Ok(None),
            Camera::Sim => {
                let robot = robot.context("there is no simulated robot here")?;
                Box::new(Plain(robot.camera()))
            }
            Camera::Mjpeg { path } => Box::new(Plain(MjpegCamera::open(
                path,
                clock,
                MjpegParams::default(),
            )?)),
            #[cfg(target_os = "linux")]
            Camera::V4l2 { device, params } => {
                let camera = mobot_hw::v4l2::V4l2Camera::open(device, clock, *params)?;
                Box::new(Plain(camera))
            }
            Camera::Replay(file) => Box::new(Plain(replayed(file, Device::Camera)?)),
        }))
    };
    let Some(camera) = open().with_context(|| uri.text.clone())? else {
        return Ok(None);
    };
    Ok(Some(tapes.on(uri, camera, |c| Box::new(c))?))
}
