//! `mobot replay`: a mission again from its log. The same command runs with devices that answer from the
//! log, writes a log of its own, and the decisions of both are compared byte for byte.

use std::ffi::OsString;
use std::io::BufReader;
use std::path::Path;

use anyhow::{Context as _, bail};
use clap::Parser as _;
use serde::Serialize;

use super::scratch::Scratch;
use crate::args::{Cli, ReplayArgs};
use crate::output::{Outcome, Output};
use crate::run_log::{Decision, DecisionCheck, LogError, LogReader, Message, Recipe, Verdict};

/// What a log may ask for: nothing that opens a device, writes anywhere, or reads a file that is not in
/// the log.
const COMMANDS: [&str; 2] = ["drive", "explore"];
/// Options that hold values.
const VALUES: [&str; 9] = [
    "--base",
    "--sonar",
    "--turret",
    "--camera",
    "--to",
    "--start",
    "--radius",
    "--budget",
    "--resolution",
];
/// Options that hold files of the log.
const FILES: [&str; 3] = ["--map", "--plan", "--camera-file"];

#[derive(Serialize)]
struct Answer {
    decisions_equal: bool,
    decisions: u64,
    /// Of the log: it ends before its run did.
    cut_off: bool,
    /// The first decision that is not the same.
    difference: Option<String>,
}

pub(super) fn run(args: &ReplayArgs, output: &Output) -> anyhow::Result<Outcome> {
    let name = || format!("{}", args.log.display());
    let recipe = LogReader::open(&args.log)
        .map_err(Into::into)
        .and_then(Recipe::read)
        .with_context(name)?;
    checked(&recipe).with_context(name)?;
    let folder = Scratch::new()?;
    let out = folder.0.join("out");
    output.stage(format!("running {} again", args.log.display()));
    again(&recipe, &folder.0, &args.log, &out).with_context(name)?;
    let answer = compared(&args.log, &out.join("run.mcap")).with_context(name)?;
    output.answer(&answer, || text(&answer))?;
    Ok(if answer.decisions_equal {
        Outcome::Done
    } else {
        Outcome::No
    })
}

/// Refuses what a stranger's log could do harm with.
fn checked(recipe: &Recipe) -> anyhow::Result<()> {
    if !COMMANDS.contains(&recipe.command.as_str()) {
        bail!(
            "expected a log of {}, found one of {:?}",
            COMMANDS.join(" or "),
            recipe.command
        );
    }
    for option in &recipe.options {
        let known: &[&str] = if option.file { &FILES } else { &VALUES };
        if !known.contains(&option.name.as_str()) {
            bail!("expected options of a mission, found {:?}", option.name);
        }
    }
    Ok(())
}

fn again(recipe: &Recipe, folder: &Path, log: &Path, out: &Path) -> anyhow::Result<()> {
    let mut words: Vec<OsString> = vec!["mobot".into(), recipe.command.clone().into()];
    words.extend(recipe.unpack(folder)?);
    for (option, value) in [("--from-log=", log), ("--out=", out)] {
        let mut word = OsString::from(option);
        word.push(value);
        words.push(word);
    }
    let cli = Cli::try_parse_from(words).map_err(|error| {
        let text = error.to_string();
        let line = text.lines().next().unwrap_or_default();
        anyhow::anyhow!("{line}")
    })?;
    super::dispatch(cli.command, Output::silent()).map(drop)
}

/// The decisions of both logs. Where the first was cut off, the second may go on.
fn compared(log: &Path, again: &Path) -> anyhow::Result<Answer> {
    let mut failed = None;
    let mut logged = LogReader::open(log)?;
    let mut check = DecisionCheck::new(Decisions {
        entries: &mut logged,
        failed: &mut failed,
    });
    for entry in LogReader::open(again)? {
        if let Message::Decision(decision) = entry?.message {
            check.made(decision);
        }
    }
    let verdict = check.finish();
    if let Some(error) = failed {
        return Err(error.into());
    }
    let cut_off = logged.is_cut_off();
    let Verdict { equal, difference } = verdict;
    let difference = difference.filter(|d| !(cut_off && d.logged.is_none()));
    Ok(Answer {
        decisions_equal: difference.is_none() && equal > 0,
        decisions: equal,
        cut_off,
        difference: difference.map(|d| d.to_string()),
    })
}

fn text(answer: &Answer) -> String {
    let cut = if answer.cut_off {
        "; the log ends before its run did"
    } else {
        ""
    };
    match &answer.difference {
        None => format!("{} decisions, all the same{cut}", answer.decisions),
        Some(difference) => format!("{} decisions the same, then {difference}", answer.decisions),
    }
}

/// The decisions of a log; ends at an error, and keeps it.
struct Decisions<'a> {
    entries: &'a mut LogReader<BufReader<std::fs::File>>,
    failed: &'a mut Option<LogError>,
}

impl Iterator for Decisions<'_> {
    type Item = Decision;

    fn next(&mut self) -> Option<Decision> {
        loop {
            match self.entries.next()? {
                Ok(entry) => {
                    if let Message::Decision(decision) = entry.message {
                        return Some(decision);
                    }
                }
                Err(error) => {
                    *self.failed = Some(error);
                    return None;
                }
            }
        }
    }
}
