//! `mobot map`: a sonar log to a map.

use std::time::Instant;

use anyhow::{Context as _, bail};
use occgrid::{
    CellState, GridLimits, OccupancyGrid, OccupancyMap, ReadingCounts, RefineParams, SaveOptions,
    Shot, SonarModel, refine, save_map,
};
use serde::Serialize;

use super::sensor;
use crate::args::MapArgs;
use crate::output::{Outcome, Output, write_whole};
use crate::picture::{self, Color, Scene};

#[derive(Serialize)]
struct Answer {
    readings: Readings,
    cells: Cells,
    resolution_m: f64,
    elapsed_ms: f64,
}

#[derive(Serialize)]
struct Readings {
    echo: usize,
    no_echo: usize,
    too_close: usize,
    fault: usize,
}

#[derive(Serialize)]
struct Cells {
    free: usize,
    occupied: usize,
    unknown: usize,
}

pub(super) fn run(args: &MapArgs, output: &Output) -> anyhow::Result<Outcome> {
    let started = Instant::now();
    super::checked_picture(args.picture.as_deref())?;
    let (free, occupied) = thresholds(args)?;
    let model = sensor::read(&args.sensor, args.profile)?;
    output.stage(format!("reading {}", args.log.display()));
    let shots = sensor::shots(&args.log)?;
    let grid = build(args, &model, &shots, output)?;
    let map = grid.to_occupancy_map(free, occupied);
    output.stage("saving");
    let options = SaveOptions {
        plain_names: args.plain_names,
        ..SaveOptions::default()
    };
    let saved = save_map(&args.output, &map, Some(grid.log_odds()), &options)?;
    for note in saved.notes {
        eprintln!("mobot: note: {note}");
    }
    let copy = sensor::copy_beside(&args.output);
    let text = toml::to_string(&model)?;
    write_whole(&copy, text.as_bytes()).with_context(|| format!("{}", copy.display()))?;
    if let Some(path) = &args.picture {
        output.stage("drawing");
        picture::save(&scene(&map, &shots), path).context("picture")?;
    }
    let answer = Answer {
        readings: readings(&shots),
        cells: cells(&map),
        resolution_m: map.frame().resolution(),
        elapsed_ms: started.elapsed().as_secs_f64() * 1e3,
    };
    output.answer(&answer, || text_of(&answer, args))?;
    Ok(Outcome::Done)
}

/// Thresholds in the whole percents that maps hold.
fn thresholds(args: &MapArgs) -> anyhow::Result<(i8, i8)> {
    let (free, occupied) = (args.free, args.occupied);
    if !(0.0..0.5).contains(&free) {
        bail!("--free: expected a probability of 0 or more and below 0.5, found {free}");
    }
    if !(occupied > 0.5 && occupied <= 1.0) {
        bail!("--occupied: expected a probability above 0.5 and at most 1, found {occupied}");
    }
    Ok((
        (free * 100.0).floor() as i8,
        (occupied * 100.0).ceil() as i8,
    ))
}

fn build(
    args: &MapArgs,
    model: &SonarModel,
    shots: &[Shot],
    output: &Output,
) -> anyhow::Result<OccupancyGrid> {
    output.stage(format!("mapping {} shots", shots.len()));
    let limits = GridLimits {
        max_cells: args.max_cells,
    };
    let mut grid = OccupancyGrid::new(args.resolution)
        .with_context(|| format!("--resolution {}", args.resolution))?
        .with_limits(limits);
    grid.integrate(model, shots)
        .with_context(|| format!("{}", args.log.display()))?;
    if args.refine {
        output.stage("explaining the whole log");
        grid = refine(shots, model, &grid, &RefineParams::default())?;
    }
    Ok(grid)
}

/// The map and the robot's stops.
fn scene(map: &OccupancyMap, shots: &[Shot]) -> Scene {
    let mut scene = Scene::of_map(map);
    let mut stops: Vec<_> = shots
        .iter()
        .map(|shot| shot.map_from_base.position())
        .collect();
    stops.dedup();
    scene.line(&stops, Color(0, 90, 200), 1.5);
    scene.note(
        Color(0, 90, 200),
        format!("{} shots from {} places", shots.len(), stops.len()),
    );
    scene
}

fn readings(shots: &[Shot]) -> Readings {
    let ReadingCounts {
        echo,
        no_echo,
        too_close,
        fault,
    } = ReadingCounts::of(shots);
    Readings {
        echo,
        no_echo,
        too_close,
        fault,
    }
}

fn cells(map: &OccupancyMap) -> Cells {
    let count = |state| {
        map.values()
            .iter()
            .filter(|&&v| map.classify(v) == state)
            .count()
    };
    Cells {
        free: count(CellState::Free),
        occupied: count(CellState::Occupied),
        unknown: count(CellState::Unknown),
    }
}

fn text_of(answer: &Answer, args: &MapArgs) -> String {
    let Readings {
        echo,
        no_echo,
        too_close,
        fault,
    } = answer.readings;
    let Cells {
        free,
        occupied,
        unknown,
    } = answer.cells;
    format!(
        "{echo} echoes, {no_echo} silences, {too_close} too close, {fault} faults\n\
         {free} free, {occupied} occupied, {unknown} unknown cells of {} m\n\
         map in {} ({:.0} ms)",
        answer.resolution_m,
        args.output.display(),
        answer.elapsed_ms
    )
}
