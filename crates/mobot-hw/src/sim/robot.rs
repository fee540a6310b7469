//! One simulated robot in one building, and its virtual time.

use std::sync::{Arc, Mutex, MutexGuard};

use image::GrayImage;
use occgrid::{Point2, Pose2, Reading};
use thiserror::Error;

use super::base::{Base, BaseParams};
use super::camera::{Look, Renderer};
use super::lens::{CameraModel, CameraModelError};
use super::person;
use super::sonar::{Sonar, SonarParams};
use super::world::World;
use crate::dice::Dice;
use crate::{Bearings, Twist2};

/// The parts of a simulated robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotParams {
    /// The base.
    pub base: BaseParams,
    /// The sonar.
    pub sonar: SonarParams,
    /// Pose of the sonar's axle in the base frame; its heading is the pan's bearing 0.
    pub base_from_sonar: Pose2,
    /// The time from one firing to the next [s], above 0.
    pub sonar_cycle: f64,
    /// What the pan reaches.
    pub pan: Bearings,
    /// Speed of the pan [rad/s], above 0.
    pub pan_speed: f64,
    /// Time the pan swings after a turn [s].
    pub pan_settle: f64,
    /// The camera.
    pub camera: CameraModel,
    /// Its pictures.
    pub look: Look,
    /// Time between frames [s], above 0.
    pub frame_time: f64,
    /// From exposure to the program [s].
    pub frame_delay: f64,
}

impl Default for RobotParams {
    /// The paper's camera, a sonar that turns all round, a small round base.
    fn default() -> Self {
        Self {
            base: BaseParams::default(),
            sonar: SonarParams::default(),
            base_from_sonar: Pose2::new(0.0, 0.0, 0.0),
            sonar_cycle: 0.05,
            pan: Bearings {
                from: -std::f64::consts::PI,
                to: std::f64::consts::PI,
            },
            pan_speed: 5.0,
            pan_settle: 0.02,
            camera: CameraModel::paper(),
            look: Look::default(),
            frame_time: 1.0 / 30.0,
            frame_delay: 0.03,
        }
    }
}

/// Why a simulation cannot begin.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// The camera cannot be.
    #[error(transparent)]
    Camera(#[from] CameraModelError),
    /// A parameter is out of range.
    #[error("robot {name}: expected {expected}, found {found}")]
    Value {
        /// The field of [`RobotParams`] or of one of its parts.
        name: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        found: f64,
    },
    /// The robot does not fit where it is to start.
    #[error("the robot, {needed} m in radius, has {found} m of room at its start ({x}, {y})")]
    Start {
        /// [m]
        x: f64,
        /// [m]
        y: f64,
        /// To the nearest outline [m], 0 inside something.
        found: f64,
        /// [m]
        needed: f64,
    },
}

/// What is true in a simulation. For scoring; a behaviour that reads it cheats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Since the simulation began [s].
    pub time: f64,
    /// The true pose.
    pub map_from_base: Pose2,
    /// The true velocity, were there no slip.
    pub twist: Twist2,
    /// How often the moving body has run into something.
    pub collisions: u64,
    /// Least room around the body so far [m], at most 0.5; 0 after a collision.
    pub least_clearance: f64,
    /// Way of the base's centre so far [m].
    pub driven: f64,
}

/// Longest step of the base [s].
const STEP: f64 = 0.005;

fn check(params: &RobotParams) -> Result<(), SimulationError> {
    let (base, sonar) = (&params.base, &params.sonar);
    let [left, right] = base.wheel_error;
    for (name, found) in [
        ("base.radius", base.radius),
        ("base.height", base.height),
        ("base.track", base.track),
        ("base.track_error", base.track_error),
        ("base.wheel_error", left.min(right)),
        ("base.max_speed", base.max_speed),
        ("base.max_acceleration", base.max_acceleration),
        ("base.tick", base.tick),
        ("sonar.max_range", sonar.max_range),
        ("sonar.half_beam", sonar.half_beam),
        ("sonar_cycle", params.sonar_cycle),
        ("pan_speed", params.pan_speed),
        ("frame_time", params.frame_time),
    ] {
        // NaN is not above 0 either
        if !(found > 0.0 && found < 1e12) {
            return Err(SimulationError::Value {
                name,
                expected: "above 0, finite",
                found,
            });
        }
    }
    let noise = [
        base.slip_noise,
        sonar.sigma,
        sonar.blanking,
        sonar.resolution,
    ];
    let times = [params.pan_settle, params.frame_delay];
    for found in noise.into_iter().chain(times) {
        if !(0.0..1e12).contains(&found) {
            return Err(SimulationError::Value {
                name: "noise, blanking, resolution, pan_settle or frame_delay",
                expected: "0 or more, finite",
                found,
            });
        }
    }
    Ok(())
}

#[derive(Debug)]
pub(crate) struct State {
    /// Its walkers are late by as long as they stood.
    pub(crate) world: World,
    /// How long each walker has stood [s].
    waited: Vec<f64>,
    pub(crate) params: RobotParams,
    pub(crate) time: f64,
    pub(crate) base: Base,
    pub(crate) pan: f64,
    /// Where a pan that turns by itself is going.
    pub(crate) pan_target: Option<f64>,
    sonar: Sonar,
    sonar_dice: Dice,
    renderer: Renderer,
    seed: u64,
}

impl State {
    /// Lets time pass; none for a time that is not finite.
    pub(crate) fn advance(&mut self, seconds: f64) {
        if !seconds.is_finite() {
            return;
        }
        let end = self.time + seconds.max(0.0);
        while self.time < end {
            let step = (end - self.time).min(STEP);
            let next = if end - self.time <= STEP {
                end
            } else {
                self.time + step
            };
            let robot = (self.base.map_from_base.position(), self.params.base.radius);
            for (walker, waited) in self.world.walkers.iter_mut().zip(&mut self.waited) {
                person::mind(walker, waited, [next, step], robot);
            }
            self.base.step(&self.world, next, step);
            self.turn_pan(step);
            self.time = next;
        }
    }

    fn turn_pan(&mut self, seconds: f64) {
        let Some(target) = self.pan_target else {
            return;
        };
        let most = self.params.pan_speed * seconds;
        let turn = target - self.pan;
        if turn.abs() <= most {
            self.pan = target;
            self.pan_target = None;
        } else {
            self.pan += most.copysign(turn);
        }
    }

    /// Fires the sonar where the pan points.
    pub(crate) fn fire(&mut self) -> Reading {
        let base_from_axle = self.params.base_from_sonar;
        let base_from_sonar = Pose2 {
            theta: base_from_axle.theta + self.pan,
            ..base_from_axle
        };
        let map_from_base = crate::real::Placed::at(self.base.map_from_base);
        let at = map_from_base.outward(base_from_sonar.position());
        let map_from_sonar = Pose2::new(
            at.x,
            at.y,
            self.base.map_from_base.theta + base_from_sonar.theta,
        );
        self.sonar
            .fire(&self.world, map_from_sonar, self.time, &mut self.sonar_dice)
    }

    /// Exposes a frame now.
    pub(crate) fn picture(&mut self, sequence: u64) -> GrayImage {
        let seed = Dice::new(self.seed ^ sequence.rotate_left(32)).next();
        self.renderer
            .render(&self.world, self.base.map_from_base, self.time, seed)
    }
}

/// A robot in a building, with a clock of its own: time passes only while a device is waited for.
///
/// Clones and devices share the one robot. Same world, parameters, seed and calls: the same bytes.
#[derive(Debug, Clone)]
pub struct Simulation {
    state: Arc<Mutex<State>>,
}

impl Simulation {
    /// Puts a robot at the world's start.
    ///
    /// # Errors
    /// [`SimulationError`] where a part is impossible, or the robot does not fit there.
    pub fn new(world: World, params: RobotParams, seed: u64) -> Result<Self, SimulationError> {
        check(&params)?;
        let renderer = Renderer::new(params.camera, params.look)?;
        let start = world.start();
        let room = world.room_at(
            start.position(),
            params.base.radius + 0.01,
            params.base.height,
        );
        if room < params.base.radius {
            return Err(SimulationError::Start {
                x: start.x,
                y: start.y,
                found: room,
                needed: params.base.radius,
            });
        }
        let mut dice = Dice::new(seed);
        let base = Base::new(params.base, start, Dice::new(dice.next()));
        Ok(Self {
            state: Arc::new(Mutex::new(State {
                sonar: Sonar::new(params.sonar),
                sonar_dice: Dice::new(dice.next()),
                seed: dice.next(),
                waited: vec![0.0; world.walkers.len()],
                world,
                params,
                time: 0.0,
                base,
                pan: 0.0,
                pan_target: None,
                renderer,
            })),
        })
    }

    /// What is true now.
    #[must_use]
    pub fn truth(&self) -> Truth {
        let state = self.lock();
        Truth {
            time: state.time,
            map_from_base: state.base.map_from_base,
            twist: state.base.twist(),
            collisions: state.base.collisions,
            least_clearance: state.base.least_clearance,
            driven: state.base.driven,
        }
    }

    /// The outline of everything that stands on the floor, see [`World::floor_outline`].
    #[must_use]
    pub fn outline(&self) -> Vec<[Point2; 2]> {
        self.lock().world.floor_outline()
    }

    /// Sets the share of its way that each wheel loses from now on, left and right.
    pub fn set_slip(&self, slip: [f64; 2]) {
        self.lock().base.params.slip = slip;
    }

    /// Lifts the robot and puts it down elsewhere; its wheels do not notice.
    pub fn kidnap(&self, map_from_base: Pose2) {
        self.lock().base.map_from_base = map_from_base;
    }

    /// Says whether the floor ends under the robot's nose from now on; it tells, and falls nowhere.
    pub fn set_cliff(&self, cliff: bool) {
        self.lock().base.cliff = cliff;
    }

    /// Lifts the robot off the floor, or puts it down again where it was: its wheels hang and turn in the air.
    pub fn set_lifted(&self, lifted: bool) {
        self.lock().base.lifted = lifted;
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, State> {
        // a panic of another holder left nothing half done that would matter to a simulation
        self.state
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}
