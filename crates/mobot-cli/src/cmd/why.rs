//! `mobot why`: which readings made a cell what it is, and how much each gave.

use anyhow::{Context as _, bail};
use occgrid::{Contribution, OccupancyGrid, Point2, Reading, Relation, Shot, explain};
use serde::Serialize;

use super::sensor;
use crate::args::WhyArgs;
use crate::output::{Outcome, Output};

#[derive(Serialize)]
struct Answer {
    x: f64,
    y: f64,
    col: u32,
    row: u32,
    value: i8,
    /// What the readings add up to.
    log_odds: f32,
    probability: f32,
    /// What the saved map holds, where it differs: a refined map is more than the sum of its readings.
    #[serde(skip_serializing_if = "Option::is_none")]
    saved_log_odds: Option<f32>,
    readings: usize,
    contributions: Vec<ContributionAnswer>,
}

#[derive(Serialize)]
struct ContributionAnswer {
    line: usize,
    stamp: f64,
    kind: &'static str,
    range_m: Option<f64>,
    from: [f64; 2],
    cell_range_m: f64,
    offset_rad: f64,
    relation: &'static str,
    log_odds: f32,
}

pub(super) fn run(args: &WhyArgs, output: &Output) -> anyhow::Result<Outcome> {
    let loaded = super::load_with(&args.input, output, true)?;
    let frame = *loaded.map.frame();
    let Some(cell) = frame.cell_at(Point2::new(args.x, args.y)) else {
        bail!(
            "{}: expected a place on the map, found ({}, {})",
            args.input.map.display(),
            args.x,
            args.y
        );
    };
    let copy = sensor::copy_beside(&args.input.map);
    let sensor_file = args.sensor.as_ref().unwrap_or(&copy);
    let model = sensor::read(sensor_file, args.profile).with_context(|| {
        if args.sensor.is_some() {
            "--sensor"
        } else {
            "no --sensor given, and no copy by the map"
        }
    })?;
    let shots = sensor::shots(&args.log)?;
    output.stage("asking every reading");
    let blank = OccupancyGrid::from_log_odds(frame, vec![0.0; frame.cell_count()])?;
    let all = explain(&blank, &model, &shots, cell)?;
    let log_odds: f32 = all.iter().map(|c| c.log_odds).sum();
    let saved = loaded.log_odds.map(|values| values[frame.index(cell)]);
    let answer = Answer {
        x: args.x,
        y: args.y,
        col: cell.col,
        row: cell.row,
        value: loaded.map.values()[frame.index(cell)],
        log_odds,
        probability: 1.0 / (1.0 + (-log_odds).exp()),
        saved_log_odds: saved.filter(|s| (s - log_odds).abs() > 1e-6),
        readings: all.len(),
        contributions: all
            .iter()
            .take(args.most)
            .map(|c| contribution(c, &shots))
            .collect(),
    };
    output.answer(&answer, || text(&answer))?;
    Ok(Outcome::Done)
}

fn contribution(c: &Contribution, shots: &[Shot]) -> ContributionAnswer {
    let shot = &shots[c.shot];
    let (kind, range_m) = match shot.reading {
        Reading::Echo { range } => ("echo", Some(range)),
        Reading::NoEcho { listened } => ("no_echo", Some(listened)),
        Reading::TooClose => ("too_close", None),
        Reading::Fault => ("fault", None),
    };
    ContributionAnswer {
        line: c.shot + 2,
        stamp: shot.stamp,
        kind,
        range_m,
        from: [shot.map_from_base.x, shot.map_from_base.y],
        cell_range_m: c.range,
        offset_rad: c.offset,
        relation: match c.relation {
            Relation::InFront => "in_front",
            Relation::AtEcho => "at_echo",
            Relation::Beyond => "beyond",
            Relation::InSilence => "in_silence",
        },
        log_odds: c.log_odds,
    }
}

fn text(answer: &Answer) -> String {
    let mut text = format!(
        "cell ({}, {}) at ({}, {}): probability of occupancy {:.3} (log-odds {:+.3}) from {} readings",
        answer.col,
        answer.row,
        answer.x,
        answer.y,
        answer.probability,
        answer.log_odds,
        answer.readings
    );
    if let Some(saved) = answer.saved_log_odds {
        text += &format!("\nthe saved map holds log-odds {saved:+.3} here: it was refined");
    }
    for c in &answer.contributions {
        let range = c.range_m.map_or(String::new(), |r| format!(" {r:.2} m"));
        text += &format!(
            "\nline {:>6}: {:+.3}  {}{range} from ({:.2}, {:.2}): the cell is {:.2} m away, {:+.1} deg \
             off the axis, {}",
            c.line,
            c.log_odds,
            c.kind,
            c.from[0],
            c.from[1],
            c.cell_range_m,
            c.offset_rad.to_degrees(),
            c.relation.replace('_', " ")
        );
    }
    if answer.readings > answer.contributions.len() {
        text += &format!(
            "\nand {} weaker ones",
            answer.readings - answer.contributions.len()
        );
    }
    text
}
