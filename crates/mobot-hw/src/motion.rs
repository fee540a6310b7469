//! Motion in the plane: commands, wheel travel, dead reckoning.

use occgrid::Pose2;

use crate::real::sin_cos;

/// A velocity of the base.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist2 {
    /// Forwards [m/s].
    pub linear: f64,
    /// Counter-clockwise [rad/s].
    pub angular: f64,
}

impl Twist2 {
    /// A velocity from its parts [m/s], [rad/s].
    #[must_use]
    pub const fn new(linear: f64, angular: f64) -> Self {
        Self { linear, angular }
    }

    /// Speeds of the left and the right wheel [m/s].
    #[must_use]
    pub fn wheels(self, track: f64) -> [f64; 2] {
        let turn = self.angular * track / 2.0;
        [self.linear - turn, self.linear + turn]
    }

    /// The velocity of a base whose wheels turn with these speeds [m/s].
    #[must_use]
    pub fn from_wheels([left, right]: [f64; 2], track: f64) -> Self {
        Self {
            linear: (left + right) / 2.0,
            angular: (right - left) / track,
        }
    }

    /// Whether both parts are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.linear.is_finite() && self.angular.is_finite()
    }
}

/// What the wheels have rolled, forwards positive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WheelTravel {
    /// [m]
    pub left: f64,
    /// [m]
    pub right: f64,
}

/// Dead reckoning: a pose carried along by wheel travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Odometry {
    track: f64,
    map_from_base: Pose2,
    travel: Option<WheelTravel>,
}

impl Odometry {
    /// Begins at a pose; `track` is the distance between the wheels [m].
    #[must_use]
    pub const fn new(map_from_base: Pose2, track: f64) -> Self {
        Self {
            track,
            map_from_base,
            travel: None,
        }
    }

    /// The pose so far.
    #[must_use]
    pub const fn pose(&self) -> Pose2 {
        self.map_from_base
    }

    /// Moves on to a new reading of the wheels; the first one only sets the start. Exact where both
    /// wheels kept their speeds since the last reading.
    pub fn update(&mut self, travel: WheelTravel) -> Pose2 {
        if let Some(before) = self.travel {
            let rolled = [travel.left - before.left, travel.right - before.right];
            self.map_from_base = rolled_on(self.map_from_base, rolled, self.track);
        }
        self.travel = Some(travel);
        self.map_from_base
    }
}

/// The pose after both wheels have rolled some way at constant speeds [m].
pub(crate) fn rolled_on(from: Pose2, rolled: [f64; 2], track: f64) -> Pose2 {
    let Twist2 {
        linear: way,
        angular: turn,
    } = Twist2::from_wheels(rolled, track);
    // the chord of an arc of this length, and its direction half way through the turn
    let half = turn / 2.0;
    let chord = if half.abs() < 1e-4 {
        way * (1.0 - half * half / 6.0)
    } else {
        way * sin_cos(half).0 / half
    };
    let (sin, cos) = sin_cos(from.theta + half);
    Pose2::new(
        from.x + chord * cos,
        from.y + chord * sin,
        from.theta + turn,
    )
}
