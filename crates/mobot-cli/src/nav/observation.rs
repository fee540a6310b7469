//! What a behaviour is told, and what it may wish.

use mobot_hw::{BaseStatus, Bearings, Ping, Twist2};
use occgrid::{OccupancyGrid, OccupancyMap, Point2, Pose2, Shot};

use super::{Event, Halt, Outcome, PoseEstimate, Surprises};

/// A firing of the sonar and where the robot was then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sounding {
    /// What came of it.
    pub ping: Ping,
    /// The estimated pose when it fired.
    pub map_from_base: Pose2,
    /// The pose by dead reckoning when it fired.
    pub odom_from_base: Pose2,
}

impl Sounding {
    /// As the map takes it.
    #[must_use]
    pub const fn shot(&self) -> Shot {
        Shot {
            stamp: self.ping.stamp,
            map_from_base: self.map_from_base,
            bearing: self.ping.bearing,
            reading: self.ping.reading,
        }
    }
}

/// Something that moves, as the camera sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mover {
    /// Nearest place of its foot, map frame [m].
    pub position: Point2,
    /// Map frame [m/s].
    pub velocity: Point2,
    /// When it was last seen [s].
    pub seen: f64,
}

/// All that a behaviour knows in one step.
#[derive(Debug, Clone, Copy)]
pub struct Observation<'a> {
    /// [s]
    pub now: f64,
    /// Where the robot is thought to be.
    pub pose: PoseEstimate,
    /// The pose by dead reckoning alone: it drifts, but never jumps.
    pub odom_from_base: Pose2,
    /// The base's last word.
    pub status: BaseStatus,
    /// Measured by the wheels.
    pub twist: Twist2,
    /// This step's firing of the sonar; `None` where it failed.
    pub sounding: Option<Sounding>,
    /// The newest valid firing at most 15 degrees off straight ahead.
    pub ahead: Option<Sounding>,
    /// Directions that the sonar can be aimed at.
    pub bearings: Bearings,
    /// The map of this run so far: every settled firing is in it.
    pub map: &'a OccupancyGrid,
    /// What moves on the floor in the newest frame.
    pub movers: &'a [Mover],
    /// What stands there that is not on the map that the robot came with.
    pub surprises: &'a Surprises,
    /// The latched stop, if there is one: it ends with [`Motion::Resume`].
    pub halt: Option<Halt>,
    /// What safety made of the wish of the step before: `Some` where it stopped the robot.
    pub stopped: Option<super::StopCause>,
}

/// A wish.
#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    /// What the wheels should do.
    pub motion: Motion,
    /// Where the sonar should fire next [rad, base frame]; brought into its reach. While the wheels drive
    /// it fires along the way, whatever is wished.
    pub aim: f64,
    /// For the log.
    pub say: Option<Event>,
    /// The building as it is known from now on: what bears witness where the sonar is silent, and what its echoes
    /// are compared with.
    pub learnt: Option<Box<OccupancyMap>>,
}

/// What the wheels should do.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// Drive so.
    Drive(Twist2),
    /// Stand still, for this reason.
    Stand(&'static str),
    /// Stand still, and lift a latched stop if everything was healthy for a second.
    Resume,
    /// The mission is over.
    Done(Outcome),
}

impl Action {
    /// Stands still and listens straight ahead.
    #[must_use]
    pub const fn stand(why: &'static str) -> Self {
        Self {
            motion: Motion::Stand(why),
            aim: 0.0,
            say: None,
            learnt: None,
        }
    }

    /// Drives, and listens along the way.
    #[must_use]
    pub const fn drive(command: Twist2) -> Self {
        Self {
            motion: Motion::Drive(command),
            aim: 0.0,
            say: None,
            learnt: None,
        }
    }

    /// Ends the mission.
    #[must_use]
    pub const fn done(outcome: Outcome) -> Self {
        Self {
            motion: Motion::Done(outcome),
            aim: 0.0,
            say: None,
            learnt: None,
        }
    }

    /// The same, with something to say.
    #[must_use]
    pub fn saying(mut self, event: Event) -> Self {
        self.say = Some(event);
        self
    }

    /// The same, with a building that is known from now on.
    #[must_use]
    pub fn learning(mut self, map: OccupancyMap) -> Self {
        self.learnt = Some(Box::new(map));
        self
    }

    /// The same, with the sonar aimed there [rad, base frame].
    #[must_use]
    pub const fn aiming(mut self, bearing: f64) -> Self {
        self.aim = bearing;
        self
    }
}

/// Something that decides what the robot does.
pub trait Behaviour {
    /// What to do now. A function of this and earlier observations alone.
    fn step(&mut self, seen: &Observation<'_>) -> Action;
}
