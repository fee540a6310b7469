//! `mobot drive`: to a goal on a map, with any devices.

use std::path::Path;

use anyhow::{Context as _, bail};
use mobot_hw::sim::{RobotParams, Simulation};
use mobot_hw::{Camera, Clock, DifferentialDrive, RangeFinder};
use monocal::{DeriveParams, FloorCamera, FloorPlan, LocateParams};
use occgrid::{
    LoadOptions, MapMode, OccupancyMap, Point2, Pose2, SaveOptions, SonarModel, load_map, save_map,
};
use serde::Serialize;

use crate::args::DriveArgs;
use crate::interrupt::Interrupt;
use crate::nav::{
    Devices, Drive, DriveParams, Entry, Event, Goal, Outcome, RunLog, Runner, RunnerParams, Sight,
    StopCause, Trouble, wrap,
};
use crate::output::{self, Output, write_whole};
use crate::run_log::{LogParams, LogWriter, MissionLog, Recipe, SonarFrame};
use crate::uri;

/// The largest floor plan [bytes].
const MOST_PLAN_BYTES: u64 = 64 << 20;
/// One sigma of a floor plan that somebody drew, and of one that a sonar's map gave [m].
const PLAN_SIGMAS: [f64; 2] = [0.01, 0.04];

#[derive(Serialize)]
struct Answer {
    ok: bool,
    outcome: String,
    drive: DriveAnswer,
    localization: LocalizationAnswer,
    elapsed_s: f64,
    stops: usize,
}

#[derive(Serialize)]
struct DriveAnswer {
    reached: bool,
    collisions: u64,
    /// Simulated robots alone know.
    min_clearance_m: Option<f64>,
    distance_m: f64,
    pose: [f64; 3],
    goal: [f64; 2],
}

/// By the truth of a simulated robot; for others there is none.
#[derive(Serialize)]
struct LocalizationAnswer {
    mean_m: Option<f64>,
    max_m: Option<f64>,
    odometry_only_max_m: Option<f64>,
}

pub(super) fn run(args: &DriveArgs, output: &Output) -> anyhow::Result<output::Outcome> {
    let radius = super::checked_radius(args.radius)?;
    if radius < 0.02 {
        bail!("--radius: expected at least 0.02 m, found {radius}");
    }
    if args.budget.is_nan() || args.budget <= 0.0 {
        bail!("--budget: expected a time above 0 s, found {}", args.budget);
    }
    output.stage(format!("reading {}", args.map.display()));
    let map = load_map(&args.map, &LoadOptions::default())?.map;
    let plan = floor_plan(args.plan.as_deref(), &map)?;
    let interrupt = Interrupt::watch().context("signals")?;
    std::fs::create_dir_all(&args.out).with_context(|| format!("{}", args.out.display()))?;
    let opened = uri::open(&args.devices)?;
    let eye = match (&args.camera_file, &opened.devices.camera) {
        (Some(path), Some(_)) => Some(FloorCamera::load(path)?),
        (None, Some(_)) if opened.simulation.is_some() => Some(simulated_eye()?),
        (None, Some(_)) => bail!("--camera: expected --camera-file CAMERA.json with it"),
        (_, None) => None,
    };
    let recipe = recipe(args, &map, eye.as_ref())?;
    let path = args.out.join(LOG);
    let log = MissionLog::begin(&path, drawn(&opened.sensor), &recipe, opened.again)
        .with_context(|| format!("{}", path.display()))?;
    let plan_sigma = PLAN_SIGMAS[usize::from(args.plan.is_none())];
    let sight = eye.map(|eye| {
        let params = LocateParams {
            plan_sigma,
            ..LocateParams::default()
        };
        Sight::new(eye, plan.clone(), params)
    });
    let sight = sight.transpose().context("camera")?;
    let [x, y, theta] = args.start;
    let job = Job {
        map,
        plan,
        sight,
        start: Pose2::new(x, y, theta),
        goal: Goal {
            place: Point2::new(args.to.place[0], args.to.place[1]),
            heading: args.to.heading,
        },
        radius,
        sensor: opened.sensor,
        budget: args.budget,
    };
    let devices = log.recorded(opened.devices);
    let truth = opened.simulation.as_ref();
    let mut tally = Tally::new(truth, job.start, log.writer(), output);
    let done = driven(devices, job, &mut tally, &|| {
        interrupt.came() || log.interrupts()
    })?;
    log.finish()
        .with_context(|| format!("{}", path.display()))?;
    save(&args.out, &done)?;
    output.answer(&done.answer, || text(&done.answer, &args.out))?;
    Ok(match done.outcome {
        Outcome::Done | Outcome::Interrupted => output::Outcome::Done,
        _ => output::Outcome::No,
    })
}

fn floor_plan(path: Option<&Path>, map: &OccupancyMap) -> anyhow::Result<FloorPlan> {
    let Some(path) = path else {
        return Ok(FloorPlan::from_map(map, &DeriveParams::default()));
    };
    let text = super::read_text(path, MOST_PLAN_BYTES)?;
    FloorPlan::from_geojson(&text).with_context(|| format!("{}", path.display()))
}

/// All that the decisions of this drive depend on, but for what its devices will say.
fn recipe(
    args: &DriveArgs,
    map: &OccupancyMap,
    eye: Option<&FloorCamera>,
) -> anyhow::Result<Recipe> {
    let devices = &args.devices;
    let [x, y, theta] = args.start;
    let mut to = format!("{},{}", args.to.place[0], args.to.place[1]);
    if let Some(heading) = args.to.heading {
        to += &format!(",{heading}");
    }
    let mut recipe = Recipe::of("drive")
        .with("--base", &devices.base)
        .with("--sonar", &devices.sonar)
        .with("--camera", &devices.camera)
        .with("--start", format!("{x},{y},{theta}"))
        .with("--to", to)
        .with("--radius", args.radius)
        .with("--budget", args.budget);
    let folder = super::scratch::Scratch::new()?;
    let yaml = folder.0.join("map.yaml");
    // every value as it is
    let plain = SaveOptions {
        mode: MapMode::Raw,
        plain_names: true,
    };
    let saved = save_map(&yaml, map, None, &plain)?;
    recipe = recipe
        .with_file("--map", "map.yaml", std::fs::read(&yaml)?)
        .beside("map.pgm", std::fs::read(saved.image)?);
    if let Some(path) = &args.plan {
        let plan = super::read_text(path, MOST_PLAN_BYTES)?;
        recipe = recipe.with_file("--plan", "plan.geojson", plan.into_bytes());
    }
    if let Some(eye) = eye {
        recipe = recipe.with_file("--camera-file", "camera.json", eye.to_json().into_bytes());
    }
    Ok(recipe)
}

/// The simulated robot's camera, as marks on the floor would calibrate it.
fn simulated_eye() -> anyhow::Result<FloorCamera> {
    let model = RobotParams::default().camera;
    crate::nav::calibrated(&model).context("the simulated camera sees too few marks")
}

/// What is to be done.
struct Job {
    map: OccupancyMap,
    plan: FloorPlan,
    sight: Option<Sight>,
    start: Pose2,
    goal: Goal,
    radius: f64,
    sensor: SonarModel,
    budget: f64,
}

/// What came of it.
struct Driven {
    outcome: Outcome,
    answer: Answer,
    events: Vec<String>,
}

/// The run log: it is on disk up to the last moment, whatever ends the program.
const LOG: &str = "run.mcap";

/// Shots as they are drawn.
fn drawn(sensor: &SonarModel) -> LogParams {
    LogParams {
        sonar: SonarFrame {
            beam: sensor.beam_width,
            min_range: sensor.blanking,
            max_range: sensor.max_range,
            base_from_sonar: sensor.mount,
        },
        ..LogParams::default()
    }
}

fn driven<B, S, C, K>(
    devices: Devices<B, S, C, K>,
    job: Job,
    tally: &mut Tally<'_>,
    interrupted: &dyn Fn() -> bool,
) -> anyhow::Result<Driven>
where
    B: DifferentialDrive,
    S: RangeFinder,
    C: Camera,
    K: Clock,
{
    let params = RunnerParams::of(job.radius, job.sensor);
    let mut drive = Drive::new(
        job.map.clone(),
        job.goal,
        DriveParams {
            budget: job.budget,
            ..DriveParams::of(job.radius)
        },
    );
    let mut runner = Runner::new(devices, job.start, params)?.knowing(job.map, job.plan, job.sight);
    let began = runner.now();
    let outcome = runner.run(&mut drive, tally, interrupted);
    let estimate = runner.filter().estimate();
    let pose = estimate.map_from_base;
    let reached = outcome == Outcome::Done;
    let truth = tally.simulation.map(Simulation::truth);
    let answer = Answer {
        ok: reached || outcome == Outcome::Interrupted,
        outcome: described(&outcome),
        drive: DriveAnswer {
            reached,
            collisions: truth.map_or(tally.bumps, |t| t.collisions),
            min_clearance_m: truth.map(|t| t.least_clearance),
            distance_m: truth.map_or(tally.driven, |t| t.driven),
            pose: [pose.x, pose.y, wrap(pose.theta)],
            goal: [job.goal.place.x, job.goal.place.y],
        },
        localization: tally.localization(),
        elapsed_s: runner.now() - began,
        stops: tally.stops,
    };
    Ok(Driven {
        outcome,
        answer,
        events: std::mem::take(&mut tally.events),
    })
}

fn described(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Done => "arrived".to_owned(),
        Outcome::BudgetOver => "the time is over".to_owned(),
        Outcome::GaveUp(why) => why.clone(),
        Outcome::Stopped(cause) => format!("stopped for a person to look: {cause}"),
        Outcome::Interrupted => "interrupted".to_owned(),
    }
}

fn save(folder: &Path, done: &Driven) -> anyhow::Result<()> {
    let mut events = String::new();
    for line in &done.events {
        events += line;
        events.push('\n');
    }
    let named = |name: &str| folder.join(name);
    let summary = serde_json::to_string_pretty(&done.answer)? + "\n";
    for (name, text) in [("events.jsonl", &events), ("summary.json", &summary)] {
        let path = named(name);
        write_whole(&path, text.as_bytes()).with_context(|| format!("{}", path.display()))?;
    }
    Ok(())
}

fn text(answer: &Answer, folder: &Path) -> String {
    let mut text = format!(
        "{} at ({:.2}, {:.2}) after {:.1} m and {:.0} s",
        answer.outcome,
        answer.drive.pose[0],
        answer.drive.pose[1],
        answer.drive.distance_m,
        answer.elapsed_s
    );
    if let (Some(mean), Some(most)) = (answer.localization.mean_m, answer.localization.max_m) {
        text += &format!(
            "\npose off by {:.1} cm on average, {:.1} cm at most; collisions {}",
            mean * 100.0,
            most * 100.0,
            answer.drive.collisions
        );
    }
    text + &format!("\nleft in {}", folder.display())
}

/// Counts what happens, and compares with the truth where there is one.
struct Tally<'a> {
    simulation: Option<&'a Simulation>,
    map_from_world: Pose2,
    log: &'a LogWriter,
    output: &'a Output,
    events: Vec<String>,
    stops: usize,
    bumps: u64,
    driven: f64,
    last: Option<Pose2>,
    errors: (f64, f64, u64),
    odometry_most: f64,
}

impl<'a> Tally<'a> {
    fn new(
        simulation: Option<&'a Simulation>,
        start: Pose2,
        log: &'a LogWriter,
        output: &'a Output,
    ) -> Self {
        let world_from_base = simulation.map_or_else(Pose2::default, |s| s.truth().map_from_base);
        Self {
            simulation,
            map_from_world: start.compose(world_from_base.inverse()),
            log,
            output,
            events: Vec::new(),
            stops: 0,
            bumps: 0,
            driven: 0.0,
            last: None,
            errors: (0.0, 0.0, 0),
            odometry_most: 0.0,
        }
    }

    /// Distance of a pose from the true one [m].
    fn off(&self, pose: Pose2) -> Option<f64> {
        let truth = self.simulation?.truth().map_from_base;
        let truth = self.map_from_world.compose(truth);
        Some(truth.position().distance(pose.position()))
    }

    fn localization(&self) -> LocalizationAnswer {
        let (sum, most, count) = self.errors;
        let some = |value: f64| (count > 0).then_some(value);
        LocalizationAnswer {
            mean_m: some(sum / count as f64),
            max_m: some(most),
            odometry_only_max_m: some(self.odometry_most),
        }
    }
}

impl RunLog for Tally<'_> {
    fn record(&mut self, time: f64, entry: Entry<'_>) {
        (&mut &*self.log).record(time, entry);
        match entry {
            Entry::Event(event) => {
                self.stops += usize::from(matches!(event, Event::Stop(_)));
                let bump = StopCause::Trouble(Trouble::Bump);
                self.bumps += u64::from(matches!(event, Event::Stop(cause) if *cause == bump));
                let line = serde_json::json!({ "time": time, "event": event.to_string() });
                self.events.push(line.to_string());
                self.output.stage(event.to_string());
            }
            Entry::Pose(estimate) => {
                if let Some(off) = self.off(estimate.map_from_base) {
                    self.errors.0 += off;
                    self.errors.1 = self.errors.1.max(off);
                    self.errors.2 += 1;
                }
            }
            Entry::Odometry(pose) => {
                if let Some(last) = self.last.replace(pose) {
                    self.driven += last.position().distance(pose.position());
                }
                if let Some(off) = self.off(pose) {
                    self.odometry_most = self.odometry_most.max(off);
                }
            }
            _ => {}
        }
    }
}
