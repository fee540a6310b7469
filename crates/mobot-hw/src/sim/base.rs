//! A simulated two-wheeled base: it drives nearly as told, and its wheels tell nearly what it drove.

use occgrid::{Point2, Pose2};

use super::world::World;
use crate::dice::Dice;
use crate::motion::rolled_on;
use crate::real::{distance, sin_cos};
use crate::{Twist2, WheelTravel};

/// A base: its size, its limits, and how far it is from what it is thought to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseParams {
    /// Of the round body [m], above 0.
    pub radius: f64,
    /// Of the body [m]: what hangs higher is not hit.
    pub height: f64,
    /// Distance between the wheels, as the maker states it [m], above 0.
    pub track: f64,
    /// True distance over stated one.
    pub track_error: f64,
    /// True diameters of left and right wheel over stated ones.
    pub wheel_error: [f64; 2],
    /// Share of its way that each wheel loses [-], on average.
    pub slip: [f64; 2],
    /// Random part of the slip: standard deviation of the way lost after 1 m [m]; grows with the square
    /// root of the way.
    pub slip_noise: f64,
    /// Largest speed of a wheel [m/s], above 0.
    pub max_speed: f64,
    /// Largest change of a wheel's speed [m/s^2], above 0.
    pub max_acceleration: f64,
    /// Way of a wheel for one tick of its encoder [m], above 0.
    pub tick: f64,
}

impl Default for BaseParams {
    /// About an iRobot Create 2: 0.235 m between wheels, 0.4446 mm a tick, 0.5 m/s.
    fn default() -> Self {
        Self {
            radius: 0.175,
            height: 1.2,
            track: 0.235,
            track_error: 1.01,
            wheel_error: [1.003, 0.998],
            slip: [0.0, 0.0],
            slip_noise: 0.005,
            max_speed: 0.5,
            max_acceleration: 1.0,
            tick: 0.000_444_6,
        }
    }
}

impl BaseParams {
    /// A base that does exactly what its wheels say.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            track_error: 1.0,
            wheel_error: [1.0; 2],
            slip_noise: 0.0,
            ..Self::default()
        }
    }
}

/// Half the angle that each half of the bumper covers past straight ahead [rad].
const BUMPER_OVERLAP: f64 = 0.26;
/// The bumper reaches to this angle on either side [rad].
const BUMPER_REACH: f64 = 1.7;
/// Clearance is measured up to this much [m].
pub(crate) const CLEARANCE_SEEN: f64 = 0.5;
/// Nearer than this is contact [m].
const CONTACT: f64 = 1e-6;

#[derive(Debug, Clone)]
pub(crate) struct Base {
    pub(crate) params: BaseParams,
    pub(crate) map_from_base: Pose2,
    /// Wheel speeds as the encoders see them.
    speeds: [f64; 2],
    target: [f64; 2],
    rolled: [f64; 2],
    pub(crate) bumped: [bool; 2],
    touching: bool,
    pub(crate) cliff: bool,
    pub(crate) lifted: bool,
    pub(crate) collisions: u64,
    pub(crate) driven: f64,
    pub(crate) least_clearance: f64,
    dice: Dice,
}

impl Base {
    pub(crate) fn new(params: BaseParams, map_from_base: Pose2, dice: Dice) -> Self {
        Self {
            params,
            map_from_base,
            speeds: [0.0; 2],
            target: [0.0; 2],
            rolled: [0.0; 2],
            bumped: [false; 2],
            touching: false,
            cliff: false,
            lifted: false,
            collisions: 0,
            driven: 0.0,
            least_clearance: CLEARANCE_SEEN,
            dice,
        }
    }

    /// Speeds to reach; scaled down together where one is too fast.
    pub(crate) fn command(&mut self, command: Twist2) {
        if !command.is_finite() {
            self.target = [0.0; 2];
            return;
        }
        let wheels = command.wheels(self.params.track);
        let fastest = wheels[0].abs().max(wheels[1].abs());
        let scale = (self.params.max_speed / fastest).min(1.0);
        self.target = if fastest > 0.0 {
            wheels.map(|w| w * scale)
        } else {
            [0.0; 2]
        };
    }

    /// What the encoders have counted.
    pub(crate) fn travel(&self) -> WheelTravel {
        let ticks = self.rolled.map(|r| (r / self.params.tick).round());
        WheelTravel {
            left: ticks[0] * self.params.tick,
            right: ticks[1] * self.params.tick,
        }
    }

    /// The velocity over the floor that the wheels would give without slip.
    pub(crate) fn twist(&self) -> Twist2 {
        let wheels = [0, 1].map(|i| self.speeds[i] * self.params.wheel_error[i]);
        Twist2::from_wheels(wheels, self.params.track * self.params.track_error)
    }

    /// Moves on by a short time [s], at most some hundredths of a second.
    pub(crate) fn step(&mut self, world: &World, time: f64, seconds: f64) {
        let gain = self.params.max_acceleration * seconds;
        let mut ground = [0.0; 2];
        for (side, ground) in ground.iter_mut().enumerate() {
            let before = self.speeds[side];
            let after = before + (self.target[side] - before).clamp(-gain, gain);
            self.speeds[side] = after;
            let rolled = (before + after) / 2.0 * seconds;
            self.rolled[side] += rolled;
            let way = rolled * self.params.wheel_error[side];
            *ground = way * (1.0 - self.params.slip[side]);
            if way != 0.0 && self.params.slip_noise > 0.0 {
                *ground += self.params.slip_noise * way.abs().sqrt() * self.dice.normal();
            }
        }
        if self.lifted {
            return;
        }
        let track = self.params.track * self.params.track_error;
        let next = rolled_on(self.map_from_base, ground, track);
        self.arrive(world, time, next);
    }

    /// Goes to a pose as far as nothing is in the way; a body pushed against a wall slides along it.
    fn arrive(&mut self, world: &World, time: f64, next: Pose2) {
        let from = self.map_from_base.position();
        let mut place = next.position();
        let nearest = self.obstacle(world, time, place);
        let mut clear = nearest.map_or(CLEARANCE_SEEN, |c| distance(c, place) - self.params.radius);
        let contact = nearest.filter(|_| clear < CONTACT);
        if let Some(at) = contact {
            place = self.slide(world, time, [from, place], at);
            clear = 0.0;
        }
        self.driven += distance(from, place);
        self.map_from_base = Pose2::new(place.x, place.y, next.theta);
        self.least_clearance = self.least_clearance.min(clear);
        let driving = self.speeds.iter().any(|s| s.abs() > 1e-9);
        if contact.is_some() && !self.touching && driving {
            self.collisions += 1;
        }
        self.touching = contact.is_some();
        self.bumped = contact.map_or([false; 2], |at| self.bumper(at));
    }

    /// Where a body ends on a way that would have led it into something at `contact`: it touches what it
    /// is nearest to, or else what it would have hit, and goes on along it.
    fn slide(&self, world: &World, time: f64, [from, to]: [Point2; 2], contact: Point2) -> Point2 {
        let free = |p: &Point2| {
            self.obstacle(world, time, *p)
                .is_none_or(|c| distance(c, *p) >= self.params.radius - CONTACT)
        };
        let beside = self.obstacle(world, time, from).unwrap_or(contact);
        [beside, contact]
            .map(|at| self.along(from, to, at))
            .into_iter()
            .find(free)
            .unwrap_or(from)
    }

    /// The way without the part that leads deeper than touching a wall whose nearest place is `at`.
    fn along(&self, from: Point2, to: Point2, at: Point2) -> Point2 {
        let away = distance(from, at).max(1e-9);
        let normal = Point2::new((from.x - at.x) / away, (from.y - at.y) / away);
        let gap = (away - self.params.radius).max(0.0);
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        let too_far = (dx * normal.x + dy * normal.y + gap).min(0.0);
        Point2::new(to.x - too_far * normal.x, to.y - too_far * normal.y)
    }

    /// The nearest place of the world's outline or of a person's.
    fn obstacle(&self, world: &World, time: f64, at: Point2) -> Option<Point2> {
        let reach = self.params.radius + CLEARANCE_SEEN;
        let wall = world.outline.nearest(at, reach, self.params.height);
        let mut nearest = wall.map(|w| (distance(w, at), w));
        for person in world.people(time) {
            let away = distance(person.position, at);
            if away - person.radius < nearest.map_or(reach, |n| n.0) {
                // never past the body's own centre, so that the bumper keeps its side
                let share = (person.radius / away.max(1e-9)).min(0.99);
                let edge = Point2::new(
                    person.position.x + (at.x - person.position.x) * share,
                    person.position.y + (at.y - person.position.y) * share,
                );
                nearest = Some((away - person.radius, edge));
            }
        }
        nearest.map(|n| n.1)
    }

    fn bumper(&self, contact: Point2) -> [bool; 2] {
        let (sin, cos) = sin_cos(self.map_from_base.theta);
        let (x, y) = (
            contact.x - self.map_from_base.x,
            contact.y - self.map_from_base.y,
        );
        let bearing = crate::real::atan2(cos * y - sin * x, cos * x + sin * y);
        if bearing.abs() > BUMPER_REACH {
            return [false; 2];
        }
        [bearing > -BUMPER_OVERLAP, bearing < BUMPER_OVERLAP]
    }
}
