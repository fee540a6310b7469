//! Corrections of the pose: what the camera fixed, and what the sonar measured to a known wall.

use monocal::{PoseFix, Prior};
use nalgebra::{Matrix3, Matrix6x3, SVector, Vector3};
use occgrid::Pose2;

use super::PoseFilter;
use super::angle::wrap;
use super::estimate::{Spread, State};

/// What a correction came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cue {
    /// A frame against the floor plan.
    Camera,
    /// A range to a wall of the floor plan.
    Sonar,
    /// All that the sonar heard round about, against the map.
    Sweep,
}

/// What came of a correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correction {
    /// What it came from.
    pub cue: Cue,
    /// Squared Mahalanobis length of the innovation: chi-square of `freedom` where all is well.
    pub nis: f64,
    /// Coordinates that were measured.
    pub freedom: usize,
    /// Whether it was within the gate and used.
    pub accepted: bool,
}

/// 99.9 % of chi-square with 1, 2 and 3 degrees of freedom.
const GATES: [f64; 3] = [10.83, 13.82, 16.27];

/// A coordinate counts as measured where the fix leaves less than this share of the prior's variance.
const MEASURED: f64 = 0.98;

impl PoseFilter {
    /// What is believed of the pose at a time [s], for a fix of a frame taken then.
    #[must_use]
    pub fn prior_at(&self, stamp: f64) -> Prior {
        let (state, spread) = self.carried(self.back_to(stamp));
        Prior {
            pose: Pose2::new(state[0], state[1], wrap(state[2])),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| spread[(i, j)])),
        }
    }

    /// Takes a fix of a frame taken at a time [s], made from [`Self::prior_at`] of that time: the belief in the
    /// pose becomes the fix's, and what is believed of the wheels follows. `weight`, above 0 and at most 1, is the
    /// share of the frame's information that is new: frames from one place share their systematic errors.
    pub fn correct(&mut self, stamp: f64, fix: &PoseFix, weight: f64) -> Correction {
        self.correct_to(Cue::Camera, stamp, fix.pose, fix.covariance, weight)
    }

    /// The same for any pose and covariance that a measurement made of [`Self::prior_at`] that time.
    pub fn correct_to(
        &mut self,
        cue: Cue,
        stamp: f64,
        pose: Pose2,
        covariance: [[f64; 3]; 3],
        weight: f64,
    ) -> Correction {
        let back = self.back_to(stamp);
        let (state, spread) = self.carried(back);
        let before = block(&spread);
        let after = Matrix3::from_fn(|i, j| covariance[i][j]);
        let off = Vector3::new(
            pose.x - state[0],
            pose.y - state[1],
            wrap(pose.theta - state[2]),
        );
        let mut correction = Correction {
            cue,
            nis: 0.0,
            freedom: 0,
            accepted: false,
        };
        let (Some(root), Some(inverse)) = (before.cholesky(), before.try_inverse()) else {
            return correction;
        };
        (correction.nis, correction.freedom) = consistency(&root.l(), &after, &off);
        let Some(gate) = correction.freedom.checked_sub(1).map(|k| GATES[k.min(2)]) else {
            return correction;
        };
        if correction.nis > gate {
            return correction;
        }
        let Some((after, off)) = weighted(&inverse, &after, &off, weight) else {
            return correction;
        };
        let gain: Matrix6x3<f64> = spread.fixed_columns::<3>(0) * inverse;
        let state = state + gain * off;
        let spread = spread + gain * (after - before) * gain.transpose();
        self.state = state;
        self.spread = symmetric(&spread);
        let forth = back.inverse();
        (self.state, self.spread) = self.carried(forth);
        correction.accepted = true;
        correction
    }

    /// Takes a measured distance: expected was `expected`, whose change with x, y and heading is `gradient`;
    /// `sigma` is that of the measurement and of the map [m].
    pub fn correct_range(
        &mut self,
        measured: f64,
        expected: f64,
        gradient: [f64; 3],
        sigma: f64,
    ) -> Correction {
        let mut h = SVector::<f64, 6>::zeros();
        h.fixed_rows_mut::<3>(0).copy_from_slice(&gradient);
        let cross = self.spread * h;
        let variance = h.dot(&cross) + sigma * sigma;
        let off = measured - expected;
        let nis = off * off / variance;
        let accepted = nis <= GATES[0];
        if accepted {
            self.state += cross * (off / variance);
            self.spread = symmetric(&(self.spread - cross * cross.transpose() / variance));
        }
        Correction {
            cue: Cue::Sonar,
            nis,
            freedom: 1,
            accepted,
        }
    }

    /// One sigma of a distance that the pose implies [m].
    #[must_use]
    pub fn range_sigma(&self, gradient: [f64; 3]) -> f64 {
        let g = Vector3::from(gradient);
        g.dot(&(block(&self.spread) * g)).max(0.0).sqrt()
    }

    /// Forgets where it is: the pose at a time [s] becomes this one, this well known; what is believed of the
    /// wheels stays.
    pub fn place(&mut self, stamp: f64, map_from_base: Pose2, covariance: [[f64; 3]; 3]) {
        let forth = self.back_to(stamp).inverse();
        let Pose2 { x, y, theta } = map_from_base;
        self.state
            .fixed_rows_mut::<3>(0)
            .copy_from_slice(&[x, y, theta]);
        let pose = Spread::from_fn(|i, j| match (covariance.get(i), j) {
            (Some(row), 0..3) => row[j],
            _ if i >= 3 && j >= 3 => self.spread[(i, j)],
            _ => 0.0,
        });
        self.spread = pose;
        (self.state, self.spread) = self.carried(forth);
    }

    /// Says that the pose is lost, or found again.
    pub const fn set_lost(&mut self, lost: bool) {
        self.lost = lost;
    }

    /// Whether the pose is lost.
    #[must_use]
    pub const fn is_lost(&self) -> bool {
        self.lost
    }

    fn back_to(&self, stamp: f64) -> Pose2 {
        self.base_now_from_base_at(stamp)
    }

    /// State and covariance of a pose that stands at `offset` in the base frame.
    fn carried(&self, offset: Pose2) -> (State, Spread) {
        let s = &self.state;
        let there = Pose2::new(s[0], s[1], s[2]).compose(offset);
        let mut state = *s;
        state[0] = there.x;
        state[1] = there.y;
        state[2] = there.theta;
        let mut f = Spread::identity();
        f[(0, 2)] = -(there.y - s[1]);
        f[(1, 2)] = there.x - s[0];
        (state, f * self.spread * f.transpose())
    }
}

/// What a fix would be, had its frame carried only a share of its information: covariance and offset.
fn weighted(
    prior: &Matrix3<f64>,
    after: &Matrix3<f64>,
    off: &Vector3<f64>,
    weight: f64,
) -> Option<(Matrix3<f64>, Vector3<f64>)> {
    let fixed = after.try_inverse()?;
    let covariance = (prior + (fixed - prior) * weight).try_inverse()?;
    Some((covariance, covariance * (fixed * off) * weight))
}

fn block(spread: &Spread) -> Matrix3<f64> {
    spread.fixed_view::<3, 3>(0, 0).into()
}

fn symmetric(spread: &Spread) -> Spread {
    (spread + spread.transpose()) / 2.0
}

/// The innovation's squared length in the measured directions, and how many there are: in coordinates in
/// which the prior is a unit sphere, what the fix took off its variance is the innovation's.
fn consistency(root: &Matrix3<f64>, after: &Matrix3<f64>, off: &Vector3<f64>) -> (f64, usize) {
    let Some(white) = root.try_inverse() else {
        return (0.0, 0);
    };
    let left = (white * after * white.transpose()).symmetric_eigen();
    let y = white * off;
    let (mut nis, mut freedom) = (0.0, 0);
    for k in 0..3 {
        let taken = 1.0 - left.eigenvalues[k];
        if left.eigenvalues[k] < MEASURED {
            let along = left.eigenvectors.column(k).dot(&y);
            nis += along * along / taken;
            freedom += 1;
        }
    }
    (nis, freedom)
}

#[cfg(test)]
mod tests {
    use super::super::FilterParams;
    use super::*;
    use mobot_hw::{BaseStatus, WheelTravel};
    use monocal::{FixStatus, Observed, PositionAxis};

    fn fix(pose: Pose2, covariance: [[f64; 3]; 3]) -> PoseFix {
        let axis = PositionAxis {
            direction: [1.0, 0.0],
            sigma: 1.0,
            observed: false,
        };
        PoseFix {
            status: FixStatus::Ok,
            pose,
            covariance,
            observed: Observed::default(),
            axes: [axis; 2],
            matched: Vec::new(),
            pitch: 0.0,
        }
    }

    fn driven() -> PoseFilter {
        let mut filter = PoseFilter::new(Pose2::new(1.0, 2.0, 0.3), 0.3, FilterParams::default());
        for k in 0..50 {
            let way = 0.02 * f64::from(k);
            filter.predict(&BaseStatus {
                stamp: 0.05 * f64::from(k),
                travel: WheelTravel {
                    left: way,
                    right: 1.1 * way,
                },
                ..BaseStatus::default()
            });
        }
        filter
    }

    /// A Kalman update by its textbook, with the pose measured.
    fn textbook(filter: &PoseFilter, z: Vector3<f64>, r: Matrix3<f64>) -> (State, Spread, f64) {
        let p = filter.spread;
        let s = block(&p) + r;
        let inverse = s.try_inverse().expect("regular");
        let gain: Matrix6x3<f64> = p.fixed_columns::<3>(0) * inverse;
        let y = z - filter.state.fixed_rows::<3>(0);
        (
            filter.state + gain * y,
            p - gain * s * gain.transpose(),
            y.dot(&(inverse * y)),
        )
    }

    #[test]
    fn a_fix_corrects_as_a_measurement_of_the_pose_does() {
        let mut filter = driven();
        let r = Matrix3::new(4e-4, 1e-5, 0.0, 1e-5, 9e-4, 2e-5, 0.0, 2e-5, 1e-4);
        let z = filter.state.fixed_rows::<3>(0) + Vector3::new(0.02, -0.03, 0.01);
        let (state, spread, nis) = textbook(&filter, z, r);
        // the fix as the camera side makes it: prior and measurement together
        let stamp = 0.05 * 49.0;
        let prior = filter.prior_at(stamp);
        assert!((prior.pose.x - filter.state[0]).abs() < 1e-12);
        let covariance = std::array::from_fn(|i| std::array::from_fn(|j| spread[(i, j)]));
        let pose = Pose2::new(state[0], state[1], state[2]);
        let correction = filter.correct(stamp, &fix(pose, covariance), 1.0);
        assert!(correction.accepted && correction.freedom == 3);
        assert!((correction.nis - nis).abs() < 1e-6 * nis.max(1.0));
        assert!((filter.state - state).amax() < 1e-9);
        assert!((filter.spread - spread).amax() < 1e-9);
    }

    #[test]
    fn half_the_weight_twice_is_the_whole() {
        let r = Matrix3::new(4e-4, 1e-5, 0.0, 1e-5, 9e-4, 2e-5, 0.0, 2e-5, 1e-4);
        let stamp = 0.05 * 49.0;
        let z = driven().state.fixed_rows::<3>(0) + Vector3::new(0.02, -0.03, 0.01);
        let once = |filter: &mut PoseFilter, weight: f64| {
            let (state, spread, _) = textbook(filter, z, r);
            let covariance = std::array::from_fn(|i| std::array::from_fn(|j| spread[(i, j)]));
            let pose = Pose2::new(state[0], state[1], state[2]);
            assert!(
                filter
                    .correct(stamp, &fix(pose, covariance), weight)
                    .accepted
            );
        };
        let (mut whole, mut halves) = (driven(), driven());
        once(&mut whole, 1.0);
        once(&mut halves, 0.5);
        once(&mut halves, 0.5);
        assert!((whole.state - halves.state).amax() < 1e-9);
        assert!((whole.spread - halves.spread).amax() < 1e-9);
    }

    #[test]
    fn a_fix_of_an_earlier_frame_moves_the_present_pose() {
        let mut filter = driven();
        let stamp = 0.05 * 40.0;
        let prior = filter.prior_at(stamp);
        let moved = Pose2::new(prior.pose.x + 0.01, prior.pose.y, prior.pose.theta);
        let before = filter.estimate().map_from_base;
        let tight = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]];
        assert!(filter.correct(stamp, &fix(moved, tight), 1.0).accepted);
        let after = filter.estimate().map_from_base;
        assert!((after.x - before.x - 0.01).abs() < 1e-9 && (after.y - before.y).abs() < 1e-9);
        assert!((filter.prior_at(stamp).pose.x - moved.x).abs() < 1e-9);
    }

    #[test]
    fn a_fix_that_cannot_be_is_refused() {
        let mut filter = driven();
        let stamp = 0.05 * 49.0;
        let prior = filter.prior_at(stamp);
        let far = Pose2::new(prior.pose.x + 1.0, prior.pose.y, prior.pose.theta);
        let tight = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-5]];
        let before = filter.estimate();
        let correction = filter.correct(stamp, &fix(far, tight), 1.0);
        assert!(!correction.accepted && correction.nis > 100.0);
        assert_eq!(filter.estimate(), before);
    }

    #[test]
    fn a_range_corrects_along_its_wall_alone() {
        let mut filter = driven();
        let before = filter.estimate();
        let gradient = [-1.0, 0.0, 0.0];
        let sigma = filter.range_sigma(gradient);
        let correction = filter.correct_range(2.0 - sigma, 2.0, gradient, sigma);
        let after = filter.estimate();
        assert!(correction.accepted && (correction.nis - 0.5).abs() < 1e-9);
        let moved = after.map_from_base.x - before.map_from_base.x;
        assert!((moved - sigma / 2.0).abs() < 1e-9);
        let taken = before.covariance[0][0] - after.covariance[0][0];
        assert!((taken - sigma * sigma / 2.0).abs() < 1e-9);
        assert!(
            !filter
                .correct_range(2.0 + 9.0 * sigma, 2.0, gradient, sigma)
                .accepted
        );
    }
}
