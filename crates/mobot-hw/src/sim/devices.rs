//! The simulated robot's devices, behind the same traits as real ones.

use thiserror::Error;

use super::robot::Simulation;
use crate::{
    BaseStatus, Bearings, Camera, CameraFrame, Clock, DeviceError, DifferentialDrive, FaultKind,
    PanActuator, Ping, RangeFinder, Turret, Twist2,
};

/// Why a simulated device refused.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum SimFault {
    /// Not a direction it can be aimed at.
    #[error("bearing must be {} to {} rad, found {found}", .reach.from, .reach.to)]
    Bearing {
        /// What it reaches.
        reach: Bearings,
        /// [rad]
        found: f64,
    },
}

impl DeviceError for SimFault {
    fn kind(&self) -> FaultKind {
        FaultKind::Refused
    }
}

impl Simulation {
    /// The sonar on its pan: a range finder that can be aimed.
    #[must_use]
    pub fn turret(&self) -> Turret<SimSonar, SimPan> {
        Turret {
            sonar: self.sonar(),
            pan: self.pan(),
        }
    }

    /// The sonar alone: it fires where the pan stands.
    #[must_use]
    pub fn sonar(&self) -> SimSonar {
        SimSonar(self.clone())
    }

    /// The pan alone.
    #[must_use]
    pub fn pan(&self) -> SimPan {
        SimPan(self.clone())
    }

    /// The camera.
    #[must_use]
    pub fn camera(&self) -> SimCamera {
        SimCamera {
            simulation: self.clone(),
            last: None,
        }
    }

    /// The base.
    #[must_use]
    pub fn base(&self) -> SimBase {
        SimBase(self.clone())
    }

    /// The clock; the robot moves while a program sleeps.
    #[must_use]
    pub fn clock(&self) -> SimClock {
        SimClock(self.clone())
    }
}

/// The simulated sonar, fixed to its pan.
#[derive(Debug, Clone)]
pub struct SimSonar(Simulation);

impl RangeFinder for SimSonar {
    type Error = SimFault;

    fn bearings(&self) -> Bearings {
        Bearings::fixed(0.0)
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, SimFault> {
        within(self.bearings(), bearing)?;
        let mut state = self.0.lock();
        let stamp = state.time;
        let reading = state.fire();
        let cycle = state.params.sonar_cycle;
        state.advance(cycle);
        Ok(Ping {
            stamp,
            bearing: 0.0,
            settled: true,
            reading,
        })
    }
}

/// The simulated pan.
#[derive(Debug, Clone)]
pub struct SimPan(Simulation);

impl PanActuator for SimPan {
    type Error = SimFault;

    fn bearings(&self) -> Bearings {
        self.0.lock().params.pan
    }

    fn turn_to(&mut self, bearing: f64) -> Result<f64, SimFault> {
        within(self.bearings(), bearing)?;
        let mut state = self.0.lock();
        let turn = (bearing - state.pan).abs();
        if turn > 1e-9 {
            let time = turn / state.params.pan_speed + state.params.pan_settle;
            state.advance(time);
            state.pan = bearing;
        }
        state.pan_target = None;
        Ok(bearing)
    }
}

fn within(reach: Bearings, bearing: f64) -> Result<(), SimFault> {
    if reach.contain(bearing) {
        return Ok(());
    }
    Err(SimFault::Bearing {
        reach,
        found: bearing,
    })
}

/// The simulated camera.
#[derive(Debug, Clone)]
pub struct SimCamera {
    simulation: Simulation,
    last: Option<u64>,
}

impl Camera for SimCamera {
    type Error = SimFault;

    fn frame(&mut self) -> Result<CameraFrame, SimFault> {
        let mut state = self.simulation.lock();
        let every = state.params.frame_time;
        // the next exposure that has not been given yet
        let due = (state.time / every - 1e-9).ceil() as u64;
        let sequence = self.last.map_or(due, |last| due.max(last + 1));
        let wait = sequence as f64 * every - state.time;
        state.advance(wait);
        let stamp = state.time;
        let image = state.picture(sequence);
        let delay = state.params.frame_delay;
        state.advance(delay);
        self.last = Some(sequence);
        Ok(CameraFrame {
            stamp,
            sequence,
            image,
        })
    }
}

/// The simulated base.
#[derive(Debug, Clone)]
pub struct SimBase(Simulation);

impl DifferentialDrive for SimBase {
    type Error = SimFault;

    fn track(&self) -> f64 {
        self.0.lock().params.base.track
    }

    fn drive(&mut self, command: Twist2) -> Result<(), SimFault> {
        self.0.lock().base.command(command);
        Ok(())
    }

    fn status(&mut self) -> Result<BaseStatus, SimFault> {
        let state = self.0.lock();
        let [bump_left, bump_right] = state.base.bumped;
        Ok(BaseStatus {
            stamp: state.time,
            travel: state.base.travel(),
            bump_left,
            bump_right,
            cliff: state.base.cliff,
            wheel_drop: state.base.lifted,
        })
    }
}

/// The simulation's clock.
#[derive(Debug, Clone)]
pub struct SimClock(Simulation);

impl Clock for SimClock {
    fn now(&self) -> f64 {
        self.0.lock().time
    }

    fn sleep(&mut self, seconds: f64) {
        self.0.lock().advance(seconds);
    }
}
