//! What the page about a mission is made of, collected on the way.

use std::collections::BTreeMap;

use image::GrayImage;
use mobot_hw::sim::Simulation;
use occgrid::{Point2, Pose2};

use crate::nav::{Cue, Entry, Event, PoseEstimate, RunLog, StopCause};
use crate::output::Output;
use crate::report::{Moment, Sweep};

/// Shots of a sweep that is shown.
const SWEEP_SHOTS: usize = 20;
/// Sweeps that are shown at most.
const MOST_SWEEPS: usize = 4;
/// Time between pictures that are kept [s].
const FRAME_EVERY: f64 = 5.0;
/// Radius that holds 95 of 100 draws of a normal distribution in the plane, in sigmas.
const WITHIN_95: f64 = 2.447_746_830_680_816;

/// Looks on, and writes to the run's log what it is told.
pub(super) struct Witness<'a, L> {
    log: L,
    simulation: &'a Simulation,
    map_from_world: Pose2,
    /// Of earlier runs [s].
    before: f64,
    output: &'a Output,
    estimate: Option<PoseEstimate>,
    pub(super) moments: Vec<Moment>,
    pub(super) events: Vec<(f64, String, bool)>,
    pub(super) frames: Vec<(f64, GrayImage)>,
    pub(super) sweeps: Vec<Sweep>,
    pub(super) routes: Vec<Vec<Point2>>,
    /// Corrections that were taken and refused, by what they came from.
    pub(super) corrections: BTreeMap<&'static str, [u32; 2]>,
    sweep: Sweep,
}

impl<'a, L: RunLog> Witness<'a, L> {
    /// Of a robot that stands at the map's origin.
    pub(super) fn new(log: L, simulation: &'a Simulation, output: &'a Output) -> Self {
        Self {
            log,
            simulation,
            map_from_world: simulation.truth().map_from_base.inverse(),
            before: 0.0,
            output,
            estimate: None,
            moments: Vec::new(),
            events: Vec::new(),
            frames: Vec::new(),
            sweeps: Vec::new(),
            routes: Vec::new(),
            corrections: BTreeMap::new(),
            sweep: Sweep {
                time: 0.0,
                soundings: Vec::new(),
            },
        }
    }

    /// Looks on at another run from the same start, whose time goes on from here.
    pub(super) fn on<M: RunLog>(self, log: M, simulation: &'a Simulation) -> Witness<'a, M> {
        Witness {
            before: self.time(),
            log,
            simulation,
            map_from_world: self.map_from_world,
            output: self.output,
            estimate: None,
            moments: self.moments,
            events: self.events,
            frames: self.frames,
            sweeps: self.sweeps,
            routes: self.routes,
            corrections: self.corrections,
            sweep: self.sweep,
        }
    }

    /// Since the first run began [s].
    pub(super) fn time(&self) -> f64 {
        self.before + self.simulation.truth().time
    }

    /// The building's frame in the map's.
    pub(super) const fn map_from_world(&self) -> Pose2 {
        self.map_from_world
    }

    /// A line for the reader of the page.
    pub(super) fn say(&mut self, text: impl Into<String>) {
        let text = text.into();
        self.output.stage(text.clone());
        self.events.push((self.time(), text, false));
    }

    /// Where the robot is, in the map.
    pub(super) fn truth(&self) -> Pose2 {
        let truth = self.simulation.truth().map_from_base;
        self.map_from_world.compose(truth)
    }

    fn heard(&mut self, time: f64, ping: &mobot_hw::Ping) {
        if self.sweeps.len() >= MOST_SWEEPS {
            return;
        }
        if self.sweep.soundings.is_empty() {
            self.sweep.time = time;
        }
        self.sweep.soundings.push((ping.bearing, ping.reading));
        if self.sweep.soundings.len() == SWEEP_SHOTS {
            let sweep = std::mem::replace(
                &mut self.sweep,
                Sweep {
                    time,
                    soundings: Vec::new(),
                },
            );
            let apart = |i: usize| (sweep.soundings[i].0 - sweep.soundings[i - 1].0).abs() > 1e-6;
            // one all round, not a stare ahead
            if (1..SWEEP_SHOTS).all(apart) {
                self.sweeps.push(sweep);
            }
        }
    }

    fn moved(&mut self, time: f64, odometry: Pose2) {
        let Some(estimate) = &self.estimate else {
            return;
        };
        self.moments.push(Moment {
            time,
            estimate: estimate.map_from_base,
            bound: WITHIN_95 * estimate.position_sigma(),
            odometry,
            truth: Some(self.truth()),
        });
    }
}

impl<L: RunLog> RunLog for Witness<'_, L> {
    fn record(&mut self, time: f64, entry: Entry<'_>) {
        self.log.record(time, entry);
        let time = self.before + time;
        match entry {
            Entry::Pose(estimate) => self.estimate = Some(*estimate),
            Entry::Odometry(pose) => self.moved(time, pose),
            Entry::Ping(sounding) => self.heard(time, &sounding.ping),
            Entry::Command(command) if command != mobot_hw::Twist2::default() => {
                self.sweep.soundings.clear();
            }
            Entry::Route(points) => self.routes.push(points.to_vec()),
            Entry::Frame(frame)
                if self
                    .frames
                    .last()
                    .is_none_or(|(t, _)| time - t >= FRAME_EVERY) =>
            {
                self.frames.push((time, frame.image.clone()));
            }
            Entry::Correction(correction) => {
                let cue = match correction.cue {
                    Cue::Camera => "camera",
                    Cue::Sonar => "sonar",
                    Cue::Sweep => "sweep",
                };
                let [taken, refused] = self.corrections.entry(cue).or_default();
                *(if correction.accepted { taken } else { refused }) += 1;
            }
            Entry::Event(event) => {
                let stop =
                    matches!(event, Event::Stop(cause) if !matches!(cause, StopCause::Wanted(_)));
                let text = event.to_string();
                self.output.stage(text.clone());
                self.events.push((time, text, stop));
            }
            _ => {}
        }
    }
}
