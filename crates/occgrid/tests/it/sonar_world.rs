//! Rooms made of line segments, and a slow rotating sonar in them: what the refinement is tested in.
//!
//! The sonar is modelled on a LEGO NXT sensor on a motor: a cone of 24 to 30 degrees; smooth walls answer only up
//! to a critical angle of incidence, less at the edge of the cone; concave corners answer from everywhere, edges
//! from near; a lost echo repeats the last value (or reads 255 cm); readings in whole centimetres; the robot does
//! not stand exactly where it believes. Rays are cast into the segments, never into a grid.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use occgrid::{Point2, Pose2, Reading, Shot};

/// A wall, from end to end.
pub(crate) type Wall = [Point2; 2];

/// Free space bounded by walls.
pub(crate) struct World {
    pub(crate) walls: Vec<Wall>,
    /// Boundary of the free space.
    pub(crate) outline: Vec<Point2>,
    /// Where the robot stops.
    pub(crate) stops: Vec<Point2>,
}

/// SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn chance(&mut self, p: f64) -> bool {
        self.between(0.0, 1.0) < p
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.between(1e-12, 1.0).ln()).sqrt();
        radius * (TAU * self.between(0.0, 1.0)).cos()
    }
}

impl World {
    /// Closed walls along an outline.
    pub(crate) fn from_outline(outline: Vec<Point2>, stops: Vec<Point2>) -> Self {
        let next = outline.iter().cycle().skip(1);
        let walls = outline.iter().zip(next).map(|(&a, &b)| [a, b]).collect();
        Self {
            walls,
            outline,
            stops,
        }
    }

    /// Whether a place is inside the outline (even-odd rule).
    pub(crate) fn is_inside(&self, p: Point2) -> bool {
        let next = self.outline.iter().cycle().skip(1);
        let crossings = self.outline.iter().zip(next).filter(|&(a, b)| {
            (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x
        });
        crossings.count() % 2 == 1
    }

    /// Distance to the nearest wall in a direction, and the angle of incidence there.
    pub(crate) fn cast(&self, from: Point2, direction: f64) -> (f64, f64) {
        let (dy, dx) = direction.sin_cos();
        let mut nearest = (f64::INFINITY, 0.0);
        for [a, b] in &self.walls {
            let (ex, ey) = (b.x - a.x, b.y - a.y);
            let cross = dx * ey - dy * ex;
            let along_ray = ((a.x - from.x) * ey - (a.y - from.y) * ex) / cross;
            let along_wall = ((a.x - from.x) * dy - (a.y - from.y) * dx) / cross;
            if along_ray > 1e-9
                && (-1e-9..=1.0 + 1e-9).contains(&along_wall)
                && along_ray < nearest.0
            {
                nearest = (along_ray, (cross.abs() / ex.hypot(ey)).min(1.0).acos());
            }
        }
        nearest
    }

    fn clearance(&self, p: Point2) -> f64 {
        let to_wall = |[a, b]: &Wall| {
            let (ex, ey) = (b.x - a.x, b.y - a.y);
            let t = ((p.x - a.x) * ex + (p.y - a.y) * ey) / (ex * ex + ey * ey);
            let t = t.clamp(0.0, 1.0);
            p.distance(Point2::new(a.x + t * ex, a.y + t * ey))
        };
        self.walls.iter().map(to_wall).fold(f64::INFINITY, f64::min)
    }
}

/// The arena of the real scans and the waypoints at which they were taken.
pub(crate) fn arena() -> World {
    let p = |x: u32, y: u32| Point2::new(f64::from(x) / 100.0, f64::from(y) / 100.0);
    let outline = [
        (0, 0),
        (0, 168),
        (84, 168),
        (84, 210),
        (168, 210),
        (168, 84),
        (210, 84),
        (210, 0),
    ];
    let mut world = World::from_outline(
        outline.iter().map(|&(x, y)| p(x, y)).collect(),
        vec![p(84, 30), p(180, 30), p(126, 54)],
    );
    // the wall from (84, 210) goes on into the arena, past the corner at (84, 168)
    world.walls.push([p(84, 168), p(84, 126)]);
    world
}

/// A random room with right angles at a random heading: corners cut out, sometimes a spur into the room; 3 or 4
/// stops.
pub(crate) fn room(seed: u64) -> World {
    let mut random = Random(seed.wrapping_mul(7919).wrapping_add(13));
    loop {
        let (w, h) = (random.between(1.6, 3.6), random.between(1.6, 3.6));
        let mut outline = Vec::new();
        // corners counter-clockwise, each with the direction into the room
        for (x, y, sx, sy, x_first) in [
            (0.0, 0.0, 1.0, 1.0, false),
            (w, 0.0, -1.0, 1.0, true),
            (w, h, -1.0, -1.0, false),
            (0.0, h, 1.0, -1.0, true),
        ] {
            if !random.chance(0.4) {
                outline.push(Point2::new(x, y));
                continue;
            }
            let (cx, cy) = (random.between(0.3, 0.45) * w, random.between(0.3, 0.45) * h);
            let inner = Point2::new(x + sx * cx, y + sy * cy);
            let (on_x, on_y) = (Point2::new(inner.x, y), Point2::new(x, inner.y));
            outline.extend(if x_first {
                [on_x, inner, on_y]
            } else {
                [on_y, inner, on_x]
            });
        }
        let mut world = World::from_outline(outline, Vec::new());
        if random.chance(0.5) {
            let index = random.between(0.0, world.walls.len() as f64) as usize;
            let [a, b] = world.walls[index];
            let (t, length) = (random.between(0.2, 0.8), random.between(0.25, 0.8));
            let (ex, ey, l) = (b.x - a.x, b.y - a.y, a.distance(b));
            let foot = Point2::new(a.x + t * ex, a.y + t * ey);
            let tip = Point2::new(foot.x - length * ey / l, foot.y + length * ex / l);
            world.walls.push([foot, tip]);
        }
        let placed = Pose2::new(
            random.between(-1.0, 1.0),
            random.between(-1.0, 1.0),
            random.between(0.0, FRAC_PI_2),
        );
        let place = |p: &mut Point2| *p = placed.transform_from(*p);
        world.outline.iter_mut().for_each(place);
        world.walls.iter_mut().flatten().for_each(place);
        let count = if random.chance(0.5) { 3 } else { 4 };
        for _ in 0..500 {
            let p =
                placed.transform_from(Point2::new(random.between(0.0, w), random.between(0.0, h)));
            let apart = world.stops.iter().all(|s| s.distance(p) > 0.4);
            if world.stops.len() < count && apart && world.is_inside(p) && world.clearance(p) > 0.25
            {
                world.stops.push(p);
            }
        }
        if world.stops.len() == count {
            return world;
        }
    }
}

/// One full turn at every stop of a slow, held sonar, a shot a degree.
pub(crate) fn scan(world: &World, seed: u64) -> Vec<Shot> {
    let mut random = Random(seed ^ 0x00AB_CDEF);
    let sensor = Sensor {
        half: random.between(12.0, 15.0).to_radians(),
        reach: random.between(1.1, 2.5),
        critical: random.between(20.0, 42.0).to_radians(),
        listens: 2.54,
        holds: random.chance(0.7),
    };
    scan_with(world, &sensor, &mut random)
}

/// One full turn at every stop, a shot a degree.
pub(crate) fn scan_with(world: &World, sensor: &Sensor, random: &mut Random) -> Vec<Shot> {
    let scale = 1.0 + 0.015 * random.normal();
    let mut shots = Vec::new();
    for stop in &world.stops {
        let stands = Point2::new(
            stop.x + 0.015 * random.normal(),
            stop.y + 0.015 * random.normal(),
        );
        let start = random.between(0.0, TAU);
        let lag = random.between(-4.0, 4.0).to_radians();
        let sense = if random.chance(0.5) { 1.0 } else { -1.0 };
        let mut last = None;
        for k in 0..360 {
            let direction = start + sense * f64::from(k).to_radians();
            let fresh = sensor.echo(world, stands, direction).map(|d| {
                let noisy = (d * scale + 0.008 * random.normal()).max(0.03);
                (noisy * 100.0).round() / 100.0
            });
            let value = if sensor.holds { fresh.or(last) } else { fresh };
            let value = value.filter(|&v| v <= sensor.listens);
            last = value.or(last);
            let reading = match value {
                Some(range) => Reading::Echo { range },
                None => Reading::NoEcho {
                    listened: sensor.listens,
                },
            };
            shots.push(Shot {
                stamp: shots.len() as f64 * 0.05,
                map_from_base: Pose2::new(stop.x, stop.y, 0.0),
                bearing: direction + lag,
                reading,
            });
        }
    }
    shots
}

/// Every `step`-th shot of every turn.
pub(crate) fn every(step: usize, shots: &[Shot]) -> Vec<Shot> {
    let turns = shots.chunks(360);
    turns
        .flat_map(|turn| turn.iter().step_by(step))
        .copied()
        .collect()
}

/// What limits a sonar.
pub(crate) struct Sensor {
    /// Half the cone [rad].
    pub(crate) half: f64,
    /// Farthest echo on the axis [m].
    pub(crate) reach: f64,
    /// Largest angle of incidence that still answers, on the axis [rad].
    pub(crate) critical: f64,
    /// Largest range that is reported [m].
    pub(crate) listens: f64,
    /// Whether a lost echo repeats the last value.
    pub(crate) holds: bool,
}

impl Sensor {
    /// The nearest thing that answers.
    fn echo(&self, world: &World, from: Point2, direction: f64) -> Option<f64> {
        let mut nearest = f64::INFINITY;
        for degrees in -15..=15 {
            let offset = f64::from(degrees).to_radians();
            if offset.abs() <= self.half {
                let lobe = (offset / self.half * FRAC_PI_2 * 0.9).cos();
                let (range, incidence) = world.cast(from, direction + offset);
                let heard = incidence < self.critical * lobe.sqrt()
                    && range < self.reach * (0.6 + 0.4 * lobe);
                if heard && range < nearest {
                    nearest = range;
                }
            }
        }
        for corner in world.walls.iter().flatten() {
            let range = from.distance(*corner);
            let bearing = (corner.y - from.y).atan2(corner.x - from.x);
            let offset = (bearing - direction + PI).rem_euclid(TAU) - PI;
            let visible = offset.abs() <= self.half && world.cast(from, bearing).0 > range - 0.02;
            let limit = if is_concave(world, *corner) {
                0.9
            } else {
                0.45
            } * self.reach;
            if visible && range < nearest.min(limit) {
                nearest = range;
            }
        }
        nearest.is_finite().then_some(nearest)
    }
}

/// Whether at most half of the surroundings of a corner are free.
fn is_concave(world: &World, corner: Point2) -> bool {
    let free = (0..8).filter(|k| {
        let (sin, cos) = (f64::from(*k) * PI / 4.0 + 0.4).sin_cos();
        world.is_inside(Point2::new(corner.x + 0.05 * cos, corner.y + 0.05 * sin))
    });
    free.count() <= 4
}
