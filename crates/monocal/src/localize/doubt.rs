//! What a solution owes to features that may be none: its mean and covariance with that chance counted.
//!
//! Each feature is left out in turn. How likely it is none is weighed where the others predict it, and the
//! solutions with and without it are mixed by their moments (as in probabilistic data association, Bar-Shalom,
//! Tse 1975). A lone corner that places the robot to a millimetre is so believed to what its chance allows.

use nalgebra::SMatrix;

use super::associate::{DOUBT, clutter};
use super::belief::{Spread, UNKNOWNS, Unknowns};
use super::feature::Feature;
use super::landmarks::Landmarks;
use super::model::Model;
use super::solve::trust;

/// The moments of a solution for one reading, doubt counted; `covariance` is that of its unknowns at `mean`.
pub(super) fn doubted(
    model: &Model<'_>,
    features: &[Feature],
    landmarks: &Landmarks,
    choice: &[Option<usize>],
    mean: &Unknowns,
    covariance: &Spread,
) -> Option<(Unknowns, Spread)> {
    let view = model.view(mean)?;
    let (mut shift, mut wider) = (Unknowns::zeros(), *covariance);
    for (feature, choice) in features.iter().zip(choice) {
        let Some(choice) = *choice else {
            continue;
        };
        let seen = model.predict(feature, landmarks, choice, &view)?;
        let noise = seen.noise / trust(&seen)?;
        let cross: SMatrix<f64, UNKNOWNS, 2> = covariance * seen.rows.transpose();
        // the solution without it, by Woodbury's formula
        let Some(left) = (noise - seen.rows * cross).try_inverse() else {
            continue;
        };
        let without = cross * left * cross.transpose();
        let step = cross * left * seen.residual;
        let innovation = seen.residual + seen.rows * step;
        let spread = noise + seen.rows * (covariance + without) * seen.rows.transpose();
        let distance = innovation.dot(&(spread.try_inverse()? * innovation));
        let density =
            (-0.5 * distance).exp() / (std::f64::consts::TAU * spread.determinant().sqrt());
        let confidence = feature.confidence.clamp(DOUBT, 1.0 - DOUBT);
        let none = (1.0 - confidence) * clutter(feature.kind);
        let none = none / (none + confidence * density);
        if none.is_finite() {
            shift += step * none;
            wider += (without + step * step.transpose() * (1.0 - none)) * none;
        }
    }
    let definite = nalgebra::Cholesky::new(wider).is_some();
    definite.then_some((mean + shift, wider))
}
