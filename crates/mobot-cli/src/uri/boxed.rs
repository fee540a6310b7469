//! Devices of any kind behind one type each.

use std::f64::consts::{PI, TAU};

use mobot_hw::wrap::Fault;
use mobot_hw::{
    BaseStatus, Bearings, Camera, CameraFrame, Clock, DifferentialDrive, FaultKind, PanActuator,
    Ping, RangeFinder, Twist2,
};

/// Any range finder.
pub type BoxedSonar = Box<dyn RangeFinder<Error = Fault> + Send>;
/// Any base.
pub type BoxedBase = Box<dyn DifferentialDrive<Error = Fault> + Send>;
/// Any camera.
pub type BoxedCamera = Box<dyn Camera<Error = Fault> + Send>;
/// Any clock.
pub type BoxedClock = Box<dyn Clock + Send>;
/// Any pan.
pub(crate) type BoxedPan = Box<dyn PanActuator<Error = Fault> + Send>;

/// A device whose errors are [`Fault`]s.
#[derive(Debug, Clone)]
pub(crate) struct Plain<D>(pub(crate) D);

impl<D: RangeFinder> RangeFinder for Plain<D> {
    type Error = Fault;

    fn bearings(&self) -> Bearings {
        self.0.bearings()
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, Fault> {
        self.0.ping(bearing).map_err(|e| Fault::of(&e))
    }
}

impl<D: PanActuator> PanActuator for Plain<D> {
    type Error = Fault;

    fn bearings(&self) -> Bearings {
        self.0.bearings()
    }

    fn turn_to(&mut self, bearing: f64) -> Result<f64, Fault> {
        self.0.turn_to(bearing).map_err(|e| Fault::of(&e))
    }
}

impl<D: Camera> Camera for Plain<D> {
    type Error = Fault;

    fn frame(&mut self) -> Result<CameraFrame, Fault> {
        self.0.frame().map_err(|e| Fault::of(&e))
    }
}

impl<D: DifferentialDrive> DifferentialDrive for Plain<D> {
    type Error = Fault;

    fn track(&self) -> f64 {
        self.0.track()
    }

    fn drive(&mut self, command: Twist2) -> Result<(), Fault> {
        self.0.drive(command).map_err(|e| Fault::of(&e))
    }

    fn stop(&mut self) -> Result<(), Fault> {
        self.0.stop().map_err(|e| Fault::of(&e))
    }

    fn status(&mut self) -> Result<BaseStatus, Fault> {
        self.0.status().map_err(|e| Fault::of(&e))
    }
}

/// A range finder whose bearing 0 looks along `yaw` in the base frame [rad]; with `reach` it is kept to
/// fewer bearings than it has.
#[derive(Debug, Clone)]
pub(crate) struct Mounted<D> {
    pub(crate) finder: D,
    pub(crate) yaw: f64,
    /// Of the finder's own bearings.
    pub(crate) reach: Bearings,
}

impl<D: RangeFinder> Mounted<D> {
    /// One that keeps its reach.
    pub(crate) fn at(yaw: f64, finder: D) -> Self {
        Self {
            yaw,
            reach: finder.bearings(),
            finder,
        }
    }

    /// One that is not turned.
    pub(crate) const fn fixed(yaw: f64, finder: D) -> Self {
        Self {
            yaw,
            reach: Bearings::fixed(0.0),
            finder,
        }
    }
}

impl<D: RangeFinder<Error = Fault>> RangeFinder for Mounted<D> {
    type Error = Fault;

    fn bearings(&self) -> Bearings {
        Bearings {
            from: self.yaw + self.reach.from,
            to: self.yaw + self.reach.to,
        }
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, Fault> {
        // the same direction a turn more or less may be within reach
        let straight = bearing - self.yaw;
        let within = [straight, straight - TAU, straight + TAU]
            .into_iter()
            .find(|own| self.reach.contain(*own));
        let Some(own) = within else {
            let Bearings { from, to } = self.bearings();
            return Err(Fault {
                kind: FaultKind::Refused,
                message: format!("bearing must be {from} to {to} rad, found {bearing}"),
            });
        };
        let ping = self.finder.ping(own)?;
        let bearing = self.yaw + ping.bearing;
        Ok(Ping {
            bearing: if bearing.abs() > PI {
                bearing - TAU.copysign(bearing)
            } else {
                bearing
            },
            ..ping
        })
    }
}

#[cfg(test)]
mod tests {
    use mobot_hw::sim::{RobotParams, Simulation};

    use super::*;

    fn robot() -> Simulation {
        let world = crate::world::load("office", None).expect("a world");
        Simulation::new(world, RobotParams::default(), 1).expect("a robot")
    }

    #[test]
    fn a_turret_that_looks_backwards_pings_in_base_bearings() {
        let mut back = Mounted::at(PI, Plain(robot().turret()));
        for bearing in [0.0, 1.0, -1.0, PI, -PI] {
            let ping = back.ping(bearing).expect("a reading");
            let off = (ping.bearing - bearing).rem_euclid(TAU);
            assert!(off.min(TAU - off) < 1e-9, "{bearing}: {ping:?}");
        }
    }

    #[test]
    fn what_is_not_turned_pings_one_way_only() {
        let mut fixed = Mounted::fixed(0.5, Plain(robot().turret()));
        assert_eq!(fixed.bearings(), Bearings::fixed(0.5));
        assert!((fixed.ping(0.5).expect("a reading").bearing - 0.5).abs() < 1e-12);
        assert_eq!(fixed.ping(0.0).unwrap_err().kind, FaultKind::Refused);
    }
}
