//! `mobot clean`: the paper's Fig. 5 on a map, one picture a stage, and a ledger of what each step did.

use std::path::Path;

use morpho::{BitImage, Cleaned, Cleaner, CleanerParams, Stage, Thinning};
use occgrid::OccupancyMap;
use serde::Serialize;
use voronoi_plan::FreeSpace;

use crate::args::CleanArgs;
use crate::output::{Outcome, Output, write_whole};
use crate::picture::gray_png;

#[derive(Serialize)]
struct Answer {
    stages: Vec<StageAnswer>,
}

#[derive(Serialize)]
struct StageAnswer {
    name: &'static str,
    free_cells: usize,
    free_components: usize,
    holes: usize,
    removed: usize,
    added: usize,
    joined: usize,
    split: usize,
    picture: String,
}

pub(super) fn run(args: &CleanArgs, output: &Output) -> anyhow::Result<Outcome> {
    let map = super::load(&args.input, output)?;
    output.stage("cleaning");
    let cleaned = stages(&map, args.paper, &args.output)?;
    let answer = answer(&cleaned);
    output.answer(&answer, || table(&answer, args))?;
    Ok(Outcome::Done)
}

/// A map's stages as pictures in a folder, with their ledger.
pub(super) fn stages(map: &OccupancyMap, paper: bool, folder: &Path) -> anyhow::Result<Cleaned> {
    let free = FreeSpace::from_map(map).cells().clone();
    let cleaned = Cleaner::new(params(paper)).clean(free)?;
    for stage in Stage::ALL {
        let image = cleaned.stages.get(stage);
        write_whole(&folder.join(picture_name(stage)), &png(image)?)?;
    }
    let ledger = serde_json::to_vec_pretty(&cleaned.ledger)?;
    write_whole(&folder.join("ledger.json"), &ledger)?;
    Ok(cleaned)
}

/// The paper's chain; or the one that never calls a cell free that the map does not: nothing is closed,
/// cells keep their size, and thinning keeps every component and hole.
fn params(paper: bool) -> CleanerParams {
    if paper {
        return CleanerParams::default();
    }
    CleanerParams {
        closing_side: 1,
        cell_side: 1,
        thinning: Thinning::Homotopic,
        ..CleanerParams::default()
    }
}

fn picture_name(stage: Stage) -> String {
    format!("{}.png", stage.name())
}

fn png(image: &BitImage) -> anyhow::Result<Vec<u8>> {
    gray_png(
        image.width() as u32,
        image.height() as u32,
        &morpho::to_gray(image),
    )
}

fn answer(cleaned: &Cleaned) -> Answer {
    let stages = cleaned.ledger.entries.iter().map(|entry| StageAnswer {
        name: entry.stage.name(),
        free_cells: entry.free_cells,
        free_components: entry.free_components,
        holes: entry.holes,
        removed: entry.removed.pixels,
        added: entry.added.pixels,
        joined: entry.components.joined.len(),
        split: entry.components.split.len(),
        picture: picture_name(entry.stage),
    });
    Answer {
        stages: stages.collect(),
    }
}

fn table(answer: &Answer, args: &CleanArgs) -> String {
    let mut text =
        String::from("stage         free  parts  holes  removed    added  joined  split\n");
    for s in &answer.stages {
        text += &format!(
            "{:<9} {:>8} {:>6} {:>6} {:>8} {:>8} {:>7} {:>6}\n",
            s.name, s.free_cells, s.free_components, s.holes, s.removed, s.added, s.joined, s.split
        );
    }
    text + &format!("pictures and ledger.json in {}", args.output.display())
}
