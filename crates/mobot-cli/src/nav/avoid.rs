//! What was not on the map: things that echoes show where the map says that nothing stands, and people that
//! the camera sees walk.

use occgrid::{CellState, OccupancyMap, Point2, Pose2, Reading};

use super::swath::SwathMap as _;
use super::{Mover, Sounding};

/// How surprises are kept and avoided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AvoidParams {
    /// Pose of the sonar's axle in the base frame.
    pub base_from_sonar: Pose2,
    /// An echo this much before what the map explains is a surprise [m]. Raised: things near walls are missed;
    /// lowered: a pose that is off makes things of walls.
    pub tolerance: f64,
    /// Echoes from farther are not placed: their beam is too wide there [m].
    pub reach: f64,
    /// So many echoes make a thing.
    pub least_hits: u32,
    /// A thing is this large about its echo, radius [m].
    pub size: f64,
    /// A thing that was not heard for so long is forgotten [s].
    pub memory: f64,
    /// People are kept this far from the body [m].
    pub room: f64,
    /// How far ahead people are foreseen [s].
    pub foresight: f64,
}

impl Default for AvoidParams {
    fn default() -> Self {
        Self {
            base_from_sonar: Pose2::new(0.0, 0.0, 0.0),
            tolerance: 0.3,
            reach: 2.5,
            least_hits: 3,
            size: 0.2,
            memory: 60.0,
            room: 0.6,
            foresight: 2.5,
        }
    }
}

/// A place from which echoes come that the map does not explain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thing {
    /// Map frame [m].
    pub place: Point2,
    /// Echoes for it, less those against it.
    pub hits: u32,
    /// When it was last heard [s].
    pub heard: f64,
}

/// Things that were not on the map.
#[derive(Debug, Clone, Default)]
pub struct Surprises {
    params: AvoidParams,
    things: Vec<Thing>,
}

/// Half of the beam in which an edge is heard [rad].
const RIM: f64 = 16.0 / 180.0 * std::f64::consts::PI;
/// Half of the beam in which a thing would surely be heard [rad].
const CORE: f64 = 6.0 / 180.0 * std::f64::consts::PI;
/// Silence is told of a thing nearer than this [m].
const SURELY_HEARD: f64 = 1.0;
/// Most hits that are counted: what is gone is forgotten that quickly.
const MOST_HITS: u32 = 8;

impl Surprises {
    /// None yet.
    #[must_use]
    pub const fn new(params: AvoidParams) -> Self {
        Self {
            params,
            things: Vec::new(),
        }
    }

    /// The things that are sure enough.
    pub fn things(&self) -> impl Iterator<Item = &Thing> {
        let least = self.params.least_hits;
        self.things.iter().filter(move |t| t.hits >= least)
    }

    /// Takes a firing of the sonar.
    pub fn hear(&mut self, sounding: &Sounding, map: &OccupancyMap) {
        let ping = &sounding.ping;
        let now = ping.stamp;
        let memory = self.params.memory;
        self.things.retain(|t| now - t.heard <= memory);
        if !ping.settled {
            return;
        }
        let at = sounding
            .map_from_base
            .transform_from(self.params.base_from_sonar.position());
        let beam = Pose2::new(at.x, at.y, sounding.map_from_base.theta + ping.bearing);
        let (heard, beyond) = match ping.reading {
            Reading::Echo { range } => (Some(range), range),
            Reading::NoEcho { listened } => (None, listened.min(SURELY_HEARD)),
            Reading::TooClose | Reading::Fault => return,
        };
        self.contradict(beam, beyond);
        let Some(range) = heard.filter(|r| *r <= self.params.reach) else {
            return;
        };
        if range < explained(map, beam, range + self.params.tolerance) - self.params.tolerance {
            self.note(beam.transform_from(Point2::new(range, 0.0)), now);
        }
    }

    fn note(&mut self, place: Point2, now: f64) {
        let same = |t: &&mut Thing| t.place.distance(place) <= 1.5 * self.params.size;
        if let Some(thing) = self.things.iter_mut().find(same) {
            let share = 0.3;
            thing.place.x += (place.x - thing.place.x) * share;
            thing.place.y += (place.y - thing.place.y) * share;
            thing.hits = (thing.hits + 1).min(MOST_HITS);
            thing.heard = now;
            return;
        }
        self.things.push(Thing {
            place,
            hits: 1,
            heard: now,
        });
    }

    /// Echoes from well behind a thing speak against it.
    fn contradict(&mut self, beam: Pose2, beyond: f64) {
        let size = self.params.size;
        for thing in &mut self.things {
            let local = beam.inverse().transform_from(thing.place);
            let off = local.y.atan2(local.x).abs();
            if off <= CORE && local.x.hypot(local.y) + 1.5 * size < beyond {
                thing.hits = thing.hits.saturating_sub(1);
            }
        }
        self.things.retain(|t| t.hits > 0);
    }

    /// The map with the things on it, except for the cells under the robot itself.
    #[must_use]
    pub fn on(&self, map: &OccupancyMap, robot: Point2, radius: f64) -> OccupancyMap {
        let frame = *map.frame();
        let mut values = map.values().to_vec();
        for thing in self.things() {
            let steps = (self.params.size / frame.resolution()).ceil() as i32;
            for i in -steps..=steps {
                for j in -steps..=steps {
                    let place = Point2::new(
                        thing.place.x + f64::from(i) * frame.resolution(),
                        thing.place.y + f64::from(j) * frame.resolution(),
                    );
                    let inside = place.distance(thing.place) <= self.params.size;
                    if let Some(cell) = frame.cell_at(place).filter(|_| inside)
                        && place.distance(robot) > radius
                    {
                        values[frame.index(cell)] = 100;
                    }
                }
            }
        }
        OccupancyMap::new(frame, values, map.free_at_most(), map.occupied_at_least())
    }

    /// How far a disc of `radius` at `from` can go along its heading before it touches a thing [m].
    #[must_use]
    pub fn clear(&self, from: Pose2, radius: f64) -> f64 {
        let touch = radius + self.params.size;
        let to = from.inverse();
        let ahead = self.things().filter_map(|thing| {
            let local = to.transform_from(thing.place);
            let chord = touch * touch - local.y * local.y;
            (chord > 0.0 && local.x > 0.0).then(|| (local.x - chord.sqrt()).max(0.0))
        });
        ahead.fold(f64::INFINITY, f64::min)
    }

    /// Whether a thing stands within `radius` of one of these places.
    #[must_use]
    pub fn block(&self, places: &[Point2], radius: f64) -> bool {
        let near = |t: &Thing| {
            let needed = radius + self.params.size;
            places.iter().any(|p| p.distance(t.place) < needed)
        };
        self.things().any(near)
    }
}

/// The nearest distance at which the map explains an echo in a beam, up to `far` [m].
fn explained(map: &OccupancyMap, beam: Pose2, far: f64) -> f64 {
    let step = map.resolution() / 2.0;
    let rays = 8;
    let mut nearest = f64::INFINITY;
    for k in -rays..=rays {
        let (sin, cos) = (RIM * f64::from(k) / f64::from(rays)).sin_cos();
        let mut range = 0.0;
        while range < far.min(nearest) {
            let place = beam.transform_from(Point2::new(range * cos, range * sin));
            if map.at(place) != CellState::Free {
                nearest = range;
                break;
            }
            range += step;
        }
    }
    nearest
}

/// Whether somebody who keeps walking comes too near to a body that stands here, or drives at `velocity`
/// (map frame) [m/s].
#[must_use]
pub(super) fn too_near(
    mover: &Mover,
    at: Point2,
    velocity: Point2,
    now: f64,
    params: &AvoidParams,
) -> bool {
    let age = (now - mover.seen).clamp(0.0, 1.0);
    let there = Point2::new(
        mover.position.x + mover.velocity.x * age,
        mover.position.y + mover.velocity.y * age,
    );
    let (x, y) = (there.x - at.x, there.y - at.y);
    let (vx, vy) = (mover.velocity.x - velocity.x, mover.velocity.y - velocity.y);
    let speed_squared = vx * vx + vy * vy;
    let closest = if speed_squared > 1e-6 {
        (-(x * vx + y * vy) / speed_squared).clamp(0.0, params.foresight)
    } else {
        0.0
    };
    (x + vx * closest).hypot(y + vy * closest) < params.room
}

#[cfg(test)]
mod tests {
    use super::*;
    use mobot_hw::Ping;
    use occgrid::MapFrame;

    fn hall() -> OccupancyMap {
        let frame = MapFrame::new(120, 80, 0.05, Pose2::default()).expect("a frame");
        let value = |i: usize| {
            let (col, row) = (i % 120, i / 120);
            i8::from(col == 0 || col == 119 || row == 0 || row == 79) * 100
        };
        let values = (0..frame.cell_count()).map(value).collect();
        OccupancyMap::new(frame, values, 25, 65)
    }

    fn heard(range: Option<f64>, stamp: f64) -> Sounding {
        let reading = range.map_or(Reading::NoEcho { listened: 5.0 }, |range| Reading::Echo {
            range,
        });
        let pose = Pose2::new(1.0, 2.0, 0.0);
        Sounding {
            ping: Ping {
                stamp,
                bearing: 0.0,
                settled: true,
                reading,
            },
            map_from_base: pose,
            odom_from_base: pose,
        }
    }

    #[test]
    fn a_box_becomes_a_thing_and_goes_when_it_is_gone() {
        let map = hall();
        let mut surprises = Surprises::new(AvoidParams::default());
        for k in 0..3 {
            surprises.hear(&heard(Some(1.5), f64::from(k)), &map);
        }
        let places: Vec<_> = surprises.things().map(|t| t.place).collect();
        assert_eq!(places, [Point2::new(2.5, 2.0)]);
        let from = Pose2::new(1.0, 2.0, 0.0);
        assert!((surprises.clear(from, 0.2) - 1.1).abs() < 1e-9);
        let back = Pose2::new(1.0, 2.0, 3.0);
        assert!(surprises.clear(back, 0.2).is_infinite());
        assert!(surprises.block(&[Point2::new(2.2, 2.1)], 0.2));
        assert!(!surprises.block(&[Point2::new(1.2, 2.1)], 0.2));
        let with = surprises.on(&map, Point2::new(1.0, 2.0), 0.2);
        assert_eq!(with.at(Point2::new(2.5, 2.1)), CellState::Occupied);
        assert_eq!(with.at(Point2::new(2.0, 2.0)), CellState::Free);
        for k in 0..3 {
            surprises.hear(&heard(Some(4.8), 4.0 + f64::from(k)), &map);
        }
        assert_eq!(surprises.things().count(), 0);
    }

    #[test]
    fn what_the_map_explains_is_no_surprise() {
        let map = hall();
        let mut surprises = Surprises::new(AvoidParams {
            reach: 10.0,
            ..AvoidParams::default()
        });
        for k in 0..10 {
            surprises.hear(&heard(Some(4.8), f64::from(k)), &map);
            surprises.hear(&heard(None, f64::from(k)), &map);
        }
        assert_eq!(surprises.things().count(), 0);
    }

    #[test]
    fn people_are_foreseen() {
        let params = AvoidParams::default();
        let person = |x: f64, y: f64, vx: f64, vy: f64| Mover {
            position: Point2::new(x, y),
            velocity: Point2::new(vx, vy),
            seen: 0.0,
        };
        let at = Point2::default();
        let still = Point2::default();
        assert!(too_near(
            &person(2.0, 0.0, -1.0, 0.0),
            at,
            still,
            0.0,
            &params
        ));
        assert!(!too_near(
            &person(2.0, 0.0, 1.0, 0.0),
            at,
            still,
            0.0,
            &params
        ));
        assert!(!too_near(
            &person(2.0, 0.0, 0.0, 1.0),
            at,
            still,
            0.0,
            &params
        ));
        // crossing where the robot will be
        let ahead = Point2::new(0.4, 0.0);
        assert!(too_near(
            &person(0.8, -2.0, 0.0, 1.0),
            at,
            ahead,
            0.0,
            &params
        ));
        assert!(!too_near(
            &person(5.0, 0.0, -1.0, 0.0),
            at,
            still,
            0.0,
            &params
        ));
    }
}
