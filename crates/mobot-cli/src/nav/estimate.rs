//! Where the robot is: wheel travel carries a pose on, and what it does not know grows with the way.
//!
//! The state is the pose and what the wheels get wrong all the time: the true diameters of both wheels and
//! the true distance between them, over the stated ones. The covariance is that of the six together, so that
//! a correction of the pose also teaches how the wheels err.

use mobot_hw::{BaseStatus, Odometry, WheelTravel};
use nalgebra::{Matrix2, SMatrix, SVector};
use occgrid::Pose2;

use super::angle::wrap;

/// How well wheels are known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterParams {
    /// One sigma of a wheel's diameter over the stated one, 0 or more. Raised: the filter learns faster, and
    /// wanders more before it has.
    pub wheel_sigma: f64,
    /// One sigma of the distance between the wheels over the stated one, 0 or more. Raised: as above, for turns.
    pub track_sigma: f64,
    /// One sigma of the random slip of a wheel after 1 m [m], 0 or more; grows with the square root of the
    /// way. Raised: corrections weigh more.
    pub slip: f64,
    /// One sigma of the start pose's coordinates [m], above 0.
    pub start_sigma: f64,
    /// One sigma of the start's heading [rad], above 0.
    pub start_heading_sigma: f64,
    /// One sigma of what plan and calibration have wrong all over a place, which no number of frames averages
    /// away [m], 0 or more; counted in every estimate.
    pub systematic: f64,
    /// The same for the heading [rad].
    pub systematic_heading: f64,
    /// Past this sigma the position is uncertain [m].
    pub position_limit: f64,
    /// Past this sigma the heading is uncertain [rad].
    pub heading_limit: f64,
}

impl Default for FilterParams {
    fn default() -> Self {
        Self {
            wheel_sigma: 0.01,
            track_sigma: 0.02,
            slip: 0.006,
            start_sigma: 0.01,
            start_heading_sigma: 0.5_f64.to_radians(),
            systematic: 0.008,
            systematic_heading: 0.25_f64.to_radians(),
            position_limit: 0.3,
            heading_limit: 10.0_f64.to_radians(),
        }
    }
}

/// How far a pose can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Confidence {
    /// Within the limits.
    #[default]
    Tracking,
    /// Its sigma is past a limit.
    Uncertain,
    /// What is sensed contradicts it.
    Lost,
}

/// A pose and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseEstimate {
    /// When it held [s].
    pub stamp: f64,
    /// The pose; its heading is not wrapped.
    pub map_from_base: Pose2,
    /// Covariance of (x, y, theta) in the map frame [m^2, m rad, rad^2].
    pub covariance: [[f64; 3]; 3],
    /// How far to trust it.
    pub confidence: Confidence,
}

impl PoseEstimate {
    /// One sigma of the position in its worst direction [m].
    #[must_use]
    pub fn position_sigma(&self) -> f64 {
        let c = &self.covariance;
        Matrix2::new(c[0][0], c[0][1], c[1][0], c[1][1])
            .symmetric_eigenvalues()
            .max()
            .max(0.0)
            .sqrt()
    }

    /// One sigma of the heading [rad].
    #[must_use]
    pub fn heading_sigma(&self) -> f64 {
        self.covariance[2][2].max(0.0).sqrt()
    }
}

pub(super) type State = SVector<f64, 6>;
pub(super) type Spread = SMatrix<f64, 6, 6>;

/// How many past moments are kept for sensors that tell late.
const KEPT: usize = 32;

/// The past, for placing what was sensed then.
#[derive(Debug, Clone, Copy)]
struct Moment {
    stamp: f64,
    odom_from_base: Pose2,
}

/// The pose, carried on by wheels and corrected by what is seen and heard.
#[derive(Debug, Clone)]
pub struct PoseFilter {
    pub(super) params: FilterParams,
    track: f64,
    /// x, y, theta, and what left wheel, right wheel and track are over their stated size, less 1.
    pub(super) state: State,
    pub(super) spread: Spread,
    pub(super) lost: bool,
    odometry: Odometry,
    travel: Option<WheelTravel>,
    stamp: f64,
    past: Vec<Moment>,
}

impl PoseFilter {
    /// Begins at a pose; `track` is the stated distance between the wheels [m].
    #[must_use]
    pub fn new(map_from_base: Pose2, track: f64, params: FilterParams) -> Self {
        let Pose2 { x, y, theta } = map_from_base;
        let sigmas = State::from([
            params.start_sigma,
            params.start_sigma,
            params.start_heading_sigma,
            params.wheel_sigma,
            params.wheel_sigma,
            params.track_sigma,
        ]);
        Self {
            params,
            track,
            state: State::from([x, y, theta, 0.0, 0.0, 0.0]),
            spread: Spread::from_diagonal(&sigmas.component_mul(&sigmas)),
            lost: false,
            odometry: Odometry::new(map_from_base, track),
            travel: None,
            stamp: 0.0,
            past: Vec::new(),
        }
    }

    /// Carries the pose on to what the wheels say now; the first status only sets the start.
    pub fn predict(&mut self, status: &BaseStatus) {
        let before = self.travel.replace(status.travel);
        self.stamp = status.stamp;
        self.odometry.update(status.travel);
        if let Some(before) = before {
            let rolled = [
                status.travel.left - before.left,
                status.travel.right - before.right,
            ];
            self.roll(rolled);
        }
        if self.past.len() == KEPT {
            self.past.remove(0);
        }
        self.past.push(Moment {
            stamp: status.stamp,
            odom_from_base: self.odometry.pose(),
        });
    }

    fn roll(&mut self, [left, right]: [f64; 2]) {
        if left.abs() + right.abs() < 1e-12 {
            return;
        }
        let s = self.state;
        let track = self.track * (1.0 + s[5]);
        let (l, r) = (left * (1.0 + s[3]), right * (1.0 + s[4]));
        let mut carried = Odometry::new(Pose2::new(s[0], s[1], s[2]), track);
        carried.update(WheelTravel::default());
        let next = carried.update(WheelTravel { left: l, right: r });
        let (way, turn) = ((l + r) / 2.0, (r - l) / track);
        let (sin, cos) = (s[2] + turn / 2.0).sin_cos();
        // how the pose answers to a change of the way and of the turn
        let by_way = [cos, sin, 0.0];
        let by_turn = [-way * sin / 2.0, way * cos / 2.0, 1.0];
        let column = |d_way: f64, d_turn: f64| -> [f64; 3] {
            std::array::from_fn(|i| by_way[i] * d_way + by_turn[i] * d_turn)
        };
        let by_left = column(0.5, -1.0 / track);
        let by_right = column(0.5, 1.0 / track);
        let by_track = column(0.0, -turn / (1.0 + s[5]));
        let mut f = Spread::identity();
        f[(0, 2)] = -way * sin;
        f[(1, 2)] = way * cos;
        for i in 0..3 {
            f[(i, 3)] = by_left[i] * left;
            f[(i, 4)] = by_right[i] * right;
            f[(i, 5)] = by_track[i];
        }
        self.spread = f * self.spread * f.transpose();
        let slip = self.params.slip * self.params.slip;
        for (column, rolled) in [(by_left, left), (by_right, right)] {
            for i in 0..3 {
                for j in 0..3 {
                    self.spread[(i, j)] += column[i] * column[j] * slip * rolled.abs();
                }
            }
        }
        self.state = State::from([next.x, next.y, next.theta, s[3], s[4], s[5]]);
    }

    /// Where the robot is thought to be now.
    #[must_use]
    pub fn estimate(&self) -> PoseEstimate {
        let s = &self.state;
        let (place, heading) = (self.params.systematic, self.params.systematic_heading);
        let floor = [place, place, heading].map(|sigma| sigma * sigma);
        let entry = |i: usize, j: usize| self.spread[(i, j)] + if i == j { floor[i] } else { 0.0 };
        let mut estimate = PoseEstimate {
            stamp: self.stamp,
            map_from_base: Pose2::new(s[0], s[1], s[2]),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j))),
            confidence: Confidence::Tracking,
        };
        if self.lost {
            estimate.confidence = Confidence::Lost;
        } else if estimate.position_sigma() > self.params.position_limit
            || estimate.heading_sigma() > self.params.heading_limit
        {
            estimate.confidence = Confidence::Uncertain;
        }
        estimate
    }

    /// The pose by dead reckoning alone.
    #[must_use]
    pub const fn odom_from_base(&self) -> Pose2 {
        self.odometry.pose()
    }

    /// Dead reckoning at a time [s], between the moments that the wheels told of.
    #[must_use]
    pub fn odom_from_base_at(&self, stamp: f64) -> Pose2 {
        let Some(last) = self.past.last() else {
            return self.odometry.pose();
        };
        let after = self.past.iter().position(|m| m.stamp >= stamp);
        let (a, b) = match after {
            None => return last.odom_from_base,
            Some(0) => return self.past[0].odom_from_base,
            Some(i) => (&self.past[i - 1], &self.past[i]),
        };
        let share = (stamp - a.stamp) / (b.stamp - a.stamp);
        let (p, q) = (a.odom_from_base, b.odom_from_base);
        Pose2::new(
            p.x + (q.x - p.x) * share,
            p.y + (q.y - p.y) * share,
            p.theta + (q.theta - p.theta) * share,
        )
    }

    /// `now_from_then`: where the base was at a time [s], in the base frame of now.
    #[must_use]
    pub fn base_now_from_base_at(&self, stamp: f64) -> Pose2 {
        self.odom_from_base()
            .inverse()
            .compose(self.odom_from_base_at(stamp))
    }

    /// Where the robot is now thought to have been at a time [s].
    #[must_use]
    pub fn map_from_base_at(&self, stamp: f64) -> Pose2 {
        let s = &self.state;
        let back = self.base_now_from_base_at(stamp);
        let then = Pose2::new(s[0], s[1], s[2]).compose(back);
        Pose2::new(then.x, then.y, wrap(then.theta))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rolled(filter: &mut PoseFilter, from: f64, to: f64, ratio: f64) {
        for k in 0..=200 {
            let way = from + (to - from) * f64::from(k) / 200.0;
            filter.predict(&BaseStatus {
                stamp: way,
                travel: WheelTravel {
                    left: way,
                    right: way * ratio,
                },
                ..BaseStatus::default()
            });
        }
    }

    #[test]
    fn the_spread_holds_what_wheels_may_have_done() {
        // a wheel 1 % too large turns the robot by 0.01 / 0.235 rad a metre: within two sigmas, and so is the way
        let mut filter = PoseFilter::new(Pose2::default(), 0.235, FilterParams::default());
        rolled(&mut filter, 0.0, 2.0, 1.0);
        let estimate = filter.estimate();
        assert!((estimate.map_from_base.x - 2.0).abs() < 1e-9);
        let turned = 0.01 * 2.0 / 0.235;
        assert!(
            (turned..2.5 * turned).contains(&estimate.heading_sigma()),
            "{estimate:?}"
        );
        assert!(estimate.covariance[0][0].sqrt() > 0.014);
        assert_eq!(estimate.confidence, Confidence::Tracking);
        rolled(&mut filter, 2.0, 12.0, 1.0);
        assert_eq!(filter.estimate().confidence, Confidence::Uncertain);
    }

    #[test]
    fn the_past_is_between_what_the_wheels_said() {
        let mut filter = PoseFilter::new(Pose2::new(1.0, 2.0, 0.0), 0.3, FilterParams::default());
        rolled(&mut filter, 0.0, 2.0, 1.0);
        let then = filter.map_from_base_at(1.903);
        assert!((then.x - 2.903).abs() < 1e-9 && (then.y - 2.0).abs() < 1e-9);
    }
}
