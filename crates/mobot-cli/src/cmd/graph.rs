//! `mobot graph`: the Voronoi roadmap of a map, every arc with a certified clearance.

use std::time::Instant;

use anyhow::Context as _;
use morpho::CleanerParams;
use serde::Serialize;
use voronoi_plan::geojson::RouteGraph;
use voronoi_plan::{FreeSpace, GraphParams, PaperGraph, VoronoiGraph};

use crate::args::GraphArgs;
use crate::output::{Outcome, Output, write_whole};
use crate::picture::{self, Color, Scene, clearance_color};

#[derive(Serialize)]
struct Answer {
    nodes: usize,
    arcs: usize,
    components: usize,
    cycles: usize,
    min_clearance_m: Option<f64>,
    crossings: usize,
    below_radius: usize,
    elapsed_ms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    ours: Option<Beside>,
}

/// A roadmap in figures, as the mission's commands give them.
#[derive(Serialize)]
pub(super) struct Roadmap {
    pub(super) nodes: usize,
    pub(super) arcs: usize,
    pub(super) components: usize,
    pub(super) min_clearance_m: Option<f64>,
}

impl Roadmap {
    pub(super) fn of(graph: &VoronoiGraph) -> Self {
        Self {
            nodes: graph.nodes.len(),
            arcs: graph.arcs.len(),
            components: graph.components(),
            min_clearance_m: graph.min_clearance(),
        }
    }
}

/// The default pipeline on the same map, beside the paper's.
#[derive(Serialize)]
struct Beside {
    nodes: usize,
    arcs: usize,
    crossings: usize,
    min_clearance_m: Option<f64>,
}

pub(super) fn run(args: &GraphArgs, output: &Output) -> anyhow::Result<Outcome> {
    let radius = super::checked_radius(args.radius)?;
    super::checked_picture(args.picture.as_deref())?;
    let map = super::load(&args.input, output)?;
    output.stage("extracting the roadmap");
    let started = Instant::now();
    let space = FreeSpace::from_map(&map);
    let graph = if args.paper {
        PaperGraph::build(&map, radius, &CleanerParams::default())?.graph
    } else if args.straight {
        roadmap(&space, radius)?.straightened(&space)
    } else {
        roadmap(&space, radius)?
    };
    let elapsed_ms = started.elapsed().as_secs_f64() * 1e3;
    let beside = if args.paper {
        Some(beside(&roadmap(&space, radius)?))
    } else {
        None
    };
    output.stage("writing");
    write_whole(
        &args.output,
        &RouteGraph::from_voronoi(&graph).to_geojson()?,
    )
    .with_context(|| format!("{}", args.output.display()))?;
    let answer = Answer {
        nodes: graph.nodes.len(),
        arcs: graph.arcs.len(),
        components: graph.components(),
        cycles: graph.cycles(),
        min_clearance_m: graph.min_clearance(),
        crossings: graph.crossings(),
        below_radius: graph
            .arcs
            .iter()
            .filter(|arc| arc.clearance < radius)
            .count(),
        elapsed_ms,
        ours: beside,
    };
    if let Some(path) = &args.picture {
        output.stage("drawing");
        let mut scene = Scene::of_map(&map);
        draw(&mut scene, &graph);
        scene.note(Color::INK, text(&answer, args));
        picture::save(&scene, path).context("picture")?;
    }
    output.answer(&answer, || text(&answer, args))?;
    Ok(Outcome::Done)
}

/// The default pipeline: complete, every arc certified.
pub(super) fn roadmap(space: &FreeSpace, radius: f64) -> anyhow::Result<VoronoiGraph> {
    let params = GraphParams {
        radius,
        ..GraphParams::default()
    };
    Ok(VoronoiGraph::build(space, &params)?)
}

fn beside(graph: &VoronoiGraph) -> Beside {
    Beside {
        nodes: graph.nodes.len(),
        arcs: graph.arcs.len(),
        crossings: graph.crossings(),
        min_clearance_m: graph.min_clearance(),
    }
}

/// The arcs, coloured by clearance, those that cross obstacles in the colour of faults, and the nodes.
pub(super) fn draw(scene: &mut Scene, graph: &VoronoiGraph) {
    let clearances = graph.arcs.iter().map(|arc| arc.clearance);
    let least = clearances.clone().fold(f64::INFINITY, f64::min);
    let greatest = clearances.fold(0.0, f64::max);
    for arc in &graph.arcs {
        if arc.clearance > 0.0 {
            let color = clearance_color(arc.clearance, least, greatest);
            scene.line(&arc.polyline, color, 2.0);
        } else {
            scene.line(&arc.polyline, Color::FAULT, 3.0);
        }
    }
    for node in &graph.nodes {
        scene.dot(node.point, Color::INK, 1.5);
    }
    if least <= greatest {
        scene.note(
            clearance_color(least, least, greatest),
            format!("least clearance {least:.3} m"),
        );
        scene.note(
            clearance_color(greatest, least, greatest),
            format!("greatest clearance of an arc {greatest:.3} m"),
        );
    }
}

fn text(answer: &Answer, args: &GraphArgs) -> String {
    let least = answer
        .min_clearance_m
        .map_or("-".into(), |c| format!("{c:.3} m"));
    let mut text = format!(
        "{} nodes, {} arcs in {} parts with {} cycles; least clearance {least}; {} arcs cross \
         obstacles, {} are nearer than {} m ({:.0} ms)",
        answer.nodes,
        answer.arcs,
        answer.components,
        answer.cycles,
        answer.crossings,
        answer.below_radius,
        args.radius,
        answer.elapsed_ms
    );
    if let Some(ours) = &answer.ours {
        let least = ours
            .min_clearance_m
            .map_or("-".into(), |c| format!("{c:.3} m"));
        text += &format!(
            "; beside it, the default: {} nodes, {} arcs, {} cross obstacles, least clearance {least}",
            ours.nodes, ours.arcs, ours.crossings
        );
    }
    text
}
