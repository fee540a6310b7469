//! `mobot emulate`: the devices of one simulated robot on pseudo-terminals, in real time.

mod commands;
mod control;
mod journal;
mod kinds;

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context as _;
use mobot_hw::emulate::{Emulation, Emulator};
use mobot_hw::sim::{RobotParams, Simulation, SonarParams};
use serde::Serialize;

use crate::args::EmulateArgs;
use crate::interrupt::Interrupt;
use crate::output::{Outcome, Output};
use crate::uri::Uri;
use commands::Commands;
use control::Control;
use journal::Journal;
use kinds::Kind;

/// One device, ready.
#[derive(Serialize)]
struct Ready<'a> {
    kind: &'a str,
    path: &'a Path,
}

/// Time between two looks at stdin and at the log.
const TICK: Duration = Duration::from_millis(5);

pub(super) fn run(args: &EmulateArgs, output: &Output) -> anyhow::Result<Outcome> {
    let interrupt = Interrupt::watch()?;
    let kinds = args
        .kinds
        .iter()
        .map(|kind| kind.parse().with_context(|| format!("KIND {kind:?}")))
        .collect::<anyhow::Result<Vec<Uri<Kind>>>>()?;
    let world = crate::world::load(&args.world, args.start)?;
    let params = robot_of(&kinds);
    let robot = Simulation::new(world, params, args.seed)?;

    let names = names(&kinds);
    let emulators = kinds.into_iter().map(|kind| kind.device.emulator).collect();
    let emulation = start(&robot, args, &names, emulators)?;
    let mut journal = match &args.log {
        Some(path) => Some(Journal::create(path, &emulation)?),
        None => None,
    };
    for (device, name) in names.iter().enumerate() {
        output.batch_line(&Ready {
            kind: name.split('-').next().unwrap_or(name),
            path: emulation.path(device),
        })?;
    }

    let mut control = Control {
        robot: &robot,
        emulation: &emulation,
        names: &names,
        faults: vec![Default::default(); names.len()],
    };
    let mut commands = Commands::default();
    while !interrupt.came() {
        for line in commands.wait(TICK) {
            let reply = control.obey(&line);
            if let Some(journal) = journal.as_mut().filter(|_| reply.ok) {
                journal.control(&line)?;
            }
            eprintln!("{}", serde_json::to_string(&reply)?);
        }
        if let Some(journal) = &mut journal {
            journal.catch_up(&robot, &emulation, &names)?;
        }
    }
    Ok(Outcome::Done)
}

/// The robot that has these devices: the first base's wheels, ears as good as the best sonar's.
fn robot_of(kinds: &[Uri<Kind>]) -> RobotParams {
    let default = RobotParams::default();
    let ranges = kinds.iter().filter_map(|kind| kind.device.max_range);
    let base = kinds.iter().find_map(|kind| kind.device.base);
    RobotParams {
        base: base.unwrap_or_default(),
        sonar: SonarParams {
            max_range: ranges.reduce(f64::max).unwrap_or(default.sonar.max_range),
            ..default.sonar
        },
        ..default
    }
}

/// Puts the devices on terminals, under their names where a folder for the links was given.
fn start(
    robot: &Simulation,
    args: &EmulateArgs,
    names: &[String],
    emulators: Vec<Box<dyn Emulator>>,
) -> anyhow::Result<Emulation> {
    let Some(folder) = &args.links else {
        return Ok(Emulation::start(robot, emulators, args.seed)?);
    };
    std::fs::create_dir_all(folder).with_context(|| format!("{}", folder.display()))?;
    let links: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
    Emulation::start_at(robot, links.into_iter().zip(emulators).collect(), args.seed)
        .with_context(|| format!("links in {}", folder.display()))
}

/// A name a device: its kind, the second of a kind with `-2`.
fn names(kinds: &[Uri<Kind>]) -> Vec<String> {
    let kind = |uri: &Uri<Kind>| {
        let end = uri.text.find(['?', ':']).unwrap_or(uri.text.len());
        uri.text[..end].to_owned()
    };
    let mut names: Vec<String> = Vec::new();
    for (k, uri) in kinds.iter().enumerate() {
        let name = kind(uri);
        let before = kinds[..k]
            .iter()
            .filter(|other| kind(other) == name)
            .count();
        names.push(match before {
            0 => name,
            _ => format!("{name}-{}", before + 1),
        });
    }
    names
}
