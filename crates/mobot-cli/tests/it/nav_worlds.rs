//! Buildings for missions: their true map, floor plan and camera, and what a mission scored in them.

use std::path::PathBuf;

use mobot_cli::nav::{
    Cue, Devices, Entry, Event, LocalizerParams, Outcome, PoseEstimate, RunLog, Runner,
    RunnerParams, Sight, calibrated,
};
use mobot_hw::sim::{
    BaseParams, RobotParams, SimBase, SimCamera, SimClock, SimPan, SimSonar, Simulation, World,
};
use mobot_hw::{Turret, Twist2};
use monocal::{FloorPlan, LocateParams};
use nalgebra::{Matrix3, Vector3};
use occgrid::{Cell, MapFrame, OccupancyMap, Point2, Pose2};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// Side of a cell of the true maps [m].
const CELL: f64 = 0.05;
/// Features are in view where a frame corrected the pose so lately [s].
const IN_VIEW: f64 = 2.0;
/// Height of the body [m].
const BODY: f64 = 1.2;

pub(crate) type SimRunner = Runner<SimBase, Turret<SimSonar, SimPan>, SimCamera, SimClock>;

/// A building with what there is to know of it.
#[derive(Debug, Clone)]
pub(crate) struct Site {
    pub(crate) world: World,
    pub(crate) map: OccupancyMap,
    pub(crate) plan: FloorPlan,
}

pub(crate) fn world_text(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../testdata/worlds")
        .join(format!("{name}.toml"));
    std::fs::read_to_string(path).expect("a world file")
}

impl Site {
    /// A built-in building that nobody walks in.
    pub(crate) fn without_people(name: &str) -> Self {
        let text = world_text(name);
        let end = text.find("[[people]]").unwrap_or(text.len());
        Self::of(World::from_toml(&text[..end]).expect("a world"))
    }

    fn of(world: World) -> Self {
        let outline = world.floor_outline();
        let map = true_map(&world, &outline);
        let plan = FloorPlan {
            walls: outline
                .into_iter()
                .filter(|[a, b]| a.distance(*b) > 0.05)
                .collect(),
            door_corners: world.door_corners().iter().map(|c| c.position).collect(),
        };
        Self { world, map, plan }
    }

    /// A free place with this much room, drawn from the whole reachable floor.
    pub(crate) fn place(&self, rng: &mut Pcg64, room: f64) -> Point2 {
        let frame = self.map.frame();
        loop {
            let cell = Cell::new(
                rng.random_range(0..frame.width()),
                rng.random_range(0..frame.height()),
            );
            let place = frame.center_of(cell);
            let free = self.map.values()[frame.index(cell)] == 0;
            if free && self.world.room_at(place, 2.0, BODY) >= room {
                return place;
            }
        }
    }
}

/// Every cell that a solid touches is occupied; what cannot be reached from the start is unknown.
fn true_map(world: &World, outline: &[[Point2; 2]]) -> OccupancyMap {
    let ends = || outline.iter().flatten();
    let least = |f: fn(&Point2) -> f64| ends().map(f).fold(f64::INFINITY, f64::min);
    let most = |f: fn(&Point2) -> f64| ends().map(f).fold(f64::NEG_INFINITY, f64::max);
    let [x0, y0] = [least(|p| p.x) - 0.3, least(|p| p.y) - 0.3];
    let size = [most(|p| p.x) + 0.3 - x0, most(|p| p.y) + 0.3 - y0];
    let [width, height] = size.map(|s| (s / CELL).ceil() as u32);
    let frame = MapFrame::new(width, height, CELL, Pose2::new(x0, y0, 0.0)).expect("a frame");
    let mut values = vec![-1_i8; frame.cell_count()];
    let free = |cell: Cell| {
        world.room_at(frame.center_of(cell), 0.2, BODY) > CELL * std::f64::consts::FRAC_1_SQRT_2
    };
    let start = frame.cell_at(world.start().position()).expect("inside");
    let mut open = vec![start];
    values[frame.index(start)] = 0;
    while let Some(cell) = open.pop() {
        let (col, row) = (i64::from(cell.col), i64::from(cell.row));
        for (dc, dr) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let (c, r) = (col + dc, row + dr);
            if c < 0 || r < 0 || c >= i64::from(width) || r >= i64::from(height) {
                continue;
            }
            let next = Cell::new(c as u32, r as u32);
            let value = &mut values[frame.index(next)];
            if *value != -1 {
                continue;
            }
            if free(next) {
                *value = 0;
                open.push(next);
            } else {
                *value = 100;
            }
        }
    }
    OccupancyMap::new(frame, values, 25, 65)
}

/// Box and Muller.
pub(crate) fn normal(rng: &mut Pcg64) -> f64 {
    let (a, b): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// The robot of a seed: its wheels and its slip are not what they are said to be.
pub(crate) fn robot(rng: &mut Pcg64) -> RobotParams {
    let wheel = |rng: &mut Pcg64| 1.0 + 0.01 * normal(rng).clamp(-2.0, 2.0);
    let base = BaseParams {
        wheel_error: [wheel(rng), wheel(rng)],
        track_error: 1.0 + 0.02 * normal(rng).clamp(-2.0, 2.0),
        slip: [0.01 * rng.random::<f64>(), 0.01 * rng.random::<f64>()],
        ..BaseParams::default()
    };
    RobotParams {
        base,
        ..RobotParams::default()
    }
}

/// What a robot with a camera did, by what is true.
#[derive(Debug)]
pub(crate) struct Score {
    simulation: Simulation,
    pub(crate) events: Vec<(f64, Event)>,
    /// Position errors while driving [m].
    pub(crate) errors: Vec<f64>,
    pub(crate) heading_errors: Vec<f64>,
    pub(crate) odometry_errors: Vec<f64>,
    pub(crate) nees: Vec<f64>,
    /// By camera, echoes and sweeps.
    pub(crate) corrections: [u32; 3],
    pub(crate) refused: [u32; 3],
    /// Position errors [m] within 2 s of a frame that corrected the pose.
    pub(crate) errors_in_view: Vec<f64>,
    in_view: f64,
    /// Commands, for comparing runs.
    pub(crate) commands: Vec<(f64, Twist2)>,
}

impl Score {
    pub(crate) fn new(simulation: &Simulation) -> Self {
        Self {
            simulation: simulation.clone(),
            events: Vec::new(),
            errors: Vec::new(),
            heading_errors: Vec::new(),
            odometry_errors: Vec::new(),
            nees: Vec::new(),
            corrections: [0; 3],
            refused: [0; 3],
            errors_in_view: Vec::new(),
            in_view: f64::NEG_INFINITY,
            commands: Vec::new(),
        }
    }

    fn pose(&mut self, time: f64, estimate: &PoseEstimate) {
        let truth = self.simulation.truth();
        let at = estimate.map_from_base;
        let off = Vector3::new(
            at.x - truth.map_from_base.x,
            at.y - truth.map_from_base.y,
            wrapped(at.theta - truth.map_from_base.theta),
        );
        let error = off.x.hypot(off.y);
        self.errors.push(error);
        if time - self.in_view <= IN_VIEW {
            self.errors_in_view.push(error);
        }
        self.heading_errors.push(off.z.abs());
        let covariance = Matrix3::from_fn(|i, j| estimate.covariance[i][j]);
        if let Some(inverse) = covariance.try_inverse() {
            self.nees.push(off.dot(&(inverse * off)));
        }
    }
}

pub(crate) fn wrapped(angle: f64) -> f64 {
    angle - (angle / std::f64::consts::TAU).round() * std::f64::consts::TAU
}

impl RunLog for Score {
    fn record(&mut self, time: f64, entry: Entry<'_>) {
        match entry {
            Entry::Event(event) => self.events.push((time, event.clone())),
            Entry::Pose(estimate) => self.pose(time, estimate),
            Entry::Odometry(pose) => {
                let truth = self.simulation.truth().map_from_base;
                let off = pose.position().distance(truth.position());
                self.odometry_errors.push(off);
            }
            Entry::Command(command) => self.commands.push((time, command)),
            Entry::Correction(correction) => {
                let kind = match correction.cue {
                    Cue::Camera => 0,
                    Cue::Sonar => 1,
                    Cue::Sweep => 2,
                };
                if kind == 0 && correction.accepted {
                    self.in_view = time;
                }
                self.corrections[kind] += u32::from(correction.accepted);
                self.refused[kind] += u32::from(!correction.accepted);
            }
            _ => {}
        }
    }
}

/// Where an outcome ended, by what is true.
#[derive(Debug, Clone)]
pub(crate) struct Ended {
    pub(crate) outcome: Outcome,
    pub(crate) off: f64,
    pub(crate) turned: f64,
    pub(crate) collisions: u64,
    pub(crate) clearance: f64,
    pub(crate) driven: f64,
    pub(crate) time: f64,
}

/// A robot that knows the building, at the world's start, its pose known to a centimetre.
pub(crate) fn runner(
    site: &Site,
    params: RobotParams,
    camera: bool,
    seed: u64,
    rng: &mut Pcg64,
) -> (Simulation, SimRunner) {
    let simulation = Simulation::new(site.world.clone(), params, seed).expect("a robot");
    let start = simulation.truth().map_from_base;
    let start = Pose2::new(
        start.x + 0.01 * normal(rng),
        start.y + 0.01 * normal(rng),
        start.theta + 0.008 * normal(rng),
    );
    let eye = camera.then(|| calibrated(&params.camera).expect("a camera"));
    let sight = eye.map(|eye| {
        let params = LocateParams {
            // it is true
            plan_sigma: 0.003,
            ..LocateParams::default()
        };
        Sight::new(eye, site.plan.clone(), params).expect("a mounting")
    });
    let devices = Devices {
        base: simulation.base(),
        sonar: simulation.turret(),
        camera: camera.then(|| simulation.camera()),
        clock: simulation.clock(),
    };
    let runner_params = RunnerParams {
        localizer: LocalizerParams::default(),
        ..RunnerParams::default()
    };
    let runner = Runner::new(devices, start, runner_params)
        .expect("a runner")
        .knowing(site.map.clone(), site.plan.clone(), sight);
    (simulation, runner)
}

pub(crate) fn seeded(seed: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed)
}

/// How many seeds to run: few, or many in the long form (`MOBOT_LONG=1`), or `MOBOT_SEEDS`.
pub(crate) fn seeds(few: u64, many: u64) -> u64 {
    let asked = std::env::var("MOBOT_SEEDS")
        .ok()
        .and_then(|n| n.parse().ok());
    let long = std::env::var("MOBOT_LONG").is_ok_and(|v| v == "1");
    asked.unwrap_or(if long { many } else { few })
}
