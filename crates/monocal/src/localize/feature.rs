//! Features of a frame as measurements, with their noise.

use nalgebra::{Matrix2, Vector2};

use super::Observations;
use super::model::Model;
use super::view::towards;
use crate::PixelPoint;

/// A feature of the frame, in undistorted pixels: two measured distances along normals.
#[derive(Clone)]
pub(super) struct Feature {
    pub(super) kind: Kind,
    /// Places (u, v); of a corner, its own twice.
    pub(super) places: [Vector2<f64>; 2],
    /// Directions in which they are measured; of a corner, for a camera that neither nods nor rolls.
    pub(super) normals: [Vector2<f64>; 2],
    /// Covariance of the two measured distances [px^2].
    pub(super) noise: Matrix2<f64>,
    /// Probability that it is what it seems.
    pub(super) confidence: f64,
    /// Of a corner, how far the nearest other vertical is seen beside its own [px].
    pub(super) beside_px: f64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Edge(usize),
    Corner(usize),
}

/// The foot of a vertical on a floor edge is this uncertain along the vertical [px]: where it is not the
/// wall's edge but the skirting's, the foot is another.
const FOOT_PX: f64 = 12.0;

impl Model<'_> {
    pub(super) fn features(&self, observations: &Observations) -> Vec<Feature> {
        let edges = observations.edges.iter().enumerate();
        let edges = edges.filter_map(|(index, edge)| {
            let ends = [edge.start, edge.end].map(Vector2::from);
            let along = tangent((ends[1] - ends[0]).try_normalize(1.0)?);
            let normal = Vector2::new(-along.y, along.x);
            // rate of the normal form's distance at each end, by rho and theta
            let rates = Matrix2::from_fn(|r, c| if c == 0 { -1.0 } else { along.dot(&ends[r]) });
            let noise = rates * square(&edge.covariance) * rates.transpose();
            let places = [self.ideal(ends[0])?, self.ideal(ends[1])?];
            let along = (places[1] - places[0]).try_normalize(1.0)?;
            let noise = noise + Matrix2::identity() * self.params.bias_px.powi(2);
            Some(Feature {
                kind: Kind::Edge(index),
                places,
                normals: [Vector2::new(-along.y, along.x); 2].map(|n| n * n.dot(&normal).signum()),
                noise,
                confidence: edge.confidence,
                beside_px: f64::INFINITY,
            })
        });
        let corners = observations.corners.iter().enumerate();
        let corners = corners.filter_map(|(index, corner)| {
            let place = self.ideal(corner.pixel.into())?;
            let edge = corner.edge.and_then(|e| observations.edges.get(e));
            let [across, down] = match (
                self.nadir.and_then(|nadir| towards(nadir.into(), place)),
                edge,
            ) {
                (Some(down), _) => [Vector2::new(-down.y, down.x), down],
                (None, Some(edge)) => {
                    let along = Vector2::from(edge.end) - Vector2::from(edge.start);
                    let along = along.try_normalize(1.0)?;
                    [along, Vector2::new(-along.y, along.x)]
                }
                (None, None) => [Vector2::x(), Vector2::y()],
            };
            let turn = Matrix2::from_rows(&[across.transpose(), down.transpose()]);
            let mut noise = turn * square(&corner.covariance) * turn.transpose();
            noise += Matrix2::identity() * self.params.bias_px.powi(2);
            if edge.is_some() {
                noise[(1, 1)] += FOOT_PX * FOOT_PX;
            }
            let others = observations.corners.iter().enumerate();
            let apart = others
                .filter(|(other, _)| *other != index)
                .filter_map(|(_, other)| {
                    let to = self.ideal(other.pixel.into())? - place;
                    Some(across.dot(&to).abs())
                });
            let beside_px = apart.fold(f64::INFINITY, f64::min);
            Some(Feature {
                kind: Kind::Corner(index),
                places: [place; 2],
                normals: [across, down],
                noise,
                confidence: corner.confidence,
                beside_px,
            })
        });
        let usable = |f: &Feature| {
            let numbers = f.places.iter().flatten().chain(f.noise.iter());
            numbers.chain([&f.confidence]).all(|v| v.is_finite())
                && nalgebra::Cholesky::new(f.noise).is_some()
                && f.confidence > 0.0
        };
        edges.chain(corners).filter(usable).collect()
    }

    fn ideal(&self, place: Vector2<f64>) -> Option<Vector2<f64>> {
        let pixel = PixelPoint::new(place.x, place.y);
        let ideal = match &self.camera.lens {
            Some(lens) => lens.undistort(pixel)?,
            None => pixel,
        };
        Some(Vector2::new(ideal.u, ideal.v))
    }
}

/// The direction of a line in which theta of its normal form, 0 or more and below pi, turns it: the sign of
/// the covariance of rho and theta depends on it.
fn tangent(along: Vector2<f64>) -> Vector2<f64> {
    let backwards = along.x > 0.0 || (along.x == 0.0 && along.y < 0.0);
    if backwards { -along } else { along }
}

fn square(m: &[[f64; 2]; 2]) -> Matrix2<f64> {
    let off = 0.5 * (m[0][1] + m[1][0]);
    Matrix2::new(m[0][0], off, off, m[1][1])
}
