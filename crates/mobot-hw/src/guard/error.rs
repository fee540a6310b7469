//! Why a guarded base failed.

use thiserror::Error;

use crate::{DeviceError, FaultKind};

/// Why a guarded base failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GuardError {
    /// The guard's process could not be started.
    #[error("the guard does not start: {0}")]
    Start(#[source] std::io::Error),
    /// The guard was started with other arguments than [`GuardedBase`](super::GuardedBase) gives.
    #[error("guard: expected PATH BAUD BASE and its numbers, found {found:?}")]
    Arguments {
        /// The arguments.
        found: Vec<String>,
    },
    /// The guard's driver failed.
    #[error("{message}")]
    Base {
        /// What kind of fault it is.
        kind: FaultKind,
        /// What the driver says.
        message: String,
    },
    /// The guard has died or does not answer.
    #[error("the base's guard is gone")]
    Gone,
}

impl DeviceError for GuardError {
    fn kind(&self) -> FaultKind {
        match self {
            Self::Start(_) => FaultKind::System,
            Self::Arguments { .. } => FaultKind::Refused,
            Self::Base { kind, .. } => *kind,
            Self::Gone => FaultKind::Unplugged,
        }
    }
}
