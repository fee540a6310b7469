//! Constant-velocity Kalman tracks of what moves on the floor (Bar-Shalom, Li and Kirubarajan, Estimation
//! with Applications to Tracking and Navigation, 2001, chapter 6), each doubted by a model at rest.

mod rest;

use self::rest::Sightings;
use super::feet::MOST_REGIONS;
use super::{FloorState, MovedRegion, ObstacleParams};

/// Squared Mahalanobis distance within which a region is a track's: 99.9 % of a normal distribution of
/// two dimensions.
const GATE: f64 = 13.8;

/// Speed of a thing seen for the first time is within this, one sigma [m/s].
const FIRST_SPEED: f64 = 1.2;

/// A track that was not seen for so long is dropped [s]; one not yet known to move, after half of it.
const PATIENCE: f64 = 0.6;

/// Sightings before anything is said to move.
const LEAST_SIGHTINGS: usize = 4;

/// At most so many things are followed; what comes when there are more is passed over.
const MOST_TRACKS: usize = 64;

/// Half of the depth of a person, least and most [m].
const HALF_DEPTH: [f64; 2] = [0.1, 0.25];

/// A thing that is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Track {
    /// Number of the track, never used again.
    pub id: u32,
    /// Middle of the thing at `time`; odometry frame [m].
    pub position: [f64; 2],
    /// [m/s]
    pub velocity: [f64; 2],
    /// Of x, y and their velocities.
    pub covariance: [[f64; 4]; 4],
    /// Of the last frame [s].
    pub time: f64,
    /// Across the line of sight [m].
    pub width: f64,
    /// Whether nothing at rest explains what was seen.
    pub moving: bool,
}

/// A track as of its last sighting, with the sightings.
#[derive(Debug)]
struct Followed {
    track: Track,
    sightings: Sightings,
    /// Whether this frame shows it.
    seen: bool,
}

#[derive(Debug)]
pub(super) struct Tracks {
    followed: Vec<Followed>,
    /// The same as of the last frame.
    tracks: Vec<Track>,
    /// Squared distances of tracks and regions that may be the same.
    pairs: Vec<(f64, usize, usize)>,
    /// Whether a region is a track's.
    taken: Vec<bool>,
    next: u32,
}

impl Tracks {
    pub(super) fn new() -> Self {
        Self {
            followed: Vec::with_capacity(MOST_TRACKS),
            tracks: Vec::with_capacity(MOST_TRACKS),
            pairs: Vec::with_capacity(MOST_TRACKS * MOST_REGIONS),
            taken: Vec::with_capacity(MOST_REGIONS),
            next: 0,
        }
    }

    pub(super) fn all(&self) -> &[Track] {
        &self.tracks
    }

    pub(super) fn update(
        &mut self,
        regions: &[MovedRegion],
        time: f64,
        params: &ObstacleParams,
        floor: &dyn Fn([f64; 2]) -> FloorState,
    ) {
        self.pair(regions, params);
        self.taken.clear();
        self.taken.resize(regions.len(), false);
        self.followed.iter_mut().for_each(|f| f.seen = false);
        for &(_, t, r) in &self.pairs {
            let (followed, taken) = (&mut self.followed[t], &mut self.taken[r]);
            if !*taken && !followed.seen {
                (*taken, followed.seen) = (true, true);
                followed.correct(&regions[r], params, floor);
            }
        }
        let new = regions
            .iter()
            .zip(&self.taken)
            .filter(|(_, taken)| !**taken);
        for (region, _) in new.take(MOST_TRACKS - self.followed.len()) {
            self.followed.push(Followed::new(self.next, region));
            self.next = self.next.wrapping_add(1);
        }
        self.followed.retain(|followed| {
            let patience = if followed.track.moving {
                PATIENCE
            } else {
                PATIENCE / 2.0
            };
            // not where time has gone back, either
            (0.0..=patience).contains(&(time - followed.track.time))
        });
        self.tracks.clear();
        self.tracks.extend(self.followed.iter().map(|followed| {
            let mut track = followed.track;
            track.predict(time, params.wander);
            track
        }));
    }

    /// Takes the regions within the gates of tracks, nearest first.
    fn pair(&mut self, regions: &[MovedRegion], params: &ObstacleParams) {
        self.pairs.clear();
        for (t, followed) in self.followed.iter().enumerate() {
            for (r, region) in regions.iter().enumerate() {
                let mut track = followed.track;
                track.predict(region.time, params.wander);
                let distance = track.distance(region);
                if distance <= GATE {
                    self.pairs.push((distance, t, r));
                }
            }
        }
        self.pairs
            .sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    }
}

impl Followed {
    fn new(id: u32, region: &MovedRegion) -> Self {
        let mut covariance = [[0.0; 4]; 4];
        for (row, from) in covariance.iter_mut().zip(&region.covariance) {
            row[..2].copy_from_slice(from);
        }
        covariance[2][2] = FIRST_SPEED * FIRST_SPEED;
        covariance[3][3] = covariance[2][2];
        Self {
            track: Track {
                id,
                position: {
                    let half = HALF_DEPTH.iter().sum::<f64>() / 2.0;
                    let sight = sight(region);
                    std::array::from_fn(|axis| region.position[axis] + half * sight[axis])
                },
                velocity: [0.0; 2],
                covariance,
                time: region.time,
                width: region.width,
                moving: false,
            },
            sightings: Sightings::new(region),
            seen: true,
        }
    }

    fn correct(
        &mut self,
        region: &MovedRegion,
        params: &ObstacleParams,
        floor: &dyn Fn([f64; 2]) -> FloorState,
    ) {
        self.track.predict(region.time, params.wander);
        if region.cut_off {
            // it is there, but where its middle is, what was seen before tells better
            return;
        }
        self.track.correct(region);
        self.sightings.push(region);
        // once known to move, a thing may come to rest
        self.track.moving |= self.track.speed() >= params.least_speed
            && self.track.width >= params.least_width
            && self.sightings.all().len() >= LEAST_SIGHTINGS
            && rest::is_refuted(self.sightings.all(), floor);
    }
}

impl Track {
    /// [m/s]
    #[must_use]
    pub fn speed(&self) -> f64 {
        self.velocity[0].hypot(self.velocity[1])
    }

    /// Moves the state forward to a later time.
    fn predict(&mut self, time: f64, wander: f64) {
        let dt = time - self.time;
        self.time = time;
        for axis in 0..2 {
            self.position[axis] += self.velocity[axis] * dt;
        }
        let p = &mut self.covariance;
        let [of_velocity_x, of_velocity_y] = [p[2], p[3]];
        for (row, of_velocity) in p.iter_mut().zip([of_velocity_x, of_velocity_y]) {
            for (entry, of_velocity) in row.iter_mut().zip(of_velocity) {
                *entry += dt * of_velocity;
            }
        }
        for row in p.iter_mut() {
            for axis in 0..2 {
                row[axis] += dt * row[axis + 2];
            }
        }
        let q = wander * wander * dt;
        for axis in 0..2 {
            p[axis][axis] += q * dt * dt / 3.0;
            p[axis][axis + 2] += q * dt / 2.0;
            p[axis + 2][axis] += q * dt / 2.0;
            p[axis + 2][axis + 2] += q;
        }
    }

    /// What is seen of the thing's middle halfway between two frames less where it was then. Seen is the
    /// foot at the nearer of both places: half of the way made along the line of sight is missing, and
    /// half of the thing, taken to be as deep as it is wide.
    fn innovation(&self, region: &MovedRegion) -> [f64; 2] {
        let sight = sight(region);
        let away = self.velocity[0] * sight[0] + self.velocity[1] * sight[1];
        let across = self.velocity[1] * sight[0] - self.velocity[0] * sight[1];
        let half = (region.width - across.abs() * region.gap) / 2.0;
        let missing = away.abs() * region.gap / 2.0 + half.clamp(HALF_DEPTH[0], HALF_DEPTH[1]);
        std::array::from_fn(|axis| {
            region.position[axis] + missing * sight[axis] - self.position[axis]
        })
    }

    /// The inverse of the innovation's covariance.
    fn weight(&self, region: &MovedRegion) -> [[f64; 2]; 2] {
        inverse(std::array::from_fn(|i| {
            std::array::from_fn(|j| self.covariance[i][j] + region.covariance[i][j])
        }))
    }

    /// Squared Mahalanobis distance of a region.
    fn distance(&self, region: &MovedRegion) -> f64 {
        quadratic(&self.weight(region), self.innovation(region))
    }

    fn correct(&mut self, region: &MovedRegion) {
        let innovation = self.innovation(region);
        let weight = self.weight(region);
        let p = self.covariance;
        let gain: [[f64; 2]; 4] = std::array::from_fn(|i| {
            std::array::from_fn(|j| p[i][0] * weight[0][j] + p[i][1] * weight[1][j])
        });
        let step = gain.map(|row| row[0] * innovation[0] + row[1] * innovation[1]);
        for axis in 0..2 {
            self.position[axis] += step[axis];
            self.velocity[axis] += step[axis + 2];
        }
        self.covariance = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let less = |i: usize, j: usize| gain[i][0] * p[0][j] + gain[i][1] * p[1][j];
                p[i][j] - (less(i, j) + less(j, i)) / 2.0
            })
        });
        self.width += (region.width - self.width) / 4.0;
    }
}

/// The direction in which the camera sees a region, unit length.
fn sight(region: &MovedRegion) -> [f64; 2] {
    let to: [f64; 2] = std::array::from_fn(|axis| region.position[axis] - region.camera[axis]);
    to.map(|c| c / to[0].hypot(to[1]).max(1e-9))
}

fn inverse([[a, b], [c, d]]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let determinant = a * d - b * c;
    [
        [d / determinant, -b / determinant],
        [-c / determinant, a / determinant],
    ]
}

fn quadratic(m: &[[f64; 2]; 2], [x, y]: [f64; 2]) -> f64 {
    m[0][0] * x * x + (m[0][1] + m[1][0]) * x * y + m[1][1] * y * y
}
