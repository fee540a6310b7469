//! `mobot plan`: certified routes on a map, one or many.

use std::path::Path;

use anyhow::{Context as _, bail};
use occgrid::{OccupancyMap, Point2};
use serde::Serialize;
use voronoi_plan::geojson::{ReadLimits, RouteGraph};
use voronoi_plan::{ClearanceField, FreeSpace, Plan, PlanStatus, Planner, VoronoiGraph};

use super::graph::draw;
use crate::args::PlanArgs;
use crate::output::{Outcome, Output};
use crate::picture::{self, Color, Scene};

/// Queries a file may hold: about a million lines.
const MOST_QUERY_BYTES: u64 = 64 * 1024 * 1024;

#[derive(Serialize)]
struct Answer {
    status: PlanStatus,
    #[serde(skip_serializing_if = "Option::is_none")]
    length_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    clearance_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    points: Option<Vec<[f64; 2]>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bottleneck: Option<Bottleneck>,
}

#[derive(Serialize)]
struct Bottleneck {
    x: f64,
    y: f64,
    width_m: f64,
}

pub(super) fn run(args: &PlanArgs, output: &Output) -> anyhow::Result<Outcome> {
    let radius = super::checked_radius(args.radius)?;
    super::checked_picture(args.picture.as_deref())?;
    let queries = args.queries.as_deref().map(queries).transpose()?;
    let map = super::load(&args.input, output)?;
    let space = FreeSpace::from_map(&map);
    let graph = roadmap(args, radius, &space, output)?;
    output.stage("preparing");
    let planner = Planner::new(&space, &graph, ClearanceField::new(&space));
    if let Some(queries) = queries {
        for [x0, y0, x1, y1] in queries {
            output.batch_line(&answer(
                &planner.plan(Point2::new(x0, y0), Point2::new(x1, y1)),
            ))?;
        }
        return Ok(Outcome::Done);
    }
    let (Some(from), Some(to)) = (args.from, args.to) else {
        bail!("expected --from X,Y and --to X,Y, or --queries Q.csv");
    };
    let (from, to) = (Point2::new(from[0], from[1]), Point2::new(to[0], to[1]));
    output.stage("planning");
    let plan = planner.plan(from, to);
    let answer = answer(&plan);
    if let Some(path) = &args.picture {
        output.stage("drawing");
        let scene = scene(&map, &graph, &plan, [from, to], text(&answer, None));
        picture::save(&scene, path).context("picture")?;
    }
    output.answer(&answer, || text(&answer, args.picture.as_deref()))?;
    Ok(if matches!(plan, Plan::Ok(_)) {
        Outcome::Done
    } else {
        Outcome::No
    })
}

/// The graph that was saved, or a new one.
fn roadmap(
    args: &PlanArgs,
    radius: f64,
    space: &FreeSpace,
    output: &Output,
) -> anyhow::Result<VoronoiGraph> {
    let Some(path) = &args.graph else {
        output.stage("extracting the roadmap");
        return super::graph::roadmap(space, radius);
    };
    output.stage(format!("reading {}", path.display()));
    let name = path.display();
    let graph = RouteGraph::load(path, &ReadLimits::default())
        .and_then(|graph| graph.to_voronoi())
        .with_context(|| format!("{name}"))?;
    if graph.frame != *space.frame() {
        bail!(
            "{name}: expected a graph of this map, found one of another size, place or resolution"
        );
    }
    if (graph.radius - radius).abs() > 1e-9 {
        bail!(
            "{name}: expected a graph for radius {radius} m, found one for {} m",
            graph.radius
        );
    }
    Ok(graph)
}

/// Reads the queries: header `x0,y0,x1,y1`, a query a line.
fn queries(path: &Path) -> anyhow::Result<Vec<[f64; 4]>> {
    const HEADER: &str = "x0,y0,x1,y1";
    let name = path.display();
    let text = super::read_text(path, MOST_QUERY_BYTES)?;
    let mut lines = text.trim_start_matches('\u{feff}').lines();
    let header = lines.next().unwrap_or_default().trim();
    if header != HEADER {
        bail!("{name}: line 1: expected the header {HEADER}, found {header:?}");
    }
    let mut queries = Vec::new();
    for (number, line) in (2..).zip(lines) {
        if line.trim().is_empty() {
            continue;
        }
        let fields: Vec<&str> = line.split(',').collect();
        if fields.len() != 4 {
            bail!(
                "{name}: line {number}: expected 4 fields ({HEADER}), found {}",
                fields.len()
            );
        }
        let mut query = [0.0; 4];
        for ((value, field), column) in query.iter_mut().zip(&fields).zip(HEADER.split(',')) {
            *value = match field.trim().parse::<f64>() {
                Ok(parsed) if parsed.is_finite() => parsed,
                _ => bail!(
                    "{name}: line {number}, column {column}: expected a finite number, found {field:?}"
                ),
            };
        }
        queries.push(query);
    }
    Ok(queries)
}

fn answer(plan: &Plan) -> Answer {
    let mut answer = Answer {
        status: plan.status(),
        length_m: None,
        clearance_m: None,
        points: None,
        bottleneck: None,
    };
    match plan {
        Plan::Ok(route) => {
            answer.length_m = Some(route.length);
            answer.clearance_m = Some(route.clearance);
            answer.points = Some(route.points.iter().map(|p| [p.x, p.y]).collect());
        }
        Plan::NoRoute { bottleneck } => {
            answer.bottleneck = Some(Bottleneck {
                x: bottleneck.place.x,
                y: bottleneck.place.y,
                width_m: bottleneck.width,
            });
        }
        _ => {}
    }
    answer
}

fn scene(
    map: &OccupancyMap,
    graph: &VoronoiGraph,
    plan: &Plan,
    ends: [Point2; 2],
    caption: String,
) -> Scene {
    let mut scene = Scene::of_map(map);
    draw(&mut scene, graph);
    if let Plan::Ok(route) = plan {
        scene.line(&route.points, Color(255, 255, 255), 7.0);
        scene.line(&route.points, Color::ROUTE, 4.0);
    }
    if let Plan::NoRoute { bottleneck: b } = plan {
        scene.dot(b.place, Color::FAULT, 7.0);
    }
    for end in ends {
        scene.dot(end, Color::ROUTE, 6.0);
    }
    scene.note(Color::ROUTE, caption);
    scene
}

fn text(answer: &Answer, picture: Option<&Path>) -> String {
    let mut text = match (answer.status, answer.length_m, answer.clearance_m) {
        (PlanStatus::Ok, Some(length), Some(clearance)) => {
            format!("route of {length:.2} m, clearance {clearance:.3} m")
        }
        (status, ..) => status.to_string().replace('_', " "),
    };
    if let Some(b) = &answer.bottleneck {
        text += &format!(
            "; the best way is {:.3} m wide at its narrowest, at ({:.2}, {:.2})",
            b.width_m, b.x, b.y
        );
    }
    if let Some(path) = picture {
        text += &format!("\npicture in {}", path.display());
    }
    text
}
