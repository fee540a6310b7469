//! The mission on the command line.

use std::path::PathBuf;

use clap::Args;

use super::{DeviceArgs, triple};

/// `mobot drive`
#[derive(Debug, Args)]
pub struct DriveArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "flattened: its fields are documented")]
    pub devices: DeviceArgs,
    /// Map: ROS / Nav2 map_server YAML.
    #[arg(long, value_name = "MAP.yaml")]
    pub map: PathBuf,
    /// Goal in the map frame, and the heading to end with [m, m, rad].
    #[arg(long, value_name = "X,Y[,THETA]", allow_hyphen_values = true, value_parser = goal)]
    pub to: Goal,
    /// Where the robot stands, map frame [m, m, rad]; maps of an exploration begin at 0,0,0.
    #[arg(long, value_name = "X,Y,THETA", allow_hyphen_values = true, default_value = "0,0,0", value_parser = triple)]
    pub start: [f64; 3],
    /// Floor plan to correct the pose by (.geojson); without it, one is derived from the map.
    #[arg(long, value_name = "PLAN.geojson")]
    pub plan: Option<PathBuf>,
    /// The camera, as `mobot calibrate` writes it; not needed for a simulated one.
    #[arg(long, value_name = "CAMERA.json")]
    pub camera_file: Option<PathBuf>,
    /// Radius of the robot [m].
    #[arg(long, value_name = "R", default_value_t = 0.175)]
    pub radius: f64,
    /// The goal is given up after this time [s].
    #[arg(long, value_name = "SECONDS", default_value_t = 3600.0)]
    pub budget: f64,
    /// Folder for what is left of the run: summary.json, events.jsonl and the run log run.mcap.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// A goal as it is typed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// [m]
    pub place: [f64; 2],
    /// [rad]
    pub heading: Option<f64>,
}

/// `X,Y` or `X,Y,THETA`, all finite.
fn goal(text: &str) -> Result<Goal, String> {
    if let Ok(place) = super::point(text) {
        return Ok(Goal {
            place,
            heading: None,
        });
    }
    let [x, y, theta] = super::numbers(text, "X,Y or X,Y,THETA")?;
    Ok(Goal {
        place: [x, y],
        heading: Some(theta),
    })
}
