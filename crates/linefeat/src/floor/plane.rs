//! Lines of the picture as lines on the floor and as verticals.

use crate::{FloorView, Segment};

/// Directions on the floor are sorted into this many bins a quarter turn.
const BINS: usize = 45;
/// Two lines on the floor run the same way within this angle [rad].
const SAME_WAY: f64 = 0.1;
/// A line this far behind another hides nothing of it [m].
const BEHIND: f64 = 0.5;

pub(super) struct Plane {
    view: FloorView,
}

impl Plane {
    pub(super) fn new(view: &FloorView) -> Self {
        Self { view: *view }
    }

    pub(super) fn floor_point(&self, pixel: [f64; 2]) -> Option<[f64; 2]> {
        self.view.floor_point(pixel)
    }

    /// Unit direction in the picture from a pixel towards the nadir: down along a vertical, and on the floor
    /// towards the camera's foot.
    pub(super) fn down(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [a, b, w] = self.view.nadir;
        let sign = if w < 0.0 || (w == 0.0 && b < 0.0) {
            -1.0
        } else {
            1.0
        };
        let d = [sign * (a - u * w), sign * (b - v * w)];
        let length = d[0].hypot(d[1]);
        if length > 0.0 {
            [d[0] / length, d[1] / length]
        } else {
            [0.0, 1.0]
        }
    }

    pub(super) fn is_vertical(&self, segment: &Segment, angle: f64) -> bool {
        let down = self.down(middle(segment));
        let normal = [segment.theta.cos(), segment.theta.sin()];
        (down[0] * normal[0] + down[1] * normal[1]).abs() <= angle.sin()
    }

    /// The end towards the nadir.
    pub(super) fn lower_end(&self, segment: &Segment) -> [f64; 2] {
        let down = self.down(middle(segment));
        let along = [0, 1].map(|i| segment.end[i] - segment.start[i]);
        if along[0] * down[0] + along[1] * down[1] > 0.0 {
            segment.end
        } else {
            segment.start
        }
    }

    pub(super) fn on_floor(&self, segment: &Segment) -> bool {
        self.direction(segment).is_some()
    }

    /// Direction on the floor [rad], of either sense; `None` where an end is not on the floor.
    fn direction(&self, segment: &Segment) -> Option<f64> {
        let (a, b) = (
            self.floor_point(segment.start)?,
            self.floor_point(segment.end)?,
        );
        let angle = (b[1] - a[1]).atan2(b[0] - a[0]);
        angle.is_finite().then_some(angle)
    }

    /// The direction [rad, modulo a quarter turn] along or across which most of the floor's lines run.
    pub(super) fn main_direction(&self, segments: &[Segment], vertical_angle: f64) -> Option<f64> {
        let quarter = std::f64::consts::FRAC_PI_2;
        let mut bins = [0.0; BINS];
        let lines = segments
            .iter()
            .filter(|s| !self.is_vertical(s, vertical_angle));
        for segment in lines {
            if let Some(angle) = self.direction(segment) {
                let bin = (angle.rem_euclid(quarter) / quarter * BINS as f64) as usize;
                bins[bin.min(BINS - 1)] += segment.length_px();
            }
        }
        let around =
            |k: usize| 0.5 * bins[(k + BINS - 1) % BINS] + bins[k] + 0.5 * bins[(k + 1) % BINS];
        let best = (0..BINS).max_by(|&a, &b| around(a).total_cmp(&around(b)).then(b.cmp(&a)))?;
        (around(best) > 0.0).then_some((best as f64 + 0.5) * quarter / BINS as f64)
    }

    /// 1 along or across the main direction, less for what lies at an angle to it.
    pub(super) fn alignment(&self, segment: &Segment, main: Option<f64>) -> f64 {
        let (Some(main), Some(angle)) = (main, self.direction(segment)) else {
            return 0.5;
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        let off = (angle - main).rem_euclid(quarter);
        let off = off.min(quarter - off);
        0.4 + 0.6 / (1.0 + (off / 0.12).powi(4))
    }

    /// Which share of `far` lies closely behind `near`, seen from the camera, and runs as it does.
    pub(super) fn covered(&self, far: &Segment, near: &Segment) -> f64 {
        let (Some(a), Some(b)) = (self.direction(far), self.direction(near)) else {
            return 0.0;
        };
        if (a - b).sin().abs() > SAME_WAY {
            return 0.0;
        }
        let steps = 8;
        let behind = (0..=steps).filter(|&k| {
            let share = f64::from(k) / f64::from(steps);
            let p = [0, 1].map(|i| far.start[i] + share * (far.end[i] - far.start[i]));
            let down = self.down(p);
            let Some((ahead, place)) = ray_crossing(p, down, near) else {
                return false;
            };
            let apart = self.floor_point(p).zip(self.floor_point(place));
            let apart = apart.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
            ahead > 2.0 && apart.is_some_and(|m| m < BEHIND)
        });
        behind.count() as f64 / f64::from(steps + 1)
    }
}

fn middle(segment: &Segment) -> [f64; 2] {
    [0, 1].map(|i| 0.5 * (segment.start[i] + segment.end[i]))
}

/// Where a ray meets a segment: how far along the ray, and the place.
fn ray_crossing(from: [f64; 2], along: [f64; 2], segment: &Segment) -> Option<(f64, [f64; 2])> {
    let normal = [segment.theta.cos(), segment.theta.sin()];
    let rate = normal[0] * along[0] + normal[1] * along[1];
    let ahead = (segment.rho - normal[0] * from[0] - normal[1] * from[1]) / rate;
    let place = [from[0] + ahead * along[0], from[1] + ahead * along[1]];
    (ahead.is_finite() && beyond_ends(segment, place) <= 0.0).then_some((ahead, place))
}

/// Where two lines meet; `None` for lines within about 6 degrees of each other.
pub(super) fn crossing(a: &Segment, b: &Segment) -> Option<[f64; 2]> {
    let (sin, cos) = (b.theta - a.theta).sin_cos();
    if sin.abs() < 0.1 || !cos.is_finite() {
        return None;
    }
    Some([
        (a.rho * b.theta.sin() - b.rho * a.theta.sin()) / sin,
        (b.rho * a.theta.cos() - a.rho * b.theta.cos()) / sin,
    ])
}

/// Covariance of the place where two lines meet, from those of their normal forms [px^2].
pub(super) fn crossing_covariance(
    a: &Segment,
    b: &Segment,
    place: [f64; 2],
) -> Option<[[f64; 2]; 2]> {
    let sin = (b.theta - a.theta).sin();
    let (va, vb) = (variance_at(a, place), variance_at(b, place));
    // moving one line by d moves the place along the other line by d / sin
    let by_a = [b.theta.sin() / sin, -b.theta.cos() / sin];
    let by_b = [-a.theta.sin() / sin, a.theta.cos() / sin];
    let entry = |r: usize, c: usize| va * by_a[r] * by_a[c] + vb * by_b[r] * by_b[c];
    let covariance = [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]];
    covariance
        .iter()
        .flatten()
        .all(|v| v.is_finite())
        .then_some(covariance)
}

/// Variance of a line along its normal at a place on it [px^2].
pub(super) fn variance_at(s: &Segment, place: [f64; 2]) -> f64 {
    let t = place[1] * s.theta.cos() - place[0] * s.theta.sin();
    let c = &s.covariance;
    c[0][0] - 2.0 * t * c[0][1] + t * t * c[1][1]
}

/// How far a place on a segment's line is past the nearer end [px]; 0 or less between the ends.
pub(super) fn beyond_ends(segment: &Segment, place: [f64; 2]) -> f64 {
    let along = [0, 1].map(|i| segment.end[i] - segment.start[i]);
    let length = along[0].hypot(along[1]);
    let t = (0..2)
        .map(|i| (place[i] - segment.start[i]) * along[i] / length)
        .sum::<f64>();
    (-t).max(t - length)
}
