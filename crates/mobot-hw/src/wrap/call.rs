//! A call of a device, as data: what was asked, what came of it.

use std::fmt;

use thiserror::Error;

use crate::{BaseStatus, Bearings, CameraFrame, DeviceError, FaultKind, Ping, Twist2};

/// Which device a call went to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Device {
    /// [`RangeFinder`](crate::RangeFinder)
    RangeFinder,
    /// [`PanActuator`](crate::PanActuator)
    Pan,
    /// [`Camera`](crate::Camera)
    Camera,
    /// [`DifferentialDrive`](crate::DifferentialDrive)
    Base,
    /// [`Clock`](crate::Clock)
    Clock,
}

/// What a program asked of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Asked {
    /// Where the range finder can be aimed.
    RangeBearings,
    /// A shot.
    Ping {
        /// [rad, base frame]
        bearing: f64,
    },
    /// Where the pan can turn.
    PanBearings,
    /// A turn of the pan.
    TurnTo {
        /// [rad, base frame]
        bearing: f64,
    },
    /// The newest picture.
    Frame,
    /// The distance between the wheels.
    Track,
    /// A velocity.
    Drive(Twist2),
    /// A stop.
    Stop,
    /// The base's state.
    Status,
    /// The time.
    Now,
    /// A wait.
    Sleep {
        /// [s]
        seconds: f64,
    },
}

impl Asked {
    /// Which device is asked this.
    #[must_use]
    pub const fn device(&self) -> Device {
        match self {
            Self::RangeBearings | Self::Ping { .. } => Device::RangeFinder,
            Self::PanBearings | Self::TurnTo { .. } => Device::Pan,
            Self::Frame => Device::Camera,
            Self::Track | Self::Drive(_) | Self::Stop | Self::Status => Device::Base,
            Self::Now | Self::Sleep { .. } => Device::Clock,
        }
    }

    /// The same question, every number the same bit for bit.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        let same = |a: f64, b: f64| a.to_bits() == b.to_bits();
        match (self, other) {
            (Self::Ping { bearing: a }, Self::Ping { bearing: b })
            | (Self::TurnTo { bearing: a }, Self::TurnTo { bearing: b })
            | (Self::Sleep { seconds: a }, Self::Sleep { seconds: b }) => same(*a, *b),
            (Self::Drive(a), Self::Drive(b)) => {
                same(a.linear, b.linear) && same(a.angular, b.angular)
            }
            _ => self == other,
        }
    }
}

impl fmt::Display for Asked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RangeBearings => write!(f, "bearings of the range finder"),
            Self::Ping { bearing } => write!(f, "ping at {bearing} rad"),
            Self::PanBearings => write!(f, "bearings of the pan"),
            Self::TurnTo { bearing } => write!(f, "turn to {bearing} rad"),
            Self::Frame => write!(f, "frame"),
            Self::Track => write!(f, "track"),
            Self::Drive(twist) => write!(f, "drive {} m/s {} rad/s", twist.linear, twist.angular),
            Self::Stop => write!(f, "stop"),
            Self::Status => write!(f, "status"),
            Self::Now => write!(f, "time"),
            Self::Sleep { seconds } => write!(f, "sleep {seconds} s"),
        }
    }
}

/// What a device answered.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Answer {
    /// To [`Asked::RangeBearings`] and [`Asked::PanBearings`].
    Bearings(Bearings),
    /// To [`Asked::Ping`].
    Ping(Ping),
    /// To [`Asked::TurnTo`]: where it stands [rad, base frame].
    Stands(f64),
    /// To [`Asked::Frame`].
    Frame(CameraFrame),
    /// To [`Asked::Track`] [m].
    Track(f64),
    /// To [`Asked::Drive`], [`Asked::Stop`] and [`Asked::Sleep`].
    Done,
    /// To [`Asked::Status`].
    Status(BaseStatus),
    /// To [`Asked::Now`] [s].
    Now(f64),
    /// Instead of any.
    Fault(Fault),
}

/// An error of a device: what is left of it once its type is forgotten.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{message}")]
pub struct Fault {
    /// What kind of fault it is.
    pub kind: FaultKind,
    /// What the device said.
    pub message: String,
}

impl Fault {
    /// Of any device's error.
    #[must_use]
    pub fn of(error: &impl DeviceError) -> Self {
        Self {
            kind: error.kind(),
            message: error.to_string(),
        }
    }
}

impl DeviceError for Fault {
    fn kind(&self) -> FaultKind {
        self.kind
    }
}

/// A call and what came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Call {
    /// What the program asked.
    pub asked: Asked,
    /// What the device answered.
    pub answer: Answer,
}
