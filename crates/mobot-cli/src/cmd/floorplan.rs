//! `mobot floorplan`: a floor plan from a map, to be corrected by hand.

use anyhow::Context as _;
use monocal::{DeriveParams, FloorPlan};
use serde::Serialize;

use crate::args::FloorplanArgs;
use crate::output::{Outcome, Output, write_whole};

#[derive(Serialize)]
struct Answer {
    walls: usize,
    door_corners: usize,
    wall_length_m: f64,
}

pub(super) fn run(args: &FloorplanArgs, output: &Output) -> anyhow::Result<Outcome> {
    let map = super::load(&args.input, output)?;
    output.stage("fitting walls");
    let plan = FloorPlan::from_map(&map, &DeriveParams::default());
    if !plan.is_empty() {
        let name = args.output.display();
        write_whole(&args.output, plan.to_geojson().as_bytes())
            .with_context(|| format!("{name}"))?;
    }
    let answer = Answer {
        walls: plan.walls.len(),
        door_corners: plan.door_corners.len(),
        wall_length_m: plan.walls.iter().map(|[a, b]| a.distance(*b)).sum(),
    };
    output.answer(&answer, || {
        format!(
            "{} walls of {:.1} m in all, {} door corners (candidates: delete what is none)",
            answer.walls, answer.wall_length_m, answer.door_corners
        )
    })?;
    Ok(if plan.is_empty() {
        Outcome::No
    } else {
        Outcome::Done
    })
}
