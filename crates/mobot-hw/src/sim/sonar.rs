//! A simulated sonar: a cone of rays into the exact plan of the world.
//!
//! Walls answer like mirrors, as sound of a 7 mm wave sees them: only where the beam meets them nearly
//! square. At a slant the sound goes on to the next wall, and may come back the same way from there; hollow
//! corners send it back from anywhere, sharp edges a little of it. After R. Kuc and M. W. Siegel,
//! "Physically based simulation model for acoustic sensor robot navigation", IEEE PAMI 9(6), 1987.

use occgrid::{Point2, Pose2, Reading};

use super::outline::{Shape, meet};
use super::world::World;
use crate::dice::Dice;
use crate::real::{Placed, atan2, distance, exp, sin_cos, wrap};

/// A sonar's reach, beam and faults.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SonarParams {
    /// Off the axis at this angle a thing is heard half as far as on it [rad], 0.01 to 1. A wider beam
    /// hears the jambs of a doorway, and takes longer to simulate.
    pub half_beam: f64,
    /// How far a wall is heard, square and on the axis [m], above 0, up to 50.
    pub max_range: f64,
    /// Nearer echoes drown in the sonar's own ringing [m], 0 or more.
    pub blanking: f64,
    /// A wall that is met at a larger angle off its normal mirrors the sound away [rad], 0 to pi/2.
    pub critical_angle: f64,
    /// How far a hollow corner is heard, as a share of `max_range`, 0 to 1.
    pub corner_reach: f64,
    /// How far a sharp edge is heard, as a share of `max_range`, 0 to 1.
    pub edge_reach: f64,
    /// How far a person is heard, as a share of `max_range`, 0 to 1.
    pub person_reach: f64,
    /// Standard deviation of a range [m], 0 or more.
    pub sigma: f64,
    /// Readings are multiples of this [m]; 0 = not rounded.
    pub resolution: f64,
    /// Probability that an echo is missed.
    pub silence: f64,
    /// Probability of an echo out of nowhere, as of another sonar.
    pub crosstalk: f64,
    /// Above the floor [m]: what is lower is not heard.
    pub height: f64,
}

impl Default for SonarParams {
    /// A common indoor sonar with the paper's beam of 18 degrees.
    fn default() -> Self {
        Self {
            half_beam: 9.0_f64.to_radians(),
            max_range: 5.0,
            blanking: 0.2,
            critical_angle: 25.0_f64.to_radians(),
            corner_reach: 0.9,
            edge_reach: 0.3,
            person_reach: 0.6,
            sigma: 0.01,
            resolution: 0.01,
            silence: 0.01,
            crosstalk: 0.001,
            height: 0.3,
        }
    }
}

/// Angle between two rays [rad].
const SPACING: f64 = 0.5 / 180.0 * std::f64::consts::PI;
/// Rays reach to this many half beams off the axis.
const BEAM_EDGE: f64 = 1.6;
/// Both bounces of a double bounce lose sound: it is heard this share as far.
const SECOND_BOUNCE: f64 = 0.8;

/// A simulated sonar.
#[derive(Debug, Clone)]
pub struct Sonar {
    params: SonarParams,
    /// Sine, cosine and reach of every ray.
    rays: Vec<([f64; 2], f64)>,
    cos_critical: f64,
}

impl Sonar {
    /// A sonar with these qualities; values out of range are taken to its nearer end.
    #[must_use]
    pub fn new(params: SonarParams) -> Self {
        let half_beam = params.half_beam.clamp(0.01, 1.0);
        let max_range = params.max_range.clamp(1e-3, 50.0);
        let params = SonarParams {
            half_beam,
            max_range,
            ..params
        };
        let count = (BEAM_EDGE * half_beam / SPACING).ceil() as i32;
        let rays = (-count..=count).map(|k| {
            let off = BEAM_EDGE * half_beam * f64::from(k) / f64::from(count);
            let (sin, cos) = sin_cos(off);
            ([sin, cos], max_range * lobe(off / half_beam))
        });
        Self {
            rays: rays.collect(),
            cos_critical: sin_cos(params.critical_angle).1,
            params,
        }
    }

    /// The sonar's qualities.
    #[must_use]
    pub const fn params(&self) -> &SonarParams {
        &self.params
    }

    /// The range of the first echo [m] without noise and faults, from a sonar at `map_from_sonar` that
    /// looks along x, at `time` [s]; `None` where all is silent.
    #[must_use]
    pub fn first_echo(&self, world: &World, map_from_sonar: Pose2, time: f64) -> Option<f64> {
        let placed = Placed::at(map_from_sonar);
        let mut first = f64::INFINITY;
        for &([sin, cos], reach) in &self.rays {
            let direction = placed.turned(Point2::new(cos, sin));
            if let Some(range) = self.along(world, placed.origin, direction, reach) {
                first = first.min(range);
            }
        }
        first = first.min(self.corners(world, &placed, first));
        for person in world.people(time) {
            first = first.min(self.person(&placed, person.position, person.radius));
        }
        first.is_finite().then_some(first)
    }

    /// One firing. The dice draw noise and faults.
    pub(crate) fn fire(
        &self,
        world: &World,
        map_from_sonar: Pose2,
        time: f64,
        dice: &mut Dice,
    ) -> Reading {
        let p = &self.params;
        // always the same number of draws: what one shot met does not change the next one's luck
        let (noise, silent) = (dice.normal(), dice.chance(p.silence));
        let (foreign, place) = (dice.chance(p.crosstalk), dice.even());
        let echo = self.first_echo(world, map_from_sonar, time);
        let echo = echo.filter(|_| !silent);
        let spike = p.blanking + place * (p.max_range - p.blanking);
        let range = match (foreign, echo) {
            (true, Some(range)) => spike.min(range),
            (true, None) => spike,
            (false, Some(range)) => range,
            (false, None) => {
                return Reading::NoEcho {
                    listened: p.max_range,
                };
            }
        };
        if range < p.blanking {
            return Reading::TooClose;
        }
        let noisy = (range + p.sigma * noise).max(p.blanking);
        let range = if p.resolution > 0.0 {
            (noisy * (1.0 / p.resolution)).round() / (1.0 / p.resolution)
        } else {
            noisy
        };
        Reading::Echo { range }
    }

    /// The echo that comes back along one ray.
    fn along(&self, world: &World, from: Point2, direction: Point2, reach: f64) -> Option<f64> {
        let height = self.params.height;
        let strike = world
            .outline
            .cast(from, direction, self.params.max_range, height)?;
        let square = -(direction.x * strike.normal.x + direction.y * strike.normal.y);
        if square >= self.cos_critical {
            return (strike.range <= reach).then_some(strike.range);
        }
        let left = SECOND_BOUNCE * reach - strike.range;
        if left <= 0.0 {
            return None;
        }
        let mirrored = Point2::new(
            direction.x + 2.0 * square * strike.normal.x,
            direction.y + 2.0 * square * strike.normal.y,
        );
        let at = |along: f64, off: f64| {
            Point2::new(
                from.x + direction.x * along + strike.normal.x * off,
                from.y + direction.y * along + strike.normal.y * off,
            )
        };
        let second = world
            .outline
            .cast(at(strike.range, 1e-6), mirrored, left, height)?;
        let square = -(mirrored.x * second.normal.x + mirrored.y * second.normal.y);
        (square >= self.cos_critical).then_some(strike.range + second.range)
    }

    /// The nearest corner that is heard before `first`.
    fn corners(&self, world: &World, placed: &Placed, first: f64) -> f64 {
        let p = &self.params;
        let mut nearest = first;
        let from = placed.origin;
        let reach = p.max_range * p.corner_reach.max(p.edge_reach);
        world
            .outline
            .corners_around(from, reach.min(first), p.height, |corner| {
                let range = distance(from, corner.at);
                let share = if corner.hollow {
                    p.corner_reach
                } else {
                    p.edge_reach
                };
                if range >= nearest || range < 1e-9 || range > share * self.heard(placed, corner.at)
                {
                    return;
                }
                let toward = Point2::new(
                    (corner.at.x - from.x) / range,
                    (corner.at.y - from.y) / range,
                );
                let open = world
                    .outline
                    .cast(from, toward, range - 1e-3, p.height)
                    .is_none();
                if open {
                    nearest = range;
                }
            });
        nearest
    }

    fn person(&self, placed: &Placed, at: Point2, radius: f64) -> f64 {
        let reach = self.params.person_reach;
        let body = Shape::Circle { center: at, radius };
        let met = self.rays.iter().filter_map(|&([sin, cos], heard)| {
            let direction = placed.turned(Point2::new(cos, sin));
            let range = meet(&body, placed.origin, direction)?.range;
            (range <= reach * heard).then_some(range)
        });
        met.fold(f64::INFINITY, f64::min)
    }

    /// How far a wall would be heard in the direction of a place.
    fn heard(&self, placed: &Placed, at: Point2) -> f64 {
        let local = placed.inward(at);
        let off = wrap(atan2(local.y, local.x)) / self.params.half_beam;
        if off.abs() > BEAM_EDGE {
            return 0.0;
        }
        self.params.max_range * lobe(off)
    }
}

/// Reach off the axis over reach on it, at an angle given in half beams.
fn lobe(off: f64) -> f64 {
    exp(-std::f64::consts::LN_2 * off * off)
}
