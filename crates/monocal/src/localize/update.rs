//! What taking a feature for a landmark does to a belief: one Kalman update.

use nalgebra::{Matrix2, SMatrix, Vector2};

use super::belief::{Belief, UNKNOWNS, Unknowns};
use super::model::Prediction;

/// The step for one feature.
pub(super) struct Update {
    gain: SMatrix<f64, UNKNOWNS, 2>,
    innovation: Vector2<f64>,
    covariance: Matrix2<f64>,
    /// Mahalanobis distance of the innovation, squared.
    pub(super) distance: f64,
    /// Log of the innovation's density [1/px^2].
    pub(super) log_density: f64,
}

impl Update {
    /// From a prediction at some value of the unknowns.
    pub(super) fn new(seen: &Prediction, belief: &Belief, at: &Unknowns) -> Option<Self> {
        let cross = belief.spread * seen.rows.transpose();
        let covariance = seen.rows * cross + seen.noise;
        let inverse = covariance.try_inverse()?;
        let residual = seen.residual + seen.rows * (belief.mean - at);
        let distance = residual.dot(&(inverse * residual));
        let determinant = covariance.determinant();
        (determinant > 0.0 && distance.is_finite()).then(|| Self {
            gain: cross * inverse,
            innovation: -residual,
            covariance,
            distance,
            log_density: -0.5 * distance - (std::f64::consts::TAU * determinant.sqrt()).ln(),
        })
    }

    pub(super) fn moved(&self, belief: &Belief) -> Unknowns {
        belief.mean + self.gain * self.innovation
    }

    pub(super) fn applied(&self, belief: &Belief) -> Belief {
        Belief {
            mean: self.moved(belief),
            spread: belief.spread - self.gain * self.covariance * self.gain.transpose(),
        }
    }
}
