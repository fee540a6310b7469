//! `mobot devices`: ports and cameras that are there, and what the named devices say.

mod identity;
mod list;
mod probe;

use std::path::Path;

use anyhow::Context as _;
use serde::Serialize;

use crate::args::DevicesArgs;
use crate::output::{Outcome, Output};
use list::Candidate;
use probe::{Found, Named};

#[derive(Serialize)]
struct Answer {
    devices: Vec<Found>,
    ports: Vec<Candidate>,
    cameras: Vec<Candidate>,
}

pub(super) fn run(args: &DevicesArgs, output: &Output) -> anyhow::Result<Outcome> {
    let mut named = Vec::new();
    for text in &args.uris {
        named.extend(Named::read(text).with_context(|| format!("URI {text:?}"))?);
    }
    named.extend(args.base.clone().map(Named::Base));
    named.extend(args.sonar.clone().map(Named::Sonar));
    named.extend(args.turret.clone().map(Named::Turret));
    named.extend(args.camera.clone().map(Named::Camera));
    let mut answer = Answer {
        devices: Vec::new(),
        ports: list::ports(Path::new("/")),
        cameras: list::cameras(),
    };
    for device in named {
        output.stage(format!("asking {}", device.text()));
        answer.devices.push(device.probe());
    }
    output.answer(&answer, || text(&answer))?;
    let all = answer.devices.iter().all(|device| device.ok);
    Ok(if all { Outcome::Done } else { Outcome::No })
}

fn text(answer: &Answer) -> String {
    let mut lines = Vec::new();
    for (what, candidates) in [("port", &answer.ports), ("camera", &answer.cameras)] {
        if candidates.is_empty() {
            lines.push(format!("no {what} found"));
        }
        for Candidate { path, node, name } in candidates {
            let node = node.as_ref().map(|node| format!(" ({node})"));
            let name = name.as_ref().map(|name| format!("  {name}"));
            lines.push(format!(
                "{what} {path}{}{}",
                node.unwrap_or_default(),
                name.unwrap_or_default()
            ));
        }
    }
    for found in &answer.devices {
        let said = found.reading.as_ref().or(found.error.as_ref());
        let rate = found.rate_hz.map(|rate| format!(" {rate:.1} Hz,"));
        lines.push(format!(
            "{} {} {}: {},{} {}",
            if found.ok { "ok" } else { "NO" },
            found.kind,
            found.uri,
            found.identity,
            rate.unwrap_or_default(),
            said.map_or("", String::as_str)
        ));
    }
    if answer.devices.is_empty() {
        lines.push(
            "name devices to ask them, as in: mobot devices maxbotix:/dev/ttyUSB0".to_owned(),
        );
    }
    lines.join("\n")
}
