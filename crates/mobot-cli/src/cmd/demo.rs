//! `mobot demo`: the whole mission in a simulated building: explore, map, plan, drive there and back; and a page
//! about it.

mod page;
mod witness;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context as _, bail};
use mobot_hw::Turret;
use mobot_hw::sim::{
    BaseParams, RobotParams, SimBase, SimCamera, SimClock, SimPan, SimSonar, Simulation, World,
};
use monocal::{DeriveParams, FloorPlan, LocateParams};
use occgrid::{
    FREE_AT_MOST, OCCUPIED_AT_LEAST, OccupancyMap, Point2, Pose2, SaveOptions, SonarModel,
    save_map, write_log,
};
use serde::Serialize;
use voronoi_plan::geojson::RouteGraph;
use voronoi_plan::{ClearanceField, FreeSpace, Plan, Planner, VoronoiGraph};

use super::graph::Roadmap;
use crate::args::DemoArgs;
use crate::interrupt::Interrupt;
use crate::nav::{
    self, Devices, Drive, DriveParams, Explore, ExploreParams, FilterParams, Goal, Runner,
    RunnerParams, Sight,
};
use crate::output::{Outcome, Output, write_whole};
use crate::picture::{self, Color, Scene};
use crate::report::Moment;
use crate::run_log::{LogParams, LogWriter};
use crate::score::{Floor, JudgedRobot, MapScore};
use witness::Witness;

#[derive(Serialize)]
struct Answer {
    ok: bool,
    outcome: String,
    map: MapAnswer,
    graph: Roadmap,
    route: RouteAnswer,
    drive: DriveAnswer,
    localization: Localization,
    #[serde(skip_serializing_if = "Option::is_none")]
    paper: Option<page::PaperAnswer>,
    simulated_s: f64,
    elapsed_s: f64,
}

#[derive(Serialize)]
struct MapAnswer {
    explored: String,
    stops: usize,
    shots: usize,
    score: Option<MapScore>,
}

#[derive(Serialize)]
struct RouteAnswer {
    goal: [f64; 2],
    length_m: f64,
    clearance_m: f64,
}

#[derive(Serialize)]
struct DriveAnswer {
    reached: bool,
    back: bool,
    /// Distance of the robot from the goal and from its start when it said that it was there [m].
    off_m: [f64; 2],
    collisions: u64,
    min_clearance_m: f64,
    distance_m: f64,
}

/// Errors of the position while driving on the map, by what is true.
#[derive(Serialize, Clone, Copy)]
struct Localization {
    mean_m: f64,
    p95_m: f64,
    max_m: f64,
    odometry_only_max_m: f64,
    /// Share of the moments in which the truth lay within the 95 % bound.
    within_bound: f64,
}

type SimRunner = Runner<SimBase, Turret<SimSonar, SimPan>, SimCamera, SimClock>;

/// Room on either side of the body for which routes are certified [m].
const ROOM: f64 = 0.175;
/// One sigma of what is exact, for a filter that divides by it.
const EXACT: f64 = 1e-6;
/// Steps from frame to frame while nothing is known that a frame could be compared with: for the log alone.
const FRAMES_EXPLORING: u32 = 60;
/// One sigma of a floor plan that a sonar's map gave [m].
const PLAN_SIGMA: f64 = 0.04;

pub(super) fn run(args: &DemoArgs, output: &Output) -> anyhow::Result<Outcome> {
    if args.budget.is_nan() || args.budget <= 0.0 {
        bail!("--budget: expected a time above 0 s, found {}", args.budget);
    }
    let began = Instant::now();
    let world = crate::world::load(&args.world, None)?;
    let (calibrated, worn) = robots();
    let interrupt = Interrupt::watch().context("signals")?;
    let interrupted = || interrupt.came();
    std::fs::create_dir_all(&args.out).with_context(|| format!("{}", args.out.display()))?;
    let file = |name: &str| args.out.join(name);

    let first = Simulation::new(world.clone(), calibrated, args.seed)?;
    let log = run_log(&file("explore.mcap"))?;
    let mut witness = Witness::new(&log, &first, output);
    let (explore, explored) =
        explore(&first, &calibrated, args.budget, &mut witness, &interrupted)?;
    let made = map(&explore, &calibrated, &args.out, &mut witness)?;
    log.finish().context("explore.mcap")?;

    let second = Simulation::new(world.clone(), worn, args.seed)?;
    let log = run_log(&file("drive.mcap"))?;
    let mut witness = witness.on(&log, &second);
    let there = farthest(&made);
    let driven = drive(
        &second,
        &worn,
        &made,
        there.as_ref(),
        &mut witness,
        &interrupted,
    )?;
    log.finish().context("drive.mcap")?;

    let score = score(&made.map, &world, &worn, witness.map_from_world());
    let truths = [first.truth(), second.truth()];
    let collisions = truths.iter().map(|t| t.collisions).sum();
    let localization = localization(&witness.moments, driven.began);
    let paper = args
        .paper
        .then(|| page::paper(&made.map, made.radius, &args.out))
        .transpose()?;
    let answer = Answer {
        ok: driven.reached && driven.back && collisions == 0,
        outcome: driven.outcome,
        map: MapAnswer {
            explored: words(&explored),
            stops: explore.seen().stops().len(),
            shots: explore.seen().shots().len(),
            score,
        },
        graph: Roadmap::of(&made.graph),
        route: there.as_ref().map_or(
            RouteAnswer {
                goal: [f64::NAN; 2],
                length_m: 0.0,
                clearance_m: 0.0,
            },
            |route| RouteAnswer {
                goal: route.points.last().map_or([f64::NAN; 2], |p| [p.x, p.y]),
                length_m: route.length,
                clearance_m: route.clearance,
            },
        ),
        drive: DriveAnswer {
            reached: driven.reached,
            back: driven.back,
            off_m: driven.off,
            collisions,
            min_clearance_m: truths[0].least_clearance.min(truths[1].least_clearance),
            distance_m: truths.iter().map(|t| t.driven).sum(),
        },
        localization,
        paper,
        simulated_s: truths.iter().map(|t| t.time).sum(),
        elapsed_s: began.elapsed().as_secs_f64(),
    };
    output.stage("writing the page");
    let walls = world.floor_outline();
    let html = page::html(&answer, args, &made, &walls, &worn, &witness)?;
    write(&file("report.html"), html.as_bytes())?;
    write(&file("events.jsonl"), &page::events(&witness.events))?;
    write(
        &file("summary.json"),
        (serde_json::to_string_pretty(&answer)? + "\n").as_bytes(),
    )?;
    output.answer(&answer, || text(&answer, &args.out))?;
    Ok(if answer.ok {
        Outcome::Done
    } else {
        Outcome::No
    })
}

/// The robot on the day it explores and on the day it drives. Nothing corrects the pose while the building is
/// unknown, so that on the first its wheels are exact; on the second they are what simulated wheels are.
fn robots() -> (RobotParams, RobotParams) {
    let worn = RobotParams::default();
    let base = BaseParams {
        radius: worn.base.radius,
        height: worn.base.height,
        ..BaseParams::ideal()
    };
    (RobotParams { base, ..worn }, worn)
}

fn run_log(path: &Path) -> anyhow::Result<LogWriter> {
    LogWriter::create(path, LogParams::default()).with_context(|| format!("{}", path.display()))
}

fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    write_whole(path, bytes).with_context(|| format!("{}", path.display()))
}

/// What the exploration left.
struct Made {
    map: OccupancyMap,
    graph: VoronoiGraph,
    plan: FloorPlan,
    radius: f64,
}

/// How the drives ended.
struct Driven {
    outcome: String,
    /// When the first began [s].
    began: f64,
    reached: bool,
    back: bool,
    off: [f64; 2],
}

fn devices(
    simulation: &Simulation,
) -> Devices<SimBase, Turret<SimSonar, SimPan>, SimCamera, SimClock> {
    Devices {
        base: simulation.base(),
        sonar: simulation.turret(),
        camera: Some(simulation.camera()),
        clock: simulation.clock(),
    }
}

fn sonar(robot: &RobotParams) -> SonarModel {
    SonarModel {
        blanking: robot.sonar.blanking,
        sigma: 0.05,
        mount: robot.base_from_sonar,
        ..ExploreParams::default().sonar
    }
}

fn explore<L: nav::RunLog>(
    simulation: &Simulation,
    robot: &RobotParams,
    budget: f64,
    witness: &mut Witness<'_, L>,
    interrupted: &dyn Fn() -> bool,
) -> anyhow::Result<(Explore, nav::Outcome)> {
    witness.say("exploring");
    let params = RunnerParams {
        frame_every: FRAMES_EXPLORING,
        filter: FilterParams {
            wheel_sigma: EXACT,
            track_sigma: EXACT,
            slip: EXACT,
            ..FilterParams::default()
        },
        ..RunnerParams::of(robot.base.radius, sonar(robot))
    };
    let mut runner = Runner::new(devices(simulation), Pose2::default(), params)?;
    let mut explore = Explore::new(ExploreParams {
        budget,
        ..ExploreParams::default()
    })?;
    let outcome = runner.run(&mut explore, witness, interrupted);
    Ok((explore, outcome))
}

/// Map, stages, roadmap and floor plan, saved.
fn map<L: nav::RunLog>(
    explore: &Explore,
    robot: &RobotParams,
    folder: &Path,
    witness: &mut Witness<'_, L>,
) -> anyhow::Result<Made> {
    witness.say("explaining all shots at once");
    let grid = explore.map()?;
    let map = grid.to_occupancy_map(FREE_AT_MOST, OCCUPIED_AT_LEAST);
    save_map(
        folder.join("map.yaml"),
        &map,
        Some(grid.log_odds()),
        &SaveOptions::default(),
    )?;
    let mut shots = Vec::new();
    write_log(&mut shots, explore.seen().shots())?;
    write(&folder.join("sonar.csv"), &shots)?;
    let model = toml::to_string(&sonar(robot))?;
    write(&folder.join("sensor.toml"), model.as_bytes())?;
    super::clean::stages(&map, false, &folder.join("stages"))?;
    let radius = robot.base.radius + ROOM;
    let graph = super::graph::roadmap(&FreeSpace::from_map(&map), radius)?;
    let text = RouteGraph::from_voronoi(&graph).to_geojson()?;
    write(&folder.join("graph.geojson"), &text)?;
    let mut scene = Scene::of_map(&map);
    super::graph::draw(&mut scene, &graph);
    picture::save(&scene, &folder.join("graph.svg")).context("picture")?;
    let plan = FloorPlan::from_map(&map, &DeriveParams::default());
    if !plan.is_empty() {
        write(&folder.join("plan.geojson"), plan.to_geojson().as_bytes())?;
    }
    Ok(Made {
        map,
        graph,
        plan,
        radius,
    })
}

/// The longest of the routes from the start to the nodes of the roadmap.
fn farthest(made: &Made) -> Option<voronoi_plan::Route> {
    let space = FreeSpace::from_map(&made.map);
    let planner = Planner::new(&space, &made.graph, ClearanceField::new(&space));
    let start = Point2::new(0.0, 0.0);
    let nodes = made.graph.nodes.iter();
    let routes = nodes.filter_map(|node| match planner.plan(start, node.point) {
        Plan::Ok(route) => Some(route),
        _ => None,
    });
    routes.max_by(|a, b| a.length.total_cmp(&b.length))
}

/// There and back.
fn drive<L: nav::RunLog>(
    simulation: &Simulation,
    robot: &RobotParams,
    made: &Made,
    there: Option<&voronoi_plan::Route>,
    witness: &mut Witness<'_, L>,
    interrupted: &dyn Fn() -> bool,
) -> anyhow::Result<Driven> {
    let mut driven = Driven {
        outcome: "nowhere to go".to_owned(),
        began: witness.time(),
        reached: false,
        back: false,
        off: [f64::NAN; 2],
    };
    let Some(goal) = there.and_then(|route| route.points.last()) else {
        return Ok(driven);
    };
    let params = LocateParams {
        plan_sigma: PLAN_SIGMA,
        ..LocateParams::default()
    };
    let eye = nav::calibrated(&robot.camera).context("the simulated camera sees too few marks")?;
    let sight = Sight::new(eye, made.plan.clone(), params).context("camera")?;
    let params = RunnerParams::of(robot.base.radius, sonar(robot));
    let mut runner = Runner::new(devices(simulation), Pose2::default(), params)?.knowing(
        made.map.clone(),
        made.plan.clone(),
        Some(sight),
    );
    let mut to = |place: Point2, witness: &mut Witness<'_, L>| {
        witness.say(format!("driving to ({:.2}, {:.2})", place.x, place.y));
        let outcome = go(&mut runner, made, place, witness, interrupted);
        let off = witness.truth().position().distance(place);
        (outcome == nav::Outcome::Done, off, words(&outcome))
    };
    (driven.reached, driven.off[0], driven.outcome) = to(*goal, witness);
    if driven.reached {
        (driven.back, driven.off[1], driven.outcome) = to(Point2::new(0.0, 0.0), witness);
    }
    Ok(driven)
}

fn go<L: nav::RunLog>(
    runner: &mut SimRunner,
    made: &Made,
    place: Point2,
    witness: &mut Witness<'_, L>,
    interrupted: &dyn Fn() -> bool,
) -> nav::Outcome {
    let goal = Goal {
        place,
        heading: None,
    };
    let params = DriveParams {
        budget: 900.0,
        ..DriveParams::of(made.radius - ROOM)
    };
    let mut drive = Drive::new(made.map.clone(), goal, params);
    runner.run(&mut drive, witness, interrupted)
}

fn words(outcome: &nav::Outcome) -> String {
    match outcome {
        nav::Outcome::Done => "done".into(),
        nav::Outcome::BudgetOver => "the time is over".into(),
        nav::Outcome::GaveUp(why) => format!("gave up: {why}"),
        nav::Outcome::Stopped(cause) => format!("stopped: {cause}"),
        nav::Outcome::Interrupted => "interrupted".into(),
    }
}

fn score(
    map: &OccupancyMap,
    world: &World,
    robot: &RobotParams,
    map_from_world: Pose2,
) -> Option<MapScore> {
    let judged = JudgedRobot {
        radius: robot.base.radius,
        height: robot.base.height,
    };
    let floor = Floor::of(world, judged)?;
    Some(MapScore::of(
        map,
        map_from_world.inverse(),
        world,
        &floor,
        judged,
    ))
}

fn localization(moments: &[Moment], began: f64) -> Localization {
    let off = |m: &Moment, pose: Pose2| {
        m.truth
            .map_or(f64::NAN, |truth| truth.position().distance(pose.position()))
    };
    let driving: Vec<&Moment> = moments.iter().filter(|m| m.time >= began).collect();
    let mut errors: Vec<f64> = driving.iter().map(|m| off(m, m.estimate)).collect();
    errors.sort_by(f64::total_cmp);
    let count = errors.len().max(1) as f64;
    let within = driving.iter().filter(|m| off(m, m.estimate) <= m.bound);
    Localization {
        mean_m: errors.iter().sum::<f64>() / count,
        p95_m: errors.get(errors.len() * 95 / 100).copied().unwrap_or(0.0),
        max_m: errors.last().copied().unwrap_or(0.0),
        odometry_only_max_m: driving
            .iter()
            .map(|m| off(m, m.odometry))
            .fold(0.0, f64::max),
        within_bound: within.count() as f64 / count,
    }
}

fn text(answer: &Answer, folder: &Path) -> String {
    let Answer {
        map,
        graph,
        route,
        drive,
        localization,
        ..
    } = answer;
    let score = map.score.map_or_else(String::new, |score| {
        format!(
            "; {:.1} % of the reachable floor, walls off by {:.1} cm on average",
            100.0 * score.coverage,
            100.0 * score.offset_mean_m
        )
    });
    format!(
        "explored: {} stops, {} shots ({}){score}\n\
         roadmap: {} nodes, {} arcs, least clearance {:.3} m; route of {:.1} m with {:.3} m on either side\n\
         there: {}, {:.1} cm off; back: {}, {:.1} cm off; {:.0} m driven in {:.0} s, collisions {}\n\
         pose off by {:.1} cm on average, {:.1} cm at most (by wheels alone {:.1} cm)\n\
         {:.1} s; the page about it: {}",
        map.stops,
        map.shots,
        map.explored,
        graph.nodes,
        graph.arcs,
        graph.min_clearance_m.unwrap_or(0.0),
        route.length_m,
        route.clearance_m,
        drive.reached,
        100.0 * drive.off_m[0],
        drive.back,
        100.0 * drive.off_m[1],
        drive.distance_m,
        answer.simulated_s,
        drive.collisions,
        100.0 * localization.mean_m,
        100.0 * localization.max_m,
        100.0 * localization.odometry_only_max_m,
        answer.elapsed_s,
        folder.join("report.html").display()
    )
}

/// The colour of lines that a camera sees.
const SEEN: Color = Color(0, 158, 115);
