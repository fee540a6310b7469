//! Devices on the command line, and the commands that are about them alone.

use std::path::PathBuf;

use clap::Args;

use super::triple;
use crate::uri::{Base, Camera, Sonar, Turret, Uri};

/// The devices of a robot.
#[derive(Debug, Args)]
pub struct DeviceArgs {
    /// Base: sim:, create2:PORT, kobuki:PORT, arduino:PORT?track=0.2&counts_per_metre=5000; ?max_speed=0.5 [m/s].
    #[arg(long, value_name = "URI", default_value = "sim:")]
    pub base: Uri<Base>,
    /// Sonar: sim:, maxbotix:PORT?model=hrlv, ff:PORT, urm37:PORT, us100:PORT, srf02:PORT; ?mount=X,Y,YAW [m, rad].
    #[arg(long, value_name = "URI", default_value = "sim:")]
    pub sonar: Uri<Sonar>,
    /// What turns the sonar: none, maestro:PORT?channel=0&centre_deg=90&sign=1, urm37?centre_deg=138&sign=1.
    /// Without a word, sim: and urm37 turn by themselves, others not at all.
    #[arg(long, value_name = "URI")]
    pub turret: Option<Uri<Turret>>,
    /// Camera: none, sim:, v4l2:/dev/video0?size=640x480, mjpeg:PATH (file, FIFO or -).
    #[arg(long, value_name = "URI", default_value = "none")]
    pub camera: Uri<Camera>,
    /// Building of simulated devices: sketch, office, hall, a world file (.toml) or a ROS map (.yaml).
    #[arg(long, value_name = "W", default_value = "sketch")]
    pub world: String,
    /// Seed of all noise of simulated devices.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Where the simulated robot stands at first, map frame of the building [m, m, rad].
    #[arg(long, value_name = "X,Y,THETA", allow_hyphen_values = true, value_parser = triple)]
    pub robot_start: Option<[f64; 3]>,
    /// Let all devices answer from the log of a mission; `mobot replay` does.
    #[arg(long, value_name = "RUN.mcap", hide = true)]
    pub from_log: Option<PathBuf>,
}

/// `mobot devices`
#[derive(Debug, Args)]
pub struct DevicesArgs {
    /// Devices to ask, as in maxbotix:/dev/ttyUSB0; only these are written to. sim: asks a simulated robot's.
    #[arg(value_name = "URI")]
    pub uris: Vec<String>,
    /// A base to ask.
    #[arg(long, value_name = "URI")]
    pub base: Option<Uri<Base>>,
    /// A sonar to ask.
    #[arg(long, value_name = "URI")]
    pub sonar: Option<Uri<Sonar>>,
    /// What turns a sonar, to ask.
    #[arg(long, value_name = "URI")]
    pub turret: Option<Uri<Turret>>,
    /// A camera to ask.
    #[arg(long, value_name = "URI")]
    pub camera: Option<Uri<Camera>>,
}

/// `mobot emulate`
#[derive(Debug, Args)]
#[command(after_help = EMULATE_CONTROL)]
pub struct EmulateArgs {
    /// Devices, all of one robot: create2, kobuki, arduino, maxbotix (?model=hrlv), ff, urm37, us100, srf02
    /// (?address=3), maestro.
    #[arg(value_name = "KIND", required = true)]
    pub kinds: Vec<String>,
    /// Building: sketch, office, hall, a world file (.toml) or a ROS map (.yaml).
    #[arg(long, value_name = "W", default_value = "sketch")]
    pub world: String,
    /// Seed of all noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Where the robot starts, map frame [m, m, rad]; otherwise where the world says, in a map where most room is.
    #[arg(long, value_name = "X,Y,THETA", allow_hyphen_values = true, value_parser = triple)]
    pub start: Option<[f64; 3]>,
    /// Folder for the links to the terminals, named after the kinds; otherwise one for temporary files.
    #[arg(long, value_name = "DIR")]
    pub links: Option<PathBuf>,
    /// Log of the wheel commands in force, of the faults, and of the true pose ten times a second: JSON lines,
    /// stamped with the monotonic clock [s].
    #[arg(long, value_name = "FILE")]
    pub log: Option<PathBuf>,
}

/// What can be done to emulated devices while they run.
const EMULATE_CONTROL: &str = "\
Each line on stdin changes something at once; a JSON line on stderr answers.
  DEVICE drop P, double P, flip P  bytes lost, sent twice, a bit turned; 0 to 1
  DEVICE silence on|off            nothing comes through, either way
  DEVICE delay S                   bytes come S seconds late
  DEVICE unplug, plug              terminal gone; a new one under the same link
  DEVICE stuck on|off|left|right   sonar repeats itself; servo, encoders stand
  DEVICE slow F                    fires and answers F times more slowly
  DEVICE ok                        no faults
  robot cliff on|off, lift on|off  the floor ends; the wheels hang in the air
  robot slip L,R                   share of its way that each wheel loses
  robot kidnap X,Y,THETA           put down elsewhere
  robot truth                      true pose, collisions, least clearance, way
DEVICE is a kind, the second of a kind KIND-2, or all.";
