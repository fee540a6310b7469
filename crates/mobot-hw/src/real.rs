//! The one place for functions that platforms round differently: sums, products and square roots are
//! the same everywhere, sines are not. All simulated bytes depend on these alone.

use occgrid::{Point2, Pose2};

pub(crate) fn sin_cos(angle: f64) -> (f64, f64) {
    (libm::sin(angle), libm::cos(angle))
}

pub(crate) fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

pub(crate) fn acos(cosine: f64) -> f64 {
    libm::acos(cosine)
}

pub(crate) fn exp(x: f64) -> f64 {
    libm::exp(x)
}

pub(crate) fn ln(x: f64) -> f64 {
    libm::log(x)
}

pub(crate) fn pow(base: f64, exponent: f64) -> f64 {
    libm::pow(base, exponent)
}

pub(crate) fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

pub(crate) fn distance(a: Point2, b: Point2) -> f64 {
    length(a.x - b.x, a.y - b.y)
}

/// Into -pi..pi.
pub(crate) fn wrap(angle: f64) -> f64 {
    let turns = (angle / std::f64::consts::TAU).round();
    angle - turns * std::f64::consts::TAU
}

/// `x` rounded down, without a library call.
pub(crate) fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from((whole as f64) > x)
}

/// A frame placed in another, its sine and cosine taken once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Placed {
    pub(crate) origin: Point2,
    pub(crate) cos: f64,
    pub(crate) sin: f64,
}

impl Placed {
    pub(crate) fn at(pose: Pose2) -> Self {
        let (sin, cos) = sin_cos(pose.theta);
        Self {
            origin: pose.position(),
            cos,
            sin,
        }
    }

    /// A point of this frame, in the frame it is placed in.
    pub(crate) fn outward(&self, p: Point2) -> Point2 {
        let d = self.turned(p);
        Point2::new(self.origin.x + d.x, self.origin.y + d.y)
    }

    /// A point of the frame this one is placed in, in this frame.
    pub(crate) fn inward(&self, p: Point2) -> Point2 {
        let (x, y) = (p.x - self.origin.x, p.y - self.origin.y);
        Point2::new(self.cos * x + self.sin * y, self.cos * y - self.sin * x)
    }

    /// A direction of this frame, in the frame it is placed in.
    pub(crate) fn turned(&self, d: Point2) -> Point2 {
        Point2::new(
            self.cos * d.x - self.sin * d.y,
            self.sin * d.x + self.cos * d.y,
        )
    }

    /// `a_from_c` of `a_from_b` (self) and `b_from_c`.
    pub(crate) fn compose(&self, inner: &Self) -> Self {
        Self {
            origin: self.outward(inner.origin),
            cos: self.cos * inner.cos - self.sin * inner.sin,
            sin: self.sin * inner.cos + self.cos * inner.sin,
        }
    }

    pub(crate) fn inverse(&self) -> Self {
        let back = self.inward(Point2::new(0.0, 0.0));
        Self {
            origin: back,
            cos: self.cos,
            sin: -self.sin,
        }
    }
}
