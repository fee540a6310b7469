//! `mobot floorplan`: a floor plan from a map, to be corrected by hand.

use anyhow::{Context as _, bail};
use monocal::{DeriveParams, Doorway, FloorPlan};
use occgrid::OccupancyMap;
use serde::Serialize;

use crate::args::FloorplanArgs;
use crate::output::{Outcome, Output, write_whole};
use crate::picture::{Color, Scene, format_of, save};

#[derive(Serialize)]
struct Answer {
    walls: usize,
    door_corners: usize,
    wall_length_m: f64,
    /// The likeliest first; those of too little confidence are not in the plan.
    doorways: Vec<DoorwayAnswer>,
}

#[derive(Serialize)]
struct DoorwayAnswer {
    /// Corners of both jambs, a pair a face of the wall [m].
    faces: Vec<[[f64; 2]; 2]>,
    width_m: f64,
    confidence: f64,
    in_plan: bool,
}

pub(super) fn run(args: &FloorplanArgs, output: &Output) -> anyhow::Result<Outcome> {
    let params = params(args)?;
    if let Some(path) = &args.picture {
        format_of(path)?;
    }
    let map = super::load(&args.input, output)?;
    output.stage("fitting walls");
    let (plan, doorways) = FloorPlan::with_doorways(&map, &params);
    if !plan.is_empty() {
        let name = args.output.display();
        write_whole(&args.output, plan.to_geojson().as_bytes())
            .with_context(|| format!("{name}"))?;
    }
    if let Some(path) = &args.picture {
        save(&drawn(&map, &plan, &doorways, &params), path)?;
    }
    let described = |d: &Doorway| DoorwayAnswer {
        faces: d.faces.iter().map(|f| f.map(|p| [p.x, p.y])).collect(),
        width_m: d.width,
        confidence: d.confidence,
        in_plan: d.confidence >= params.least_confidence,
    };
    let answer = Answer {
        walls: plan.walls.len(),
        door_corners: plan.door_corners.len(),
        wall_length_m: plan.walls.iter().map(|[a, b]| a.distance(*b)).sum(),
        doorways: doorways.iter().map(described).collect(),
    };
    let kept = answer.doorways.iter().filter(|d| d.in_plan).count();
    output.answer(&answer, || {
        format!(
            "{} walls of {:.1} m in all, {kept} doorways with {} corners (candidates: delete what is none); \
             {} more look less like doorways",
            answer.walls,
            answer.wall_length_m,
            answer.door_corners,
            answer.doorways.len() - kept
        )
    })?;
    Ok(if plan.is_empty() {
        Outcome::No
    } else {
        Outcome::Done
    })
}

fn params(args: &FloorplanArgs) -> anyhow::Result<DeriveParams> {
    let defaults = DeriveParams::default();
    let [door_min, door_max] = args.doors;
    if !(door_min > 0.0 && door_max >= door_min && door_max <= 10.0) {
        bail!(
            "--doors: expected two widths above 0 and up to 10 m, the smaller first, found {door_min},{door_max}"
        );
    }
    if !(0.0..=1.0).contains(&args.confidence) {
        bail!("--confidence: expected 0 to 1, found {}", args.confidence);
    }
    Ok(DeriveParams {
        door_min,
        door_max,
        // a gap that may be a door is never part of a wall
        gap_max: defaults.gap_max.min(door_min),
        least_confidence: args.confidence,
        ..defaults
    })
}

const WALL: Color = Color(0, 110, 220);
const DOORWAY: Color = Color(220, 0, 90);
const UNLIKELY: Color = Color(240, 170, 90);

fn drawn(
    map: &OccupancyMap,
    plan: &FloorPlan,
    doorways: &[Doorway],
    params: &DeriveParams,
) -> Scene {
    let mut scene = Scene::of_map(map);
    for wall in &plan.walls {
        scene.line(wall, WALL, 1.5);
    }
    for doorway in doorways.iter().rev() {
        let likely = doorway.confidence >= params.least_confidence;
        let (color, width) = if likely {
            (DOORWAY, 2.5)
        } else {
            (UNLIKELY, 1.0)
        };
        for face in &doorway.faces {
            scene.line(face, color, width);
            if likely {
                for corner in face {
                    scene.dot(*corner, color, 3.0);
                }
            }
        }
    }
    scene.note(WALL, "walls");
    scene.note(
        DOORWAY,
        format!(
            "doorways of confidence {} and more, with their corners",
            params.least_confidence
        ),
    );
    scene.note(UNLIKELY, "other openings as wide as doors: not in the plan");
    scene
}
