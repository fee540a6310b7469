//! People who walk to and fro: where they are at a time, and what they look like.

use occgrid::Point2;

use super::building::{Texture, Walker};
use super::solid::{ALL_SIDES, Band, Finish, Footprint, Solid};
use super::world::Person;
use crate::real::{length, sin_cos};

/// Of the body [m].
const RADIUS: f64 = 0.2;
const LEG: f64 = 0.075;
/// One step takes this way [m].
const STEP: f64 = 0.7;

/// Position and velocity at a time.
pub(crate) fn whereabouts(walker: &Walker, time: f64) -> Person {
    let (position, heading, _) = place(walker, time);
    Person {
        position,
        velocity: Point2::new(heading.x * walker.speed, heading.y * walker.speed),
        radius: RADIUS,
    }
}

/// Position, direction of travel, and the way walked so far.
fn place(walker: &Walker, time: f64) -> (Point2, Point2, f64) {
    let point = |i: usize| Point2::new(walker.way[i][0], walker.way[i][1]);
    let legs = walker.way.len() - 1;
    let long = |i: usize| length(point(i + 1).x - point(i).x, point(i + 1).y - point(i).y);
    let total: f64 = (0..legs).map(long).sum();
    let walked = walker.start + walker.speed * time;
    if total <= 0.0 {
        return (point(0), Point2::new(0.0, 0.0), walked);
    }
    let there_and_back = walked.rem_euclid(2.0 * total);
    let (mut rest, sense) = if there_and_back <= total {
        (there_and_back, 1.0)
    } else {
        (2.0 * total - there_and_back, -1.0)
    };
    let mut leg = 0;
    while leg + 1 < legs && rest > long(leg) {
        rest -= long(leg);
        leg += 1;
    }
    let (a, b, l) = (point(leg), point(leg + 1), long(leg).max(1e-9));
    let direction = Point2::new((b.x - a.x) / l, (b.y - a.y) / l);
    let position = Point2::new(a.x + direction.x * rest, a.y + direction.y * rest);
    let heading = Point2::new(sense * direction.x, sense * direction.y);
    (position, heading, walked)
}

/// Patience of somebody whom the robot stands in the way of [s].
const PATIENCE: f64 = 3.0;

/// Has a walker who keeps a distance mind the robot, a disc at `robot`, for a step that ends at `time`; `waited` is
/// how long the walker stood so far [s].
pub(crate) fn mind(
    walker: &mut Walker,
    waited: &mut f64,
    [time, step]: [f64; 2],
    (robot, radius): (Point2, f64),
) {
    if walker.keeps <= 0.0 {
        return;
    }
    let (at, heading, walked) = place(walker, time);
    let (x, y) = (robot.x - at.x, robot.y - at.y);
    let near = length(x, y) - radius - RADIUS < walker.keeps;
    if !near || x * heading.x + y * heading.y <= 0.0 {
        *waited = 0.0;
        return;
    }
    *waited += step;
    if *waited < PATIENCE {
        walker.start -= walker.speed * step;
    } else {
        // the same place on the way back
        *waited = 0.0;
        walker.start -= 2.0 * walked;
    }
}

/// Two legs in step, a body and a head.
pub(crate) fn body(walker: &Walker, time: f64) -> [Solid; 4] {
    let (at, heading, walked) = place(walker, time);
    let (swing, _) = sin_cos(walked / STEP * std::f64::consts::PI);
    let [trousers, shirt] = walker.brightness;
    let disc = |ahead: f64, aside: f64, radius: f64, up: [f64; 2], finish: Finish| Solid {
        footprint: Footprint::Disc {
            center: Point2::new(
                at.x + heading.x * ahead - heading.y * aside,
                at.y + heading.y * ahead + heading.x * aside,
            ),
            radius,
        },
        bottom: up[0],
        top: up[1],
        finish,
        backed: false,
    };
    let leg = || {
        let mut finish = Finish::plain(trousers, Texture::Plain);
        finish.bands.push(Band {
            sides: ALL_SIDES,
            along: [f64::NEG_INFINITY, f64::INFINITY],
            up: [0.0, 0.09],
            brightness: trousers * 0.4,
        });
        finish
    };
    let reach = STEP / 2.0 * swing * 0.6;
    [
        disc(reach, 0.1, LEG, [0.0, 0.85], leg()),
        disc(-reach, -0.1, LEG, [0.0, 0.85], leg()),
        disc(
            0.0,
            0.0,
            RADIUS,
            [0.8, 1.45],
            Finish::plain(shirt, Texture::Plain),
        ),
        disc(
            0.0,
            0.0,
            0.1,
            [1.45, 1.72],
            Finish::plain(0.6, Texture::Plain),
        ),
    ]
}
