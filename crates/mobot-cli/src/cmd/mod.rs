//! One file a subcommand: each turns what was typed into a job, does it, and answers.

mod birdseye;
mod calibrate;
mod check;
mod clean;
mod demo;
mod devices;
mod drive;
mod emulate;
mod explore;
mod floor;
mod floorplan;
mod graph;
mod guard;
mod lines;
mod locate;
mod map;
mod plan;
mod replay;
mod scratch;
mod sensor;
mod target_sheet;
mod why;

use std::path::Path;

use anyhow::{Context as _, bail};
use occgrid::{LoadOptions, LoadedMap, OccupancyMap, ThresholdRule, load_map};

use crate::args::{Cli, Command, MapInput};
use crate::output::{Outcome, Output};

/// Does what was typed.
///
/// # Errors
/// For input that cannot be used and output that cannot be written; the message is one line.
pub fn run(cli: Cli) -> anyhow::Result<Outcome> {
    let output = Output::new(cli.json, cli.quiet);
    dispatch(cli.command, output)
}

fn dispatch(command: Command, output: Output) -> anyhow::Result<Outcome> {
    match command {
        Command::Map(args) => map::run(&args, &output),
        Command::Clean(args) => clean::run(&args, &output),
        Command::Graph(args) => graph::run(&args, &output),
        Command::Check(args) => check::run(&args, &output),
        Command::Plan(args) => plan::run(&args, &output),
        Command::Floorplan(args) => floorplan::run(&args, &output),
        Command::Lines(args) => lines::run(&args, &output),
        Command::Locate(args) => locate::run(&args, &output),
        Command::Why(args) => why::run(&args, &output),
        Command::Calibrate(args) => calibrate::run(&args, &output),
        Command::Floor(args) => floor::run(&args, &output),
        Command::Birdseye(args) => birdseye::run(&args, &output),
        Command::Explore(args) => explore::run(&args, &output),
        Command::Devices(args) => devices::run(&args, &output),
        Command::Emulate(args) => emulate::run(&args, &output),
        Command::Demo(args) => demo::run(&args, &output),
        Command::Drive(args) => drive::run(&args, &output),
        Command::Replay(args) => replay::run(&args, &output),
        Command::Guard(args) => guard::run(args),
    }
}

/// Reads the map that a command was given.
fn load(input: &MapInput, output: &Output) -> anyhow::Result<OccupancyMap> {
    Ok(load_with(input, output, false)?.map)
}

/// Reads the map that a command was given, with its log-odds where they are wanted and there.
fn load_with(input: &MapInput, output: &Output, log_odds: bool) -> anyhow::Result<LoadedMap> {
    output.stage(format!("reading {}", input.map.display()));
    let options = LoadOptions {
        allow_outside: input.allow_outside,
        log_odds,
        threshold_rule: if input.ros1 {
            ThresholdRule::Ros1
        } else {
            ThresholdRule::Nav2
        },
        ..LoadOptions::default()
    };
    Ok(load_map(&input.map, &options)?)
}

/// A radius that a robot can have [m].
fn checked_radius(radius: f64) -> anyhow::Result<f64> {
    if !(radius.is_finite() && radius >= 0.0) {
        bail!("--radius: expected a length of 0 m or more, found {radius}");
    }
    Ok(radius)
}

/// Refuses an unusable picture name before any work is done.
fn checked_picture(path: Option<&Path>) -> anyhow::Result<()> {
    path.map_or(Ok(()), |path| crate::picture::format_of(path).map(drop))
}

/// Reads a small text file, refusing one that is too large to be what it should be.
pub(crate) fn read_text(path: &Path, most_bytes: u64) -> anyhow::Result<String> {
    let name = path.display();
    let meta = std::fs::metadata(path).with_context(|| format!("{name}"))?;
    if !meta.is_file() {
        bail!("{name}: expected a file, found something else");
    }
    if meta.len() > most_bytes {
        bail!(
            "{name}: expected at most {most_bytes} bytes, found {}",
            meta.len()
        );
    }
    std::fs::read_to_string(path).with_context(|| format!("{name}"))
}
