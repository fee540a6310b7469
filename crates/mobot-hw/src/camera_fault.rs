//! What goes wrong with cameras, and the count of it.

use std::io::ErrorKind;

use thiserror::Error;

use crate::{DeviceError, FaultKind};

/// What was wrong with one frame. Such a frame is passed over, and counted.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum FrameFault {
    /// Its end did not come.
    #[error("frame cut short")]
    CutShort,
    /// It is longer than frames may be.
    #[error("frame longer than {limit} bytes")]
    TooLong {
        /// [bytes]
        limit: usize,
    },
    /// Fewer bytes than a picture of its size has.
    #[error("frame too short: expected {expected} bytes, found {found}")]
    TooShort {
        /// [bytes]
        expected: usize,
        /// [bytes]
        found: usize,
    },
    /// No valid JPEG.
    #[error("frame is no valid JPEG")]
    Undecodable,
    /// Not the size of the frames before.
    #[error("frame of another size: expected {expected:?} px, found {found:?} px")]
    Size {
        /// Width and height of those [px].
        expected: [u32; 2],
        /// Of this one [px].
        found: [u32; 2],
    },
    /// The camera's driver says that it is damaged.
    #[error("frame damaged on its way")]
    Flagged,
    /// Its time stamp cannot be.
    #[error("frame stamped {ahead:.3} s in the future")]
    Future {
        /// [s]
        ahead: f64,
    },
}

/// Why a camera gave no frame.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// Nothing came.
    #[error("no frame within {waited:.3} s")]
    Silent {
        /// [s]
        waited: f64,
    },
    /// Frames came, and none was good.
    #[error("no good frame within {waited:.3} s, the last fault: {fault}")]
    Garbled {
        /// [s]
        waited: f64,
        /// Of the last one.
        fault: FrameFault,
    },
    /// Frames came, and all were old.
    #[error("no fresh frame within {waited:.3} s, the newest {age:.3} s old")]
    Stale {
        /// [s]
        waited: f64,
        /// When it came [s].
        age: f64,
    },
    /// The camera is gone.
    #[error("the camera is gone")]
    Unplugged,
    /// The stream has ended.
    #[error("the stream has ended")]
    Ended,
    /// Another program has it.
    #[error("{camera}: in use by another program")]
    Busy {
        /// As it was named.
        camera: String,
    },
    /// It cannot do what was asked.
    #[error("{camera}: {what}: expected {expected}, found {found}")]
    Refused {
        /// As it was named.
        camera: String,
        /// Which setting.
        what: &'static str,
        /// What was asked for.
        expected: String,
        /// What the camera has instead.
        found: String,
    },
    /// The operating system failed.
    #[error("{camera}: {doing}: {kind}")]
    System {
        /// As it was named.
        camera: String,
        /// What failed.
        doing: &'static str,
        /// How.
        kind: ErrorKind,
    },
}

impl DeviceError for CameraError {
    fn kind(&self) -> FaultKind {
        match self {
            Self::Silent { .. } | Self::Stale { .. } => FaultKind::Silent,
            Self::Garbled { .. } => FaultKind::Garbled,
            Self::Unplugged | Self::Ended => FaultKind::Unplugged,
            Self::Busy { .. } | Self::Refused { .. } => FaultKind::Refused,
            Self::System { .. } => FaultKind::System,
        }
    }
}

/// What became of a camera's frames since it was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FrameCounts {
    /// Handed out.
    pub given: u64,
    /// Came, and were not handed out because newer ones had come or they were old.
    pub passed_over: u64,
    /// Came damaged.
    pub damaged: u64,
    /// Never came: gaps in the driver's own count.
    pub missed: u64,
}

/// Holds frames to one size, since what was calibrated for one is wrong for another: to the first that two frames
/// in a row had, as the very first may be damaged.
#[derive(Debug, Default)]
pub(crate) struct SizeLock {
    size_px: [u32; 2],
    locked: bool,
}

impl SizeLock {
    pub(crate) fn check(&mut self, found: [u32; 2]) -> Result<(), FrameFault> {
        let expected = self.size_px;
        if self.locked && expected != found {
            return Err(FrameFault::Size { expected, found });
        }
        self.locked = expected == found;
        self.size_px = found;
        Ok(())
    }
}
