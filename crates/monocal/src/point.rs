//! Where things are: in the picture and on the floor.

/// A place in the picture: `u` right, `v` down, pixel centres at integers [px].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PixelPoint {
    /// To the right [px].
    pub u: f64,
    /// Downwards [px].
    pub v: f64,
}

impl PixelPoint {
    /// A place from its coordinates [px].
    #[must_use]
    pub const fn new(u: f64, v: f64) -> Self {
        Self { u, v }
    }

    /// Neither coordinate is NaN or infinite.
    #[must_use]
    pub const fn is_finite(self) -> bool {
        self.u.is_finite() && self.v.is_finite()
    }
}

impl From<[f64; 2]> for PixelPoint {
    fn from([u, v]: [f64; 2]) -> Self {
        Self { u, v }
    }
}

impl From<PixelPoint> for [f64; 2] {
    fn from(p: PixelPoint) -> Self {
        [p.u, p.v]
    }
}

/// A place on the floor in `base_link` axes (REP-103): `x` forward, `y` left [m].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GroundPoint {
    /// Forward [m].
    pub x: f64,
    /// To the left [m].
    pub y: f64,
}

impl GroundPoint {
    /// A place from its coordinates [m].
    #[must_use]
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Neither coordinate is NaN or infinite.
    #[must_use]
    pub const fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }

    /// Euclidean distance [m].
    #[must_use]
    pub fn distance(self, other: Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }
}

impl From<[f64; 2]> for GroundPoint {
    fn from([x, y]: [f64; 2]) -> Self {
        Self { x, y }
    }
}

impl From<GroundPoint> for [f64; 2] {
    fn from(p: GroundPoint) -> Self {
        [p.x, p.y]
    }
}
