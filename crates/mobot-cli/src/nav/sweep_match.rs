//! Where a robot stands on a map, by one sweep of its sonar.
//!
//! A wide beam says well how far something is, and badly in which direction: an echo is explained by any
//! occupied cell near the arc that the beam draws at its range (the likelihood field of Thrun, Burgard and Fox,
//! *Probabilistic Robotics*, 2005, section 6.4, with the arc of a sonar in place of a laser's end point). Poses
//! around the prior are tried, coarsely and then finely, as in Olson, *Real-time correlative scan matching*, 2009;
//! the spread of the fine ones is the covariance.

use monocal::Prior;
use morpho::{BitImage, Border, distance};
use occgrid::{CellState, Point2, Pose2, Reading, SonarModel};

use super::angle::wrap;
use super::{Sounding, SwathMap};

/// How a sweep is matched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepParams {
    /// One sigma of an arc's distance from what answered it [m]: the map, the range, the rest of the robot's
    /// motion during the sweep. Raised: more poses fit.
    pub sigma: f64,
    /// Share of echoes that nothing on the map explains, 0 to below 1: people, double bounces.
    pub unexplained: f64,
    /// Neighbouring shots hear the same walls, and cells err together: what each is worth, above 0 to 1.
    pub worth: f64,
    /// Echoes that must be explained for a pose to count, 0 to 1.
    pub explained: f64,
    /// Fewer echoes say nothing.
    pub echoes: usize,
    /// Echoes from farther away are left out [m]: their arcs are as wide as a room.
    pub reach: f64,
    /// A rival this many times less likely is none; above 1.
    pub rival: f64,
}

impl Default for SweepParams {
    fn default() -> Self {
        Self {
            sigma: 0.04,
            unexplained: 0.15,
            worth: 1.0,
            explained: 0.7,
            echoes: 6,
            reach: 4.5,
            rival: 20.0,
        }
    }
}

/// What a sweep says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SweepStatus {
    /// One pose explains it.
    Found,
    /// Poses far from each other explain it about as well.
    Ambiguous,
    /// None explains it, or there is too little to explain.
    NoMatch,
}

/// The pose of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepFix {
    /// Whether the rest can be used.
    pub status: SweepStatus,
    /// Of the base at the last shot; prior and sweep together.
    pub map_from_base: Pose2,
    /// Its covariance [m, m, rad]; where the sweep says nothing it is the prior's.
    pub covariance: [[f64; 3]; 3],
    /// Share of the echoes that the map explains there, 0 to 1.
    pub explained: f64,
}

/// Poses are tried up to this many sigmas of the prior from it.
const SIGMAS: f64 = 3.0;
/// Steps of the coarse search [m], [rad]; its sigma is as wide.
const COARSE: [f64; 2] = [0.1, 4.0 * std::f64::consts::PI / 180.0];
/// The best of the coarse poses are looked at closely.
const KEPT: usize = 24;
/// Poses nearer than this are one [m], [rad].
const APART: [f64; 2] = [0.25, 12.0 * std::f64::consts::PI / 180.0];
/// Steps of the fine search to each side of its middle.
const FINE: i32 = 4;

/// A part of a map in which sweeps are matched.
#[derive(Debug, Clone)]
pub struct SweepMatcher {
    params: SweepParams,
    /// Distance to the nearest occupied cell [m], rows from the bottom.
    field: Vec<f32>,
    side: usize,
    origin: Point2,
    resolution: f64,
}

impl SweepMatcher {
    /// Of the map within `reach` [m] of a place. Linear in the cells there.
    #[must_use]
    pub fn new(map: &impl SwathMap, around: Point2, reach: f64, params: SweepParams) -> Self {
        let resolution = map.resolution();
        let half = (reach / resolution).ceil().clamp(1.0, 4000.0);
        let side = 2 * half as usize + 1;
        let origin = Point2::new(around.x - half * resolution, around.y - half * resolution);
        let clear = BitImage::from_fn(side, side, |col, row| {
            let (x, y) = (col as f64 * resolution, row as f64 * resolution);
            map.at(Point2::new(origin.x + x, origin.y + y)) != CellState::Occupied
        });
        let field = distance::squared(&clear, Border::Neutral)
            .into_iter()
            .map(|d| f64::from(d).sqrt() * resolution)
            .map(|d| d.min(FAR) as f32)
            .collect();
        Self {
            params,
            field,
            side,
            origin,
            resolution,
        }
    }

    /// The pose of a sweep whose last shot was fired where `prior` is of. `sonar` gives the beam and where the
    /// sonar sits.
    #[must_use]
    pub fn fix(&self, sonar: &SonarModel, sweep: &[Sounding], prior: &Prior) -> SweepFix {
        let nothing = SweepFix {
            status: SweepStatus::NoMatch,
            map_from_base: prior.pose,
            covariance: prior.covariance,
            explained: 0.0,
        };
        let arcs = self.arcs(sonar, sweep);
        let Some(belief) = Belief::of(prior).filter(|_| arcs.len() >= self.params.echoes.max(1))
        else {
            return nothing;
        };
        let coarse = self.coarse(&arcs, &belief);
        let mut peaks: Vec<(f64, Pose2)> = Vec::new();
        for (_, start) in coarse {
            let found = self.climb(&arcs, &belief, start);
            if !peaks.iter().any(|(_, pose)| is_same(*pose, found.1)) {
                peaks.push(found);
            }
        }
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        let Some(&(best, peak)) = peaks.first() else {
            return nothing;
        };
        let explained = self.explained(&arcs, peak);
        let (map_from_base, covariance) = self.spread(&arcs, &belief, peak, best);
        let rival = peaks
            .get(1)
            .is_some_and(|p| best - p.0 < self.params.rival.ln());
        let status = if explained < self.params.explained {
            SweepStatus::NoMatch
        } else if rival {
            SweepStatus::Ambiguous
        } else {
            SweepStatus::Found
        };
        SweepFix {
            status,
            map_from_base,
            covariance,
            explained,
        }
    }

    fn arcs(&self, sonar: &SonarModel, sweep: &[Sounding]) -> Vec<Arc> {
        let Some(last) = sweep.last() else {
            return Vec::new();
        };
        let home = last.odom_from_base.inverse();
        let arc = |s: &Sounding| {
            let Reading::Echo { range } = s.ping.reading else {
                return None;
            };
            if !s.ping.settled || range > self.params.reach.min(sonar.max_range) {
                return None;
            }
            let base = home.compose(s.odom_from_base);
            let at = base.transform_from(sonar.mount.position());
            let axis = base.theta + s.ping.bearing;
            let points = (range * sonar.beam_width / self.resolution)
                .ceil()
                .clamp(2.0, 64.0);
            let step = sonar.beam_width / points;
            let on_arc = |k: f64| {
                let angle = axis - sonar.beam_width / 2.0 + k * step;
                Point2::new(at.x + range * angle.cos(), at.y + range * angle.sin())
            };
            Some(Arc {
                from: at,
                along: [axis.cos(), axis.sin()],
                open: range - BEFORE,
                points: (0..=points as u32).map(|k| on_arc(f64::from(k))).collect(),
            })
        };
        sweep.iter().filter_map(arc).collect()
    }

    /// Distance of what is nearest to an arc from it [m]; far where the beam would have to go through a wall.
    fn off(&self, arc: &Arc, pose: &Placed) -> f64 {
        let near = |p: &Point2| self.distance(pose.of_base(*p));
        let off = arc.points.iter().map(near).fold(f64::INFINITY, f64::min);
        if off < FAR && self.is_shut(arc, pose) {
            FAR
        } else {
            off
        }
    }

    /// Whether something stands on the beam's axis well before the echo.
    fn is_shut(&self, arc: &Arc, pose: &Placed) -> bool {
        let mut gone = 0.0;
        while gone < arc.open {
            let [x, y] = arc.along;
            let place = Point2::new(arc.from.x + gone * x, arc.from.y + gone * y);
            let room = self.distance(pose.of_base(place));
            if room < self.resolution / 2.0 {
                return true;
            }
            // nothing is nearer than this
            gone += room.max(self.resolution);
        }
        false
    }

    /// From a place to the nearest occupied cell [m].
    fn distance(&self, place: Point2) -> f64 {
        let col = ((place.x - self.origin.x) / self.resolution + 0.5).floor();
        let row = ((place.y - self.origin.y) / self.resolution + 0.5).floor();
        let side = self.side as f64;
        if (0.0..side).contains(&col) && (0.0..side).contains(&row) {
            f64::from(self.field[row as usize * self.side + col as usize])
        } else {
            FAR
        }
    }

    /// Logarithm of how likely a pose is, up to a constant.
    fn score(&self, arcs: &[Arc], belief: &Belief, pose: Pose2, sigma: f64) -> f64 {
        let placed = Placed::of(pose);
        let p = &self.params;
        let of_arc = |arc: &Arc| {
            let u = self.off(arc, &placed) / sigma;
            (p.unexplained + (1.0 - p.unexplained) * (-0.5 * u * u).exp()).ln()
        };
        let heard: f64 = arcs.iter().map(of_arc).sum();
        p.worth * heard + belief.log(pose)
    }

    /// The best poses of a grid about the prior, best first.
    fn coarse(&self, arcs: &[Arc], belief: &Belief) -> Vec<(f64, Pose2)> {
        let sigma = self.params.sigma.hypot(COARSE[0] / 2.0);
        let steps = |sigma: f64, step: f64| (SIGMAS * sigma / step).ceil().clamp(1.0, 45.0) as i32;
        let [nx, ny] = [0, 1].map(|k| steps(belief.sigmas[k], COARSE[0]));
        let turns = steps(belief.sigmas[2], COARSE[1]);
        let mut kept: Vec<(f64, Pose2)> = Vec::new();
        for turn in -turns..=turns {
            for y in -ny..=ny {
                for x in -nx..=nx {
                    let pose = Pose2::new(
                        belief.pose.x + f64::from(x) * COARSE[0],
                        belief.pose.y + f64::from(y) * COARSE[0],
                        belief.pose.theta + f64::from(turn) * COARSE[1],
                    );
                    let score = self.score(arcs, belief, pose, sigma);
                    if kept.len() < KEPT || score > kept[KEPT - 1].0 {
                        let place = kept.partition_point(|k| k.0 >= score);
                        kept.insert(place, (score, pose));
                        kept.truncate(KEPT);
                    }
                }
            }
        }
        kept
    }

    /// Goes uphill from a pose in ever smaller steps.
    fn climb(&self, arcs: &[Arc], belief: &Belief, start: Pose2) -> (f64, Pose2) {
        let sigma = self.params.sigma;
        let mut best = (self.score(arcs, belief, start, sigma), start);
        let mut step = [COARSE[0] / 2.0, COARSE[1] / 2.0];
        while step[0] > 0.002 {
            let around = best.1;
            for (x, y, turn) in [
                (1.0, 0.0, 0.0),
                (-1.0, 0.0, 0.0),
                (0.0, 1.0, 0.0),
                (0.0, -1.0, 0.0),
                (0.0, 0.0, 1.0),
                (0.0, 0.0, -1.0),
            ] {
                let pose = Pose2::new(
                    around.x + x * step[0],
                    around.y + y * step[0],
                    around.theta + turn * step[1],
                );
                let score = self.score(arcs, belief, pose, sigma);
                if score > best.0 {
                    best = (score, pose);
                }
            }
            if best.1 == around {
                step = step.map(|s| s / 2.0);
            }
        }
        best
    }

    /// Mean and covariance of the poses about a peak, weighed by how likely they are.
    fn spread(
        &self,
        arcs: &[Arc],
        belief: &Belief,
        peak: Pose2,
        best: f64,
    ) -> (Pose2, [[f64; 3]; 3]) {
        let sigma = self.params.sigma;
        // as far to each side as it stays likely: three sigma of a normal peak
        let fall = |axis: usize, sign: f64| {
            let most = SIGMAS * belief.sigmas[axis].max(1e-4);
            let mut far = most.min([0.01, 0.01, 0.01][axis]);
            loop {
                let moved = shifted(peak, axis, sign * far);
                if far >= most || best - self.score(arcs, belief, moved, sigma) > 4.5 {
                    return far;
                }
                far = (far * 1.5).min(most);
            }
        };
        let width = [0, 1, 2].map(|axis| fall(axis, 1.0).max(fall(axis, -1.0)));
        let steps = || (-FINE..=FINE).map(|k| f64::from(k) / f64::from(FINE));
        let mut sums = ([0.0; 3], [[0.0; 3]; 3], 0.0);
        for turn in steps() {
            for y in steps() {
                for x in steps() {
                    let off = [x * width[0], y * width[1], turn * width[2]];
                    let pose = Pose2::new(peak.x + off[0], peak.y + off[1], peak.theta + off[2]);
                    let weight = (self.score(arcs, belief, pose, sigma) - best).exp();
                    sums.2 += weight;
                    for i in 0..3 {
                        sums.0[i] += weight * off[i];
                        for j in 0..3 {
                            sums.1[i][j] += weight * off[i] * off[j];
                        }
                    }
                }
            }
        }
        let (first, second, weight) = sums;
        let mean = first.map(|s| s / weight);
        let covariance = std::array::from_fn(|i| {
            std::array::from_fn(|j| second[i][j] / weight - mean[i] * mean[j])
        });
        let pose = Pose2::new(
            peak.x + mean[0],
            peak.y + mean[1],
            wrap(peak.theta + mean[2]),
        );
        (pose, covariance)
    }

    /// Share of the echoes that are explained at a pose.
    fn explained(&self, arcs: &[Arc], pose: Pose2) -> f64 {
        let placed = Placed::of(pose);
        let near = |arc: &&Arc| self.off(arc, &placed) < 2.5 * self.params.sigma;
        arcs.iter().filter(near).count() as f64 / arcs.len() as f64
    }
}

/// Farther than this nothing is nearer than anything else [m].
const FAR: f64 = 1.0;

/// A beam may graze what stands this much before the echo [m].
const BEFORE: f64 = 0.2;

/// What an echo came from is on an arc, in the frame of the base at the last shot.
struct Arc {
    from: Point2,
    /// Direction of the beam's axis.
    along: [f64; 2],
    /// Nothing stands in the beam's axis so far [m].
    open: f64,
    /// At most a cell apart.
    points: Vec<Point2>,
}

/// A pose, ready for many points.
struct Placed {
    x: f64,
    y: f64,
    sin: f64,
    cos: f64,
}

impl Placed {
    fn of(pose: Pose2) -> Self {
        let (sin, cos) = pose.theta.sin_cos();
        Self {
            x: pose.x,
            y: pose.y,
            sin,
            cos,
        }
    }

    fn of_base(&self, p: Point2) -> Point2 {
        Point2::new(
            self.x + self.cos * p.x - self.sin * p.y,
            self.y + self.sin * p.x + self.cos * p.y,
        )
    }
}

/// A prior, its inverse at hand.
struct Belief {
    pose: Pose2,
    sigmas: [f64; 3],
    information: nalgebra::Matrix3<f64>,
}

impl Belief {
    fn of(prior: &Prior) -> Option<Self> {
        let covariance = nalgebra::Matrix3::from_fn(|i, j| prior.covariance[i][j]);
        Some(Self {
            pose: prior.pose,
            sigmas: [0, 1, 2].map(|k| covariance[(k, k)].max(0.0).sqrt()),
            information: covariance.try_inverse()?,
        })
    }

    fn log(&self, pose: Pose2) -> f64 {
        let off = nalgebra::Vector3::new(
            pose.x - self.pose.x,
            pose.y - self.pose.y,
            wrap(pose.theta - self.pose.theta),
        );
        -0.5 * off.dot(&(self.information * off))
    }
}

fn is_same(a: Pose2, b: Pose2) -> bool {
    a.position().distance(b.position()) < APART[0] && wrap(a.theta - b.theta).abs() < APART[1]
}

fn shifted(pose: Pose2, axis: usize, by: f64) -> Pose2 {
    let mut moved = [pose.x, pose.y, pose.theta];
    moved[axis] += by;
    Pose2::new(moved[0], moved[1], moved[2])
}
