//! `mobot explore`: a building mapped by a robot that knows nothing of it.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use mobot_hw::sim::{Simulation, Truth};
use mobot_hw::{Camera, Clock, DifferentialDrive, RangeFinder};
use occgrid::{
    FREE_AT_MOST, OCCUPIED_AT_LEAST, OccupancyMap, Point2, Pose2, SaveOptions, Shot, SonarModel,
    save_map, write_log,
};
use serde::Serialize;
use voronoi_plan::geojson::RouteGraph;
use voronoi_plan::{FreeSpace, VoronoiGraph};

use super::graph::Roadmap;
use crate::args::ExploreArgs;
use crate::interrupt::Interrupt;
use crate::nav::{self, Explore, ExploreParams, FilterParams, Runner, RunnerParams};
use crate::output::{Outcome, Output, write_whole};
use crate::picture::{self, Color, Scene};
use crate::run_log::{LogParams, LogWriter};
use crate::uri;

#[derive(Serialize)]
struct Answer {
    ok: bool,
    outcome: String,
    map: MapAnswer,
    graph: Roadmap,
    drive: DriveAnswer,
    explore: ExploreAnswer,
}

#[derive(Serialize)]
struct MapAnswer {
    file: PathBuf,
    free: usize,
    occupied: usize,
    unknown: usize,
    shots: usize,
}

/// Of a simulated robot what is true; of a real one what is known.
#[derive(Serialize)]
struct DriveAnswer {
    collisions: Option<u64>,
    min_clearance_m: Option<f64>,
    distance_m: f64,
    time_s: f64,
}

#[derive(Serialize)]
struct ExploreAnswer {
    stops: usize,
    along_walls: usize,
    at_frontiers: usize,
    loops_closed: usize,
    blocked: usize,
}

/// What is known is on the disk again no later than this after it was learnt.
const SAVE_EVERY: Duration = Duration::from_millis(500);

pub(super) fn run(args: &ExploreArgs, output: &Output) -> anyhow::Result<Outcome> {
    let params = params(args)?;
    std::fs::create_dir_all(&args.out).with_context(|| format!("{}", args.out.display()))?;
    let interrupt = Interrupt::watch()?;
    let opened = uri::open(&args.devices)?;
    let params = ExploreParams {
        sonar: SonarModel {
            // readings nearer than that come as too close
            blanking: 0.0,
            sigma: params.sonar.sigma,
            ..opened.sensor
        },
        ..params
    };
    let files = Files::new(&args.out);
    let sensor = toml::to_string(&params.sonar)?;
    write_whole(&files.sensor, sensor.as_bytes())
        .with_context(|| format!("{}", files.sensor.display()))?;
    let log = LogWriter::create(&files.run, LogParams::default())
        .with_context(|| format!("{}", files.run.display()))?;
    // the map's frame begins where the robot stands
    // nothing corrects the pose here: how far the wheels are trusted is how far the robot goes
    let calibrated = FilterParams {
        wheel_sigma: 0.003,
        track_sigma: 0.01,
        ..FilterParams::default()
    };
    let runner_params = RunnerParams {
        filter: calibrated,
        ..RunnerParams::default()
    };
    let mut runner = Runner::new(opened.devices, Pose2::default(), runner_params)?;
    let mut explore = Explore::new(params)?;
    let outcome = drive(&mut runner, &mut explore, &log, &interrupt, &files, output)?;
    output.stage("explaining the whole log");
    let map = finish(&explore, &files)?;
    log.finish()
        .with_context(|| format!("{}", files.run.display()))?;
    output.stage("extracting the roadmap");
    let graph = roadmap(&map, &explore, &params, &files)?;
    let answer = Answer {
        ok: ended_well(&outcome),
        outcome: words(&outcome),
        map: map_answer(&map, &explore, &files),
        graph,
        drive: drive_answer(&runner, &explore, opened.simulation.as_ref()),
        explore: explore_answer(&explore),
    };
    output.answer(&answer, || text(&answer))?;
    Ok(if answer.ok {
        Outcome::Done
    } else {
        Outcome::No
    })
}

fn params(args: &ExploreArgs) -> anyhow::Result<ExploreParams> {
    if args.budget.is_nan() || args.budget <= 0.0 {
        bail!("--budget: expected a time above 0 s, found {}", args.budget);
    }
    if !(4..=360).contains(&args.shots) {
        bail!("--shots: expected 4 to 360, found {}", args.shots);
    }
    if !(0.5..=5.0).contains(&args.step) {
        bail!("--step: expected 0.5 to 5 m, found {}", args.step);
    }
    let mut params = ExploreParams {
        budget: args.budget,
        ..ExploreParams::default()
    };
    params.survey.shots = args.shots;
    params.survey.step = std::f64::consts::TAU / f64::from(args.shots);
    params.itinerary.wall.step = args.step;
    params.itinerary.wall.hand = args.hand.into();
    Ok(params)
}

/// Where everything goes.
struct Files {
    map: PathBuf,
    log: PathBuf,
    sensor: PathBuf,
    run: PathBuf,
    graph: PathBuf,
    picture: PathBuf,
}

impl Files {
    fn new(folder: &Path) -> Self {
        Self {
            map: folder.join("map.yaml"),
            log: folder.join("sonar.csv"),
            sensor: folder.join("sensor.toml"),
            run: folder.join("run.mcap"),
            graph: folder.join("graph.geojson"),
            picture: folder.join("map.png"),
        }
    }

    fn save(&self, map: &OccupancyMap, log_odds: &[f32], shots: &[Shot]) -> anyhow::Result<()> {
        let mut text = Vec::new();
        write_log(&mut text, shots)?;
        write_whole(&self.log, &text).with_context(|| format!("{}", self.log.display()))?;
        save_map(&self.map, map, Some(log_odds), &SaveOptions::default())?;
        Ok(())
    }
}

/// Drives until the exploration ends; what it learns is saved on the way.
fn drive<B, S, C, K>(
    runner: &mut Runner<B, S, C, K>,
    explore: &mut Explore,
    mut log: &LogWriter,
    interrupt: &Interrupt,
    files: &Files,
    output: &Output,
) -> anyhow::Result<nav::Outcome>
where
    B: DifferentialDrive,
    S: RangeFinder,
    C: Camera,
    K: Clock,
{
    let (mut saved, mut stops) = (None::<Instant>, 0);
    loop {
        let mut ended = None;
        let news = explore.seen().stops().len();
        let due = saved.is_none_or(|at| at.elapsed() >= SAVE_EVERY);
        if news != stops && due {
            let seen = explore.seen();
            // a full disk does not end the mission: the map is in memory, and is tried again
            if let Err(error) = files.save(&seen.map(), seen.log_odds(), seen.shots()) {
                output.stage(format!("not saved: {error:#}"));
            } else {
                output.stage(format!("exploring: {news} stops"));
            }
            (saved, stops) = (Some(Instant::now()), news);
        }
        if interrupt.came() {
            ended = Some(runner.run(explore, &mut log, &|| true));
        } else if let Some(outcome) = runner.step(explore, &mut log) {
            ended = Some(outcome);
        }
        if let Some(outcome) = ended {
            return Ok(outcome);
        }
    }
}

/// The final map, saved.
fn finish(explore: &Explore, files: &Files) -> anyhow::Result<OccupancyMap> {
    let grid = explore.map()?;
    let map = grid.to_occupancy_map(FREE_AT_MOST, OCCUPIED_AT_LEAST);
    files.save(&map, grid.log_odds(), explore.seen().shots())?;
    Ok(map)
}

/// Roadmap and picture of the final map.
fn roadmap(
    map: &OccupancyMap,
    explore: &Explore,
    params: &ExploreParams,
    files: &Files,
) -> anyhow::Result<Roadmap> {
    let radius = params.itinerary.reach.radius;
    let graph: VoronoiGraph = super::graph::roadmap(&FreeSpace::from_map(map), radius)?;
    let text = RouteGraph::from_voronoi(&graph).to_geojson()?;
    write_whole(&files.graph, &text).with_context(|| format!("{}", files.graph.display()))?;
    let mut scene = Scene::of_map(map);
    super::graph::draw(&mut scene, &graph);
    let stops: Vec<Point2> = explore.seen().stops().collect();
    for &stop in &stops {
        scene.dot(stop, Color(0, 90, 200), 2.0);
    }
    scene.note(Color(0, 90, 200), format!("{} stops", stops.len()));
    picture::save(&scene, &files.picture).context("picture")?;
    Ok(Roadmap::of(&graph))
}

fn map_answer(map: &OccupancyMap, explore: &Explore, files: &Files) -> MapAnswer {
    let count = |state| {
        let values = map.values().iter();
        values.filter(|&&v| map.classify(v) == state).count()
    };
    MapAnswer {
        file: files.map.clone(),
        free: count(occgrid::CellState::Free),
        occupied: count(occgrid::CellState::Occupied),
        unknown: count(occgrid::CellState::Unknown),
        shots: explore.seen().shots().len(),
    }
}

fn drive_answer<B, S, C, K>(
    runner: &Runner<B, S, C, K>,
    explore: &Explore,
    simulation: Option<&Simulation>,
) -> DriveAnswer
where
    B: DifferentialDrive,
    S: RangeFinder,
    C: Camera,
    K: Clock,
{
    if let Some(simulation) = simulation {
        let Truth {
            time,
            collisions,
            least_clearance,
            driven,
            ..
        } = simulation.truth();
        return DriveAnswer {
            collisions: Some(collisions),
            min_clearance_m: Some(least_clearance),
            distance_m: driven,
            time_s: time,
        };
    }
    let stops: Vec<Point2> = explore.seen().stops().collect();
    DriveAnswer {
        collisions: None,
        min_clearance_m: None,
        distance_m: stops.windows(2).map(|s| s[0].distance(s[1])).sum(),
        time_s: runner.filter().estimate().stamp,
    }
}

fn explore_answer(explore: &Explore) -> ExploreAnswer {
    let tally = explore.tally();
    ExploreAnswer {
        stops: explore.seen().stops().len(),
        along_walls: tally.along_walls,
        at_frontiers: tally.at_frontiers,
        loops_closed: tally.loops_closed,
        blocked: tally.blocked,
    }
}

/// An exploration that ran out of time, or was interrupted, has a map all the same.
fn ended_well(outcome: &nav::Outcome) -> bool {
    matches!(
        outcome,
        nav::Outcome::Done | nav::Outcome::BudgetOver | nav::Outcome::Interrupted
    )
}

fn words(outcome: &nav::Outcome) -> String {
    match outcome {
        nav::Outcome::Done => "done".into(),
        nav::Outcome::BudgetOver => "budget over".into(),
        nav::Outcome::GaveUp(why) => format!("gave up: {why}"),
        nav::Outcome::Stopped(cause) => format!("stopped: {cause}"),
        nav::Outcome::Interrupted => "interrupted".into(),
    }
}

fn text(answer: &Answer) -> String {
    let (map, drive, explore) = (&answer.map, &answer.drive, &answer.explore);
    format!(
        "{}: {} stops ({} along walls, {} at frontiers), {} loops closed, {:.1} m in {:.0} s\n\
         {} free, {} occupied, {} unknown cells from {} shots; roadmap of {} nodes and {} arcs\n\
         map in {}",
        answer.outcome,
        explore.stops,
        explore.along_walls,
        explore.at_frontiers,
        explore.loops_closed,
        drive.distance_m,
        drive.time_s,
        map.free,
        map.occupied,
        map.unknown,
        map.shots,
        answer.graph.nodes,
        answer.graph.arcs,
        map.file.display()
    )
}
