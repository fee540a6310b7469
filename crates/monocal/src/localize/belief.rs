//! Where the unknowns are thought to be, and what the prior says of them.

use nalgebra::{SMatrix, SVector, Vector2};

use super::Prior;
use super::model::Model;

/// x, y, theta; nod, roll; eight of the homography's chart.
pub(super) const UNKNOWNS: usize = 13;
pub(super) type Unknowns = SVector<f64, UNKNOWNS>;
pub(super) type Spread = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
pub(super) type Rows = SMatrix<f64, 2, UNKNOWNS>;

/// Where the unknowns are thought to be.
#[derive(Clone)]
pub(super) struct Belief {
    pub(super) mean: Unknowns,
    pub(super) spread: Spread,
}

/// A prior wider than this is searched in parts, each as wide [m].
const PART_SIGMA: f64 = 0.3;
/// Parts of a wide prior to either side, at most.
const MOST_PARTS: i32 = 5;

impl Belief {
    /// Narrower beliefs that together cover this one, where steps from its middle would be too long to be
    /// linear: the middle first, then to either side along a direction in the map, the walls': across it they
    /// tell at once where the robot is, along it doors that look alike are.
    pub(super) fn parts(&self, along: Option<Vector2<f64>>) -> Vec<Self> {
        let position = self.spread.fixed_view::<2, 2>(0, 0).into_owned();
        let along = along.unwrap_or_else(|| {
            let eigen = nalgebra::SymmetricEigen::new(position);
            eigen
                .eigenvectors
                .column(eigen.eigenvalues.imax())
                .into_owned()
        });
        let sigma = along.dot(&(position * along)).max(0.0).sqrt();
        if sigma <= PART_SIGMA {
            return vec![self.clone()];
        }
        // a sigma along it takes the other unknowns with it as they are correlated
        let with: Unknowns = self.spread.fixed_columns::<2>(0) * along / sigma;
        let spread = self.spread - with * with.transpose() * (1.0 - (PART_SIGMA / sigma).powi(2));
        let reach = ((2.5 * sigma / (2.0 * PART_SIGMA)).ceil() as i32).min(MOST_PARTS);
        let mut shifts: Vec<i32> = (-reach..=reach).collect();
        shifts.sort_by_key(|shift| shift.abs());
        let parts = shifts.into_iter().map(|shift| Self {
            mean: self.mean + with * (2.0 * PART_SIGMA * f64::from(shift) / sigma),
            spread,
        });
        parts.collect()
    }
}

impl Model<'_> {
    /// The prior over all unknowns; `None` for a prior that is not finite or not positive definite.
    pub(super) fn start(&self, prior: &Prior) -> Option<Belief> {
        let mut mean = Unknowns::zeros();
        mean[0] = prior.pose.x;
        mean[1] = prior.pose.y;
        mean[2] = prior.pose.theta;
        let mut spread = Spread::zeros();
        for r in 0..3 {
            for c in 0..3 {
                spread[(r, c)] = 0.5 * (prior.covariance[r][c] + prior.covariance[c][r]);
            }
        }
        let nods = f64::from(u8::from(self.lens.is_some()));
        let least = 1e-9;
        spread[(3, 3)] = nods * self.params.pitch_sigma.powi(2) + least * least;
        spread[(4, 4)] = nods * self.params.roll_sigma.powi(2) + least * least;
        for r in 0..8 {
            for c in 0..8 {
                spread[(5 + r, 5 + c)] = self.camera.covariance[r][c];
            }
            // an exact calibration still needs an information matrix
            spread[(5 + r, 5 + r)] += 1e-24;
        }
        let finite = mean.iter().chain(spread.iter()).all(|v| v.is_finite());
        let definite = nalgebra::Cholesky::new(spread).is_some();
        (finite && definite).then_some(Belief { mean, spread })
    }
}
