//! Could what was seen be a point at rest, on the floor or above it?
//!
//! A point at height z over the place x, seen from a camera at height h over c, appears on the floor at
//! c + k (x - c) with k = h / (h - z): as the camera drives, it seems to move. That is linear in
//! 1 - k and k x, so the best such point is a least-squares fit with three unknowns.

use super::inverse;
use crate::obstacle::{FloorState, MovedRegion};

/// Points higher than 9 tenths of the camera's height are out of sight.
const MOST_SCALE: f64 = 10.0;

/// From this scale on, half of the camera's height, a point at rest would hang over the floor well before
/// where it is seen, so that a map that has nothing there can be believed. Below it the foot of what is not
/// on the map may be hard to see.
const HIGH: f64 = 2.0;

/// Sightings that are remembered.
const MEMORY: usize = 20;

/// A place where the thing was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sighting {
    position: [f64; 2],
    camera: [f64; 2],
    /// Inverse of the position's covariance.
    weight: [[f64; 2]; 2],
}

impl Sighting {
    fn of(region: &MovedRegion) -> Self {
        Self {
            position: region.position,
            camera: region.camera,
            weight: inverse(region.covariance),
        }
    }

    /// Squared distance from where a point at rest would be seen.
    fn misfit(&self, scale: f64, place: [f64; 2]) -> f64 {
        let off: [f64; 2] = std::array::from_fn(|i| {
            let seen = self.camera[i] + scale * (place[i] - self.camera[i]);
            self.position[i] - seen
        });
        super::quadratic(&self.weight, off)
    }
}

/// The last sightings of a thing, in no order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sightings {
    places: [Sighting; MEMORY],
    count: usize,
    /// Where the next one goes.
    next: usize,
}

impl Sightings {
    pub(super) fn new(region: &MovedRegion) -> Self {
        Self {
            places: [Sighting::of(region); MEMORY],
            count: 1,
            next: 1,
        }
    }

    /// Remembers one; the oldest of many is forgotten.
    pub(super) fn push(&mut self, region: &MovedRegion) {
        self.places[self.next] = Sighting::of(region);
        self.next = (self.next + 1) % MEMORY;
        self.count = (self.count + 1).min(MEMORY);
    }

    pub(super) fn all(&self) -> &[Sighting] {
        &self.places[..self.count]
    }
}

/// Whether no point at rest explains the sightings, or only one where the map has nothing.
pub(super) fn is_refuted(sightings: &[Sighting], floor: &dyn Fn([f64; 2]) -> FloorState) -> bool {
    let on_floor = place(sightings, 1.0);
    if misfit(sightings, 1.0, on_floor) <= limit(2 * sightings.len() - 2) {
        return false;
    }
    let Some((scale, raised)) = raised(sightings) else {
        return true;
    };
    misfit(sightings, scale, raised) > limit(2 * sightings.len() - 3)
        || (scale >= HIGH && floor(raised) == FloorState::Free)
}

fn misfit(sightings: &[Sighting], scale: f64, place: [f64; 2]) -> f64 {
    sightings.iter().map(|s| s.misfit(scale, place)).sum()
}

/// The best place of a point at rest of a given scale.
fn place(sightings: &[Sighting], scale: f64) -> [f64; 2] {
    let (mut sum, mut total) = ([0.0; 2], [[0.0; 2]; 2]);
    for s in sightings {
        let aim: [f64; 2] =
            std::array::from_fn(|i| s.camera[i] + (s.position[i] - s.camera[i]) / scale);
        for i in 0..2 {
            for j in 0..2 {
                total[i][j] += s.weight[i][j];
                sum[i] += s.weight[i][j] * aim[j];
            }
        }
    }
    let m = inverse(total);
    [
        m[0][0] * sum[0] + m[0][1] * sum[1],
        m[1][0] * sum[0] + m[1][1] * sum[1],
    ]
}

/// Scale and place of the best point at rest above the floor; `None` where the best is not above it. The
/// misfit over the scale has one minimum, which a golden section finds.
fn raised(sightings: &[Sighting]) -> Option<(f64, [f64; 2])> {
    let of = |inverse_scale: f64| {
        let scale = 1.0 / inverse_scale;
        misfit(sightings, scale, place(sightings, scale))
    };
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut low, mut high) = (1.0 / MOST_SCALE, 1.0);
    for _ in 0..24 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if of(a) < of(b) {
            high = b;
        } else {
            low = a;
        }
    }
    let inverse_scale = (low + high) / 2.0;
    let scale = 1.0 / inverse_scale;
    (inverse_scale < 0.999).then(|| (scale, place(sightings, scale)))
}

/// The 99.9 % quantile of chi-square (Wilson and Hilferty, 1931).
fn limit(degrees: usize) -> f64 {
    let n = degrees as f64;
    let spread = 2.0 / (9.0 * n);
    n * (1.0 - spread + 3.0902 * spread.sqrt()).powi(3)
}
