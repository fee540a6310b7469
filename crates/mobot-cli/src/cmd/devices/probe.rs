//! Asks a device who it is, how fast it tells, and for a reading.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use mobot_hw::SystemClock;
use mobot_hw::serial::Maestro;
use mobot_hw::sim::{RobotParams, Simulation};
use mobot_hw::wrap::Fault;
use occgrid::Reading;
use serde::Serialize;

use crate::uri::{
    self, Base, BoxedBase, BoxedCamera, BoxedSonar, Camera, Sonar, SonarKind, Tapes, Turret, Uri,
    UriError,
};

/// A device as it was found.
#[derive(Debug, Serialize)]
pub(super) struct Found {
    pub(super) uri: String,
    pub(super) kind: &'static str,
    pub(super) identity: String,
    pub(super) ok: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) rate_hz: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) reading: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) error: Option<String>,
}

/// A live answer: its rate where it has one, and what it says.
type Live = (Option<f64>, String);

/// A device to probe.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Named {
    Base(Uri<Base>),
    Sonar(Uri<Sonar>),
    Turret(Uri<Turret>),
    Camera(Uri<Camera>),
}

/// Devices are asked for readings for this long at most.
const WATCHED: Duration = Duration::from_secs(1);
/// Most readings that are asked for.
const MOST: u32 = 100;

impl Named {
    /// A device by its scheme alone. `sim:` is three devices.
    pub(super) fn read(text: &str) -> Result<Vec<Self>, UriError> {
        if text == "sim:" {
            return Ok(vec![
                Self::Base(text.parse()?),
                Self::Sonar(text.parse()?),
                Self::Camera(text.parse()?),
            ]);
        }
        let scheme = text.split([':', '?']).next().unwrap_or_default();
        Ok(vec![match scheme {
            "create2" | "kobuki" | "arduino" => Self::Base(text.parse()?),
            "maxbotix" | "ff" | "urm37" | "us100" | "srf02" => Self::Sonar(text.parse()?),
            "maestro" => Self::Turret(text.parse()?),
            "v4l2" | "mjpeg" => Self::Camera(text.parse()?),
            _ => {
                return Err(UriError::Scheme {
                    expected: "create2:PORT, kobuki:PORT, arduino:PORT, maxbotix:PORT, ff:PORT, urm37:PORT, us100:PORT, srf02:PORT, maestro:PORT, v4l2:DEVICE, mjpeg:PATH or sim:",
                    found: text.to_owned(),
                });
            }
        }])
    }

    /// What was typed.
    pub(super) fn text(&self) -> &str {
        match self {
            Self::Base(uri) => &uri.text,
            Self::Sonar(uri) => &uri.text,
            Self::Turret(uri) => &uri.text,
            Self::Camera(uri) => &uri.text,
        }
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Base(_) => "base",
            Self::Sonar(_) => "sonar",
            Self::Turret(_) => "turret",
            Self::Camera(_) => "camera",
        }
    }

    /// Asks it. Commands that move nothing but a sonar's own servo.
    pub(super) fn probe(&self) -> Found {
        let live = self.ask();
        let ok = live.is_ok();
        let (live, error) = match live {
            Ok((rate, reading)) => ((rate, Some(reading)), None),
            Err(error) => ((None, None), Some(format!("{error:#}"))),
        };
        Found {
            uri: self.text().to_owned(),
            kind: self.kind(),
            identity: self.identity().to_owned(),
            ok,
            rate_hz: live.0,
            reading: live.1,
            error,
        }
    }

    fn ask(&self) -> anyhow::Result<Live> {
        let clock = SystemClock::start();
        let robot = self.simulated()?;
        let robot = robot.as_ref();
        let mobot = std::env::current_exe()?;
        let tapes = &mut Tapes::default();
        match self {
            Self::Base(uri) => base(&mut uri::open_base(uri, robot, clock, &mobot, tapes)?),
            Self::Sonar(uri) => sonar(&mut uri::open_sonar(uri, None, robot, clock, tapes)?),
            Self::Turret(uri) => turret(uri, clock),
            Self::Camera(uri) => {
                let mut opened =
                    uri::open_camera(uri, robot, clock, tapes)?.context("there is none")?;
                camera(&mut opened, &uri.device)
            }
        }
    }

    /// The robot of a simulated device.
    fn simulated(&self) -> anyhow::Result<Option<Simulation>> {
        let simulated = match self {
            Self::Base(uri) => uri.device == Base::Sim,
            Self::Sonar(uri) => uri.device.kind == SonarKind::Sim,
            Self::Turret(uri) => uri.device == Turret::Sim,
            Self::Camera(uri) => uri.device == Camera::Sim,
        };
        if !simulated {
            return Ok(None);
        }
        let world = crate::world::load("sketch", None)?;
        Ok(Some(Simulation::new(world, RobotParams::default(), 1)?))
    }
}

fn base(base: &mut BoxedBase) -> anyhow::Result<Live> {
    let (rate, status) = watch(|| base.status().map(|status| (status.stamp, status)))?;
    let travel = status.travel;
    let mut reading = format!("wheels {:.4} m, {:.4} m", travel.left, travel.right);
    for (pressed, what) in [
        (status.bump_left, "bumped left"),
        (status.bump_right, "bumped right"),
        (status.cliff, "cliff"),
        (status.wheel_drop, "wheel drop"),
    ] {
        if pressed {
            reading += ", ";
            reading += what;
        }
    }
    Ok((rate, reading))
}

fn sonar(sonar: &mut BoxedSonar) -> anyhow::Result<Live> {
    let reach = sonar.bearings();
    let ahead = 0.0_f64.clamp(reach.from, reach.to);
    let (rate, ping) = watch(|| sonar.ping(ahead).map(|ping| (ping.stamp, ping)))?;
    let reading = match ping.reading {
        Reading::Echo { range } => format!("echo from {range:.3} m"),
        Reading::NoEcho { listened } => format!("no echo within {listened:.3} m"),
        Reading::TooClose => "something too close to measure".to_owned(),
        Reading::Fault => "readings that do not agree".to_owned(),
    };
    let degrees = ping.bearing.to_degrees();
    Ok((rate, format!("{reading} at {degrees:.0} deg")))
}

fn camera(camera: &mut BoxedCamera, device: &Camera) -> anyhow::Result<Live> {
    let is_file = matches!(device, Camera::Mjpeg { path } if Path::new(path).is_file());
    let (rate, frame) = if is_file {
        // no rate, and it may end with its first frame
        (None, camera.frame()?)
    } else {
        watch(|| camera.frame().map(|frame| (frame.stamp, frame)))?
    };
    let image = &frame.image;
    let sum: u64 = image.as_raw().iter().map(|level| u64::from(*level)).sum();
    let mean = sum as f64 / image.as_raw().len().max(1) as f64;
    let (width, height) = image.dimensions();
    Ok((
        rate,
        format!("{width} x {height} px, mean level {mean:.0} of 255"),
    ))
}

/// Where a servo says it stands; it is not moved.
fn turret(uri: &Uri<Turret>, clock: SystemClock) -> anyhow::Result<Live> {
    let Turret::Maestro { line, params } = &uri.device else {
        bail!("expected a maestro");
    };
    let port = mobot_hw::serial::open(&line.port, line.baud, false)?;
    let bearing = Maestro::new(port, clock, *params).commanded()?;
    let reading = bearing.map_or_else(
        || "no pulses: not told where to stand yet".to_owned(),
        |bearing| format!("stands at {:.0} deg", bearing.to_degrees()),
    );
    Ok((None, reading))
}

/// Readings with their stamps, for a while; the rate by the stamps, and the last one.
fn watch<T>(mut read: impl FnMut() -> Result<(f64, T), Fault>) -> anyhow::Result<(Option<f64>, T)> {
    // the first one may take its time: a servo turns, a base begins to tell
    let (first, mut newest) = read()?;
    let began = Instant::now();
    let mut last = first;
    let mut count = 0;
    while began.elapsed() < WATCHED && count < MOST {
        let (stamp, reading) = read()?;
        if stamp > last {
            count += 1;
        }
        (last, newest) = (stamp, reading);
    }
    let rate = (count > 0).then(|| f64::from(count) / (last - first));
    Ok((rate, newest))
}
