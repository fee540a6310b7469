//! Faults while it runs: one command a line, `DEVICE FAULT VALUE` or `robot WHAT VALUE`.

use mobot_hw::emulate::{DeviceFaults, Emulation, LineFaults, Stuck};
use mobot_hw::sim::Simulation;
use occgrid::Pose2;
use serde::Serialize;

/// What was done, or why not, in answer to one line.
#[derive(Debug, Serialize)]
pub(super) struct Reply {
    pub(super) ok: bool,
    line: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    #[serde(flatten)]
    truth: Option<TruthLine>,
}

/// The true state of the robot.
#[derive(Debug, Serialize)]
pub(super) struct TruthLine {
    /// x, y [m], heading [rad], map frame.
    pose: [f64; 3],
    collisions: u64,
    min_clearance_m: f64,
    driven_m: f64,
}

impl TruthLine {
    pub(super) fn of(robot: &Simulation) -> Self {
        let truth = robot.truth();
        let Pose2 { x, y, theta } = truth.map_from_base;
        Self {
            pose: [x, y, theta],
            collisions: truth.collisions,
            min_clearance_m: truth.least_clearance,
            driven_m: truth.driven,
        }
    }
}

/// The faults that are in force, and what they are in force at.
pub(super) struct Control<'a> {
    pub(super) robot: &'a Simulation,
    pub(super) emulation: &'a Emulation,
    /// Names of the devices, in the emulation's order.
    pub(super) names: &'a [String],
    pub(super) faults: Vec<(LineFaults, DeviceFaults)>,
}

impl Control<'_> {
    /// Does what a line says.
    pub(super) fn obey(&mut self, line: &str) -> Reply {
        let words: Vec<&str> = line.split_whitespace().collect();
        let result = match words[..] {
            ["robot", "truth"] => Ok(Some(TruthLine::of(self.robot))),
            ["robot", what, value] => robot(self.robot, what, value).map(|()| None),
            [device, ref fault @ ..] if device != "robot" => {
                self.device(device, fault).map(|()| None)
            }
            _ => Err("expected robot truth, slip, kidnap, cliff or lift, and a value".to_owned()),
        };
        let (ok, error, truth) = match result {
            Ok(truth) => (true, None, truth),
            Err(error) => (false, Some(error), None),
        };
        Reply {
            ok,
            line: line.trim().to_owned(),
            error,
            truth,
        }
    }

    fn device(&mut self, device: &str, fault: &[&str]) -> Result<(), String> {
        let meant: Vec<usize> = (0..self.names.len())
            .filter(|k| device == "all" || self.names[*k] == device)
            .collect();
        if meant.is_empty() {
            let names = self.names.join(", ");
            return Err(format!("expected {names}, all or robot, found {device:?}"));
        }
        let mut changed = self.faults.clone();
        for device in &meant {
            change(&mut changed[*device], fault)?;
        }
        self.faults = changed;
        for device in meant {
            let (line, inner) = self.faults[device];
            self.emulation.set_faults(device, line);
            self.emulation.set_device_faults(device, inner);
        }
        Ok(())
    }
}

/// Changes the faults of one device.
fn change((line, device): &mut (LineFaults, DeviceFaults), fault: &[&str]) -> Result<(), String> {
    match *fault {
        ["ok"] => (*line, *device) = Default::default(),
        ["unplug"] => line.unplugged = true,
        ["plug"] => line.unplugged = false,
        ["silence", on] => line.silent = switch(on)?,
        ["drop", share] => line.dropped = number(share, [0.0, 1.0])?,
        ["double", share] => line.doubled = number(share, [0.0, 1.0])?,
        ["flip", share] => line.flipped = number(share, [0.0, 1.0])?,
        ["delay", seconds] => line.delay = number(seconds, [0.0, 60.0])?,
        ["slow", factor] => device.slow = number(factor, [1.0, 1000.0])?,
        ["stuck", what] => {
            device.stuck = match what {
                "on" => Stuck::All,
                "left" => Stuck::Left,
                "right" => Stuck::Right,
                "off" => Stuck::Nothing,
                _ => return Err(format!("expected on, off, left or right, found {what:?}")),
            }
        }
        _ => {
            let found = fault.join(" ");
            return Err(format!(
                "expected ok, unplug, plug, silence, drop, double, flip, delay, slow or stuck, and a value, found {found:?}"
            ));
        }
    }
    Ok(())
}

/// Does something to the robot.
fn robot(robot: &Simulation, what: &str, value: &str) -> Result<(), String> {
    match what {
        "cliff" => robot.set_cliff(switch(value)?),
        "lift" => robot.set_lifted(switch(value)?),
        "slip" => robot.set_slip(numbers(value, [-1.0, 1.0])?),
        "kidnap" => {
            let [x, y, theta] = numbers(value, [-1e6, 1e6])?;
            robot.kidnap(Pose2::new(x, y, theta));
        }
        _ => {
            return Err(format!(
                "expected truth, slip, kidnap, cliff or lift, found {what:?}"
            ));
        }
    }
    Ok(())
}

fn switch(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err(format!("expected on or off, found {text:?}")),
    }
}

fn number(text: &str, bounds: [f64; 2]) -> Result<f64, String> {
    let [number] = numbers(text, bounds)?;
    Ok(number)
}

fn numbers<const N: usize>(text: &str, [least, most]: [f64; 2]) -> Result<[f64; N], String> {
    let read: Vec<f64> = text
        .split(',')
        .flat_map(str::parse)
        .filter(|n| (least..=most).contains(n))
        .collect();
    let whole = read.len() == text.split(',').count();
    let expected = || format!("expected {N} of {least} to {most}, found {text:?}");
    let found: [f64; N] = read.try_into().map_err(|_| expected())?;
    if whole { Ok(found) } else { Err(expected()) }
}
