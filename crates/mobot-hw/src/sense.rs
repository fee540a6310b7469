//! What devices tell: pings, frames, the state of the base.

use image::GrayImage;
use occgrid::Reading;

use crate::WheelTravel;

/// Directions from `from` counter-clockwise to `to` [rad, base frame].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bearings {
    /// The rightmost.
    pub from: f64,
    /// The leftmost, not below `from`.
    pub to: f64,
}

impl Bearings {
    /// One direction only.
    #[must_use]
    pub const fn fixed(bearing: f64) -> Self {
        Self {
            from: bearing,
            to: bearing,
        }
    }

    /// Whether a direction is among them, give or take a millionth of a radian.
    #[must_use]
    pub fn contain(&self, bearing: f64) -> bool {
        bearing >= self.from - 1e-6 && bearing <= self.to + 1e-6
    }
}

/// One firing of a sonar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ping {
    /// When it fired [s].
    pub stamp: f64,
    /// Where the beam pointed [rad, base frame].
    pub bearing: f64,
    /// Whether the beam stood still there.
    pub settled: bool,
    /// What came of it.
    pub reading: Reading,
}

/// One picture.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFrame {
    /// When it was exposed [s].
    pub stamp: f64,
    /// Counts up by one for every frame that the camera made, also those that nobody took.
    pub sequence: u64,
    /// The picture.
    pub image: GrayImage,
}

/// The state of a base.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BaseStatus {
    /// When it was so [s].
    pub stamp: f64,
    /// What the wheels have rolled since the base was opened.
    pub travel: WheelTravel,
    /// The bumper is pressed on its left.
    pub bump_left: bool,
    /// The bumper is pressed on its right.
    pub bump_right: bool,
    /// The floor ends under the base.
    pub cliff: bool,
    /// A wheel hangs in the air.
    pub wheel_drop: bool,
}

impl BaseStatus {
    /// Whether anything touches or endangers the base.
    #[must_use]
    pub const fn in_trouble(&self) -> bool {
        self.bump_left || self.bump_right || self.cliff || self.wheel_drop
    }
}
