//! From stop to stop: turn on the spot, drive straight, corner by corner.

use mobot_hw::Twist2;
use occgrid::Point2;

use super::angle::wrap;
use super::{Action, Observation, StopCause};

/// How fast, and how long to wait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HopParams {
    /// Speed on straight pieces [m/s].
    pub speed: f64,
    /// Speed of turns on the spot [rad/s].
    pub turn: f64,
    /// A corner is reached this near to it [m].
    pub arrived: f64,
    /// The robot waits this long for what is in its way to go on [s].
    pub patience: f64,
}

impl Default for HopParams {
    fn default() -> Self {
        Self {
            speed: 0.3,
            turn: 1.0,
            arrived: 0.04,
            patience: 2.0,
        }
    }
}

/// What a hop comes to.
#[derive(Debug, Clone, PartialEq)]
pub enum HopStep {
    /// Still under way.
    Go(Action),
    /// At the last corner.
    Arrived,
    /// Something stands in the way, for longer than it was waited for.
    Blocked(StopCause),
}

/// A hop under way.
#[derive(Debug, Clone)]
pub struct Hop {
    params: HopParams,
    way: Vec<Point2>,
    next: usize,
    turning: bool,
    stopped_since: Option<f64>,
}

/// The robot turns until it faces the next corner to within this [rad].
const FACING: f64 = 0.03;
/// Past this it stops to turn [rad].
const ASTRAY: f64 = 0.3;

impl Hop {
    /// Along a line of corners, the first of which is where the robot is.
    #[must_use]
    pub const fn new(way: Vec<Point2>, params: HopParams) -> Self {
        Self {
            params,
            way,
            next: 1,
            turning: true,
            stopped_since: None,
        }
    }

    /// Where it leads.
    #[must_use]
    pub fn goal(&self) -> Option<Point2> {
        self.way.last().copied()
    }

    /// What to do next.
    pub fn step(&mut self, seen: &Observation<'_>) -> HopStep {
        let here = seen.pose.map_from_base;
        let corner = loop {
            let Some(&corner) = self.way.get(self.next) else {
                return HopStep::Arrived;
            };
            if here.position().distance(corner) > self.params.arrived {
                break corner;
            }
            self.next += 1;
            self.turning = true;
        };
        match seen.stopped {
            Some(cause) if !matches!(cause, StopCause::Wanted(_)) => {
                let since = *self.stopped_since.get_or_insert(seen.now);
                if seen.now - since > self.params.patience {
                    return HopStep::Blocked(cause);
                }
            }
            _ => self.stopped_since = None,
        }
        let away = here.position().distance(corner);
        let off = wrap((corner.y - here.y).atan2(corner.x - here.x) - here.theta);
        if off.abs() > ASTRAY {
            self.turning = true;
        } else if off.abs() < FACING {
            self.turning = false;
        }
        let most = self.params.turn;
        HopStep::Go(Action::drive(if self.turning {
            let rate = (2.0 * off).clamp(-most, most);
            Twist2::new(0.0, rate.abs().max(0.08).copysign(rate))
        } else {
            let speed = self.params.speed.min(0.05 + 0.8 * away);
            Twist2::new(speed, (1.5 * off).clamp(-most, most))
        }))
    }
}
