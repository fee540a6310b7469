//! `mobot check`: any route graph against a map, measured anew.

use anyhow::{Context as _, bail};
use serde::Serialize;
use voronoi_plan::check::{CheckParams, EdgeLine, Report, UnknownIs, check};
use voronoi_plan::geojson::{ReadLimits, RouteGraph};

use crate::args::CheckArgs;
use crate::output::{Outcome, Output};
use crate::picture::{self, Color, Scene};

/// The frame of the map, by ROS's convention (REP-105).
const MAP_FRAME: &str = "map";

#[derive(Serialize)]
struct Answer {
    edges: usize,
    violations: Vec<Fault>,
    overclaims: Vec<OverclaimFault>,
    min_clearance_m: Option<f64>,
    worst_edge: Option<u32>,
}

#[derive(Serialize)]
struct Fault {
    id: u32,
    clearance_m: f64,
    x: f64,
    y: f64,
}

#[derive(Serialize)]
struct OverclaimFault {
    id: u32,
    claimed_m: f64,
    clearance_m: f64,
    x: f64,
    y: f64,
}

pub(super) fn run(args: &CheckArgs, output: &Output) -> anyhow::Result<Outcome> {
    let radius = super::checked_radius(args.radius)?;
    super::checked_picture(args.picture.as_deref())?;
    let map = super::load(&args.input, output)?;
    output.stage(format!("reading {}", args.graph.display()));
    let graph = RouteGraph::load(&args.graph, &ReadLimits::default())
        .with_context(|| format!("{}", args.graph.display()))?;
    if let Some(node) = graph.node_outside_frame(MAP_FRAME) {
        bail!(
            "{}: node {}: expected the frame {MAP_FRAME:?}, found {:?}",
            args.graph.display(),
            node.id,
            node.frame.as_deref().unwrap_or_default()
        );
    }
    output.stage("checking");
    let unknown = if args.unknown_free {
        UnknownIs::Free
    } else {
        UnknownIs::Occupied
    };
    let lines: Vec<EdgeLine<'_>> = if args.straight {
        graph.chords().collect()
    } else {
        graph.lines().collect()
    };
    let report = check(
        lines.iter().cloned(),
        &map,
        &CheckParams { radius, unknown },
    );
    if let Some(path) = &args.picture {
        output.stage("drawing");
        let mut scene = Scene::of_map(&map);
        for line in &lines {
            scene.line(&line.points, Color(0, 90, 200), 1.5);
        }
        for v in &report.violations {
            scene.dot(v.at, Color::FAULT, 5.0);
        }
        scene.note(Color::INK, summary(&report, radius));
        picture::save(&scene, path).context("picture")?;
    }
    output.answer(&answer(&report), || text(&report, radius))?;
    Ok(if report.is_clean() {
        Outcome::Done
    } else {
        Outcome::No
    })
}

fn answer(report: &Report) -> Answer {
    let violations = report.violations.iter().map(|v| Fault {
        id: v.edge,
        clearance_m: v.clearance,
        x: v.at.x,
        y: v.at.y,
    });
    let overclaims = report.overclaims.iter().map(|o| OverclaimFault {
        id: o.edge,
        claimed_m: o.claimed,
        clearance_m: o.clearance,
        x: o.at.x,
        y: o.at.y,
    });
    Answer {
        edges: report.edges,
        violations: violations.collect(),
        overclaims: overclaims.collect(),
        min_clearance_m: report.min_clearance,
        worst_edge: report.worst_edge,
    }
}

fn summary(report: &Report, radius: f64) -> String {
    let least = report
        .min_clearance
        .map_or("-".into(), |c| format!("{c:.3} m"));
    format!(
        "{} edges, {} nearer than {radius} m, {} that claim too much, least clearance {least}",
        report.edges,
        report.violations.len(),
        report.overclaims.len()
    )
}

/// The summary and the worst twenty faults.
fn text(report: &Report, radius: f64) -> String {
    let mut text = summary(report, radius);
    for v in report.violations.iter().take(20) {
        text += &format!(
            "\nedge {}: clearance {:.3} m at ({:.3}, {:.3})",
            v.edge, v.clearance, v.at.x, v.at.y
        );
    }
    for o in report.overclaims.iter().take(20) {
        text += &format!(
            "\nedge {}: claims {} m, has {} m at ({:.3}, {:.3})",
            o.edge, o.claimed, o.clearance, o.at.x, o.at.y
        );
    }
    text
}
