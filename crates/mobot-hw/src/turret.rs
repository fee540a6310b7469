//! A sonar on a pan motor: together a range finder that can be aimed.

use thiserror::Error;

use crate::{Bearings, DeviceError, FaultKind, PanActuator, Ping, RangeFinder};

/// A sonar that is turned by a motor. The sonar looks straight ahead where the motor's bearing is 0.
#[derive(Debug, Clone)]
pub struct Turret<S, P> {
    /// Fixed to the motor's axle.
    pub sonar: S,
    /// Turns the sonar.
    pub pan: P,
}

/// Which part of a turret failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum TurretError<S, P> {
    /// The sonar.
    #[error("sonar: {0}")]
    Sonar(S),
    /// The motor.
    #[error("pan: {0}")]
    Pan(P),
}

impl<S: DeviceError, P: DeviceError> DeviceError for TurretError<S, P> {
    fn kind(&self) -> FaultKind {
        match self {
            Self::Sonar(error) => error.kind(),
            Self::Pan(error) => error.kind(),
        }
    }
}

impl<S: RangeFinder, P: PanActuator> RangeFinder for Turret<S, P> {
    type Error = TurretError<S::Error, P::Error>;

    fn bearings(&self) -> Bearings {
        self.pan.bearings()
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, Self::Error> {
        let stands_at = self.pan.turn_to(bearing).map_err(TurretError::Pan)?;
        let ping = self.sonar.ping(0.0).map_err(TurretError::Sonar)?;
        Ok(Ping {
            bearing: stands_at + ping.bearing,
            ..ping
        })
    }
}
