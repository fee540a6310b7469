//! What happened and why: causes of stops, events, outcomes, and where they are written.

use std::fmt;

use mobot_hw::{BaseStatus, CameraFrame, FaultKind, Ping, Twist2};
use occgrid::{OccupancyGrid, Point2, Pose2};

use super::{Correction, PoseEstimate, Sounding};

/// A device of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Device {
    /// Wheels and bumper.
    Base,
    /// The sonar and what turns it.
    Sonar,
    /// The camera.
    Camera,
}

/// Why the wheels were told to stand still.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum StopCause {
    /// The behaviour stands still on purpose, for this.
    Wanted(&'static str),
    /// No valid sonar reading of the way ahead is fresh enough (S1).
    RangeStale {
        /// Of the newest one [s]; infinite where there is none.
        age: f64,
    },
    /// The sonar gives the same range though the wheels turn and a wall is near.
    RangeStuck {
        /// The way driven meanwhile [m].
        driven: f64,
    },
    /// Something is too near ahead (S2).
    Obstacle {
        /// Clear distance ahead of the body [m].
        clear: f64,
    },
    /// The sonar hears nothing and nothing else shows that the way is free: the allowance is used up (S1).
    Silence,
    /// The base reports contact or danger.
    Trouble(Trouble),
    /// A device failed.
    Fault(Device, FaultKind),
    /// The pose is too uncertain to drive by (S5).
    PoseUncertain,
    /// The pose is wrong or unknown.
    Lost,
    /// The command was not a number (S8).
    NotFinite,
    /// Somebody asked for it.
    Interrupted,
}

/// What a base reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Trouble {
    /// The bumper is pressed.
    Bump,
    /// The floor ends under the base.
    Cliff,
    /// A wheel hangs in the air.
    WheelDrop,
}

impl StopCause {
    /// Whether the robot may go on only after [`super::Motion::Resume`], with everything healthy for a while.
    #[must_use]
    pub const fn latches(&self) -> bool {
        self.needs_a_person()
            || matches!(
                self,
                Self::RangeStale { .. } | Self::RangeStuck { .. } | Self::Fault(..)
            )
    }

    /// Whether only a person may let the robot go on (S6).
    #[must_use]
    pub const fn needs_a_person(&self) -> bool {
        matches!(
            self,
            Self::Trouble(_) | Self::Interrupted | Self::Fault(Device::Base, _)
        )
    }

    /// Whether it is the same kind of cause, numbers aside.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::RangeStale { .. }, Self::RangeStale { .. })
            | (Self::RangeStuck { .. }, Self::RangeStuck { .. })
            | (Self::Obstacle { .. }, Self::Obstacle { .. }) => true,
            _ => self == other,
        }
    }
}

impl fmt::Display for StopCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wanted(why) => write!(f, "{why}"),
            Self::RangeStale { age } if age.is_finite() => {
                write!(
                    f,
                    "range stale: the way ahead was last heard {age:.3} s ago"
                )
            }
            Self::RangeStale { .. } => write!(f, "range stale: the way ahead was not heard yet"),
            Self::RangeStuck { driven } => {
                write!(f, "range stuck: unchanged over {driven:.2} m of driving")
            }
            Self::Obstacle { clear } => write!(f, "obstacle {clear:.2} m ahead"),
            Self::Silence => write!(f, "silence: nothing shows that the way ahead is free"),
            Self::Trouble(Trouble::Bump) => write!(f, "bumper pressed"),
            Self::Trouble(Trouble::Cliff) => write!(f, "cliff"),
            Self::Trouble(Trouble::WheelDrop) => write!(f, "wheel drop"),
            Self::Fault(device, kind) => {
                let device = match device {
                    Device::Base => "base",
                    Device::Sonar => "sonar",
                    Device::Camera => "camera",
                };
                let kind = match kind {
                    FaultKind::Silent => "does not answer",
                    FaultKind::Garbled => "answers garbage",
                    FaultKind::Unplugged => "is unplugged",
                    FaultKind::Refused => "refuses",
                    FaultKind::System => "failed in the system",
                    _ => "failed",
                };
                write!(f, "{device} {kind}")
            }
            Self::PoseUncertain => write!(f, "pose too uncertain"),
            Self::Lost => write!(f, "lost"),
            Self::NotFinite => write!(f, "command not finite"),
            Self::Interrupted => write!(f, "interrupted"),
        }
    }
}

/// Something worth a line in the log.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// The wheels were told to stand still.
    Stop(StopCause),
    /// The wheels were told to move again.
    Go,
    /// A latched stop was lifted.
    Resumed,
    /// A device failed, or failed in another way.
    Fault(Device, FaultKind),
    /// A device answers again.
    Healthy(Device),
    /// A route was planned [m].
    Planned {
        /// Its length [m].
        length: f64,
        /// Its certified clearance [m].
        clearance: f64,
        /// Why.
        why: &'static str,
        /// Its centre line, map frame [m].
        points: Vec<Point2>,
    },
    /// The pose is known again, less well known, or not known.
    Confidence(super::Confidence),
    /// Anything else that a behaviour has to say.
    Note(String),
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stop(cause) => write!(f, "stop: {cause}"),
            Self::Go => write!(f, "go"),
            Self::Resumed => write!(f, "resumed"),
            Self::Fault(device, kind) => write!(f, "fault: {}", StopCause::Fault(*device, *kind)),
            Self::Healthy(device) => write!(f, "{device:?} healthy"),
            Self::Planned {
                length,
                clearance,
                why,
                points: _,
            } => write!(
                f,
                "route of {length:.2} m, clearance {clearance:.3} m ({why})"
            ),
            Self::Confidence(confidence) => write!(f, "pose {confidence:?}"),
            Self::Note(text) => write!(f, "{text}"),
        }
    }
}

/// How a mission ended.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Outcome {
    /// What was to do is done.
    Done,
    /// Time or battery ended first.
    BudgetOver,
    /// It cannot be done, and this is why.
    GaveUp(String),
    /// The robot stopped for a cause that only a person may lift.
    Stopped(StopCause),
    /// Somebody asked for it.
    Interrupted,
}

/// One thing to write down.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Entry<'a> {
    /// The base answered.
    Status(&'a BaseStatus),
    /// The sonar answered; with the pose at that time.
    Ping(&'a Sounding),
    /// The camera answered.
    Frame(&'a CameraFrame),
    /// A device did not answer.
    Fault(Device, FaultKind),
    /// The clock was read: all that is decided in this step is decided at this time [s].
    Now(f64),
    /// Where the robot is thought to be.
    Pose(&'a PoseEstimate),
    /// Dead reckoning alone.
    Odometry(Pose2),
    /// The pose was corrected, or a correction was refused.
    Correction(&'a Correction),
    /// What was sent to the base.
    Command(Twist2),
    /// The route to follow.
    Route(&'a [Point2]),
    /// The map so far, from time to time.
    Map(&'a OccupancyGrid),
    /// Something happened.
    Event(&'a Event),
}

/// Where a run is written down. It never fails the mission: a log that cannot write keeps its error to
/// itself until it is asked.
pub trait RunLog {
    /// Takes an entry of a time [s].
    fn record(&mut self, time: f64, entry: Entry<'_>);
}

/// Writes nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoLog;

impl RunLog for NoLog {
    fn record(&mut self, _: f64, _: Entry<'_>) {}
}

impl<T: RunLog + ?Sized> RunLog for &mut T {
    fn record(&mut self, time: f64, entry: Entry<'_>) {
        (**self).record(time, entry);
    }
}

/// The raw answer of a sounding, for those who only want that.
impl From<&Sounding> for Ping {
    fn from(sounding: &Sounding) -> Self {
        sounding.ping
    }
}
