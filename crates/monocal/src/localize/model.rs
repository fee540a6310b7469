//! What a camera at a pose sees of a plan: predicted places of features and how they move with the unknowns.

use nalgebra::{Matrix2, SMatrix, Vector2};

use super::LocateParams;
use super::belief::{Rows, Unknowns};
use super::feature::{Feature, Kind};
use super::landmarks::{Landmarks, place};
use super::view::{Seen, View};
use crate::{CameraMatrix, FloorCamera, chart};

/// A predicted feature: residual (predicted minus seen) along its normals, and its rates.
pub(super) struct Prediction {
    pub(super) residual: Vector2<f64>,
    pub(super) rows: Rows,
    /// Covariance of the residual but for the unknowns' [px^2].
    pub(super) noise: Matrix2<f64>,
}

/// The camera with what may be wrong about it.
pub(super) struct Model<'a> {
    pub(super) camera: &'a FloorCamera,
    pub(super) params: &'a LocateParams,
    pub(super) basis: SMatrix<f64, 9, 8>,
    pub(super) entries: chart::Entries,
    /// The undistorted picture's camera matrix; `None` where nothing tells how nodding moves the picture.
    pub(super) lens: Option<CameraMatrix>,
    /// Vanishing point of the vertical, homogeneous, in undistorted pixels.
    pub(super) nadir: Option<[f64; 3]>,
}

/// However short an edge is, it may be seen this far from where its wall is predicted [px].
const LEAST_REACH_PX: f64 = 60.0;
/// One sigma of how far the leaf of a door stands behind the face of its wall [m]: plans do not tell.
const RECESS: f64 = 0.06;
/// Verticals nearer to each other than this are blurred into each other [px], and move each other: apart
/// where they are the sides of a stripe, together where they are stairs of gray.
const BLURRED_PX: f64 = 5.0;

impl<'a> Model<'a> {
    pub(super) fn new(camera: &'a FloorCamera, params: &'a LocateParams) -> Self {
        let geometry = camera.geometry().ok();
        Self {
            camera,
            params,
            basis: chart::basis(&camera.homography),
            entries: chart::entries(&camera.homography),
            lens: geometry.map(|g| g.matrix),
            nadir: geometry.map(|g| g.nadir),
        }
    }

    /// The camera at these unknowns; `None` for a homography that has become none.
    pub(super) fn view(&self, at: &Unknowns) -> Option<View<'_>> {
        View::new(self, at)
    }

    /// Where a feature would be seen if it were this landmark; `None` where it cannot be seen so.
    pub(super) fn predict(
        &self,
        feature: &Feature,
        landmarks: &Landmarks,
        choice: usize,
        view: &View<'_>,
    ) -> Option<Prediction> {
        match feature.kind {
            Kind::Corner(_) => self.predict_corner(feature, landmarks, choice, view),
            Kind::Edge(_) => self.predict_edge(feature, landmarks, choice, view),
        }
    }

    fn predict_corner(
        &self,
        feature: &Feature,
        landmarks: &Landmarks,
        choice: usize,
        view: &View<'_>,
    ) -> Option<Prediction> {
        let seen = view.see(landmarks.corners[choice].1)?;
        // a foot is known badly along its vertical, which nodding turns: by 0.01 in the picture's corners
        let down = view.down(feature.places[0]);
        let normals = down.map_or(feature.normals, |d| [Vector2::new(-d.y, d.x), d]);
        let across = normals[0];
        let mut out = self.measured(feature, [&seen, &seen], normals).0;
        let planned = beside_px(landmarks, choice, view, seen.pixel, across);
        let crowd = crowded(planned.min(feature.beside_px));
        out.noise[(0, 0)] += (self.params.crowd_px * crowd).powi(2);
        Some(out)
    }

    fn predict_edge(
        &self,
        feature: &Feature,
        landmarks: &Landmarks,
        choice: usize,
        view: &View<'_>,
    ) -> Option<Prediction> {
        let wall = landmarks.walls[choice].1;
        let places = view.on_wall(feature, wall)?;
        let [a, b] = places.map(|along| view.see(place(wall, along)));
        let seen = [&a?, &b?];
        // across the wall as predicted, so that sliding along it changes nothing
        let along = seen[1].pixel - seen[0].pixel;
        let across = Vector2::new(-along.y, along.x).try_normalize(1e-9)?;
        let across = across * across.dot(&feature.normals[0]).signum();
        let length = (feature.places[1] - feature.places[0]).norm();
        let off = (0..2).map(|i| (seen[i].pixel - feature.places[i]).norm());
        // not the vanishing point, into which far walls and long edges all run
        if along.norm() < 0.5 * length || off.fold(0.0, f64::max) > length.max(LEAST_REACH_PX) {
            return None;
        }
        let (mut out, by_ground) = self.measured(feature, seen, [across; 2]);
        if in_opening(places, &landmarks.openings[choice]) {
            let [a, b] = wall;
            let inwards = view.turned([a.y - b.y, b.x - a.x]) / a.distance(b);
            let moved = by_ground * inwards * RECESS;
            out.noise += moved * moved.transpose();
        }
        Some(out)
    }

    /// The residuals of a feature's places along normals, and their rates by the floor point [px/m].
    fn measured(
        &self,
        feature: &Feature,
        seen: [&Seen; 2],
        normals: [Vector2<f64>; 2],
    ) -> (Prediction, Matrix2<f64>) {
        let mut out = Prediction {
            residual: Vector2::zeros(),
            rows: Rows::zeros(),
            noise: feature.noise,
        };
        let mut by_ground = Matrix2::<f64>::zeros();
        for i in 0..2 {
            let normal = normals[i];
            out.residual[i] = normal.dot(&(seen[i].pixel - feature.places[i]));
            out.rows.set_row(i, &(normal.transpose() * seen[i].rates));
            by_ground.set_row(i, &(normal.transpose() * seen[i].by_ground));
        }
        out.noise += by_ground * by_ground.transpose() * self.params.plan_sigma.powi(2);
        (out, by_ground)
    }

    /// Whether a feature is seen within `reach_px` of where a corner is predicted; walls are always.
    pub(super) fn close(
        &self,
        feature: &Feature,
        landmarks: &Landmarks,
        choice: usize,
        view: &View<'_>,
        reach_px: f64,
    ) -> bool {
        let Kind::Corner(_) = feature.kind else {
            return true;
        };
        let pixel = view.pixel(landmarks.corners[choice].1);
        pixel.is_some_and(|pixel| (pixel - feature.places[0]).norm() <= reach_px)
    }
}

/// Whether most of an edge lies where a door may be.
fn in_opening([from, to]: [f64; 2], openings: &[[f64; 2]]) -> bool {
    let (low, high) = (from.min(to), from.max(to));
    openings.iter().any(|[start, end]| {
        let inside = high.min(*end) - low.max(*start);
        inside >= 0.7 * (high - low)
    })
}

/// How far the nearest other vertical of the plan is seen beside one.
fn beside_px(
    landmarks: &Landmarks,
    choice: usize,
    view: &View<'_>,
    place: Vector2<f64>,
    across: Vector2<f64>,
) -> f64 {
    let apart = |&other: &usize| {
        let pixel = view.pixel(landmarks.corners[other].1)?;
        Some(across.dot(&(pixel - place)).abs())
    };
    let beside = landmarks.beside[choice].iter().filter_map(apart);
    beside.fold(f64::INFINITY, f64::min)
}

/// How much a vertical so far beside another moves it, 0 to 1: as far as cuts across it see it, by the window
/// with which edges are placed.
fn crowded(apart_px: f64) -> f64 {
    let share = (1.0 - (apart_px / BLURRED_PX).powi(2)).max(0.0);
    share * share
}
