//! From changed pixels to regions of the floor: the nearest change in each direction is a foot; feet that
//! stand side by side at one distance are one thing's, and so are the two sides of a thing.

use super::fan::Fan;
use super::{Moment, MovedRegion, ObstacleParams, transform};

/// Directions that may be missing between two of one piece.
const DIRECTION_GAP: usize = 4;

/// Neighbouring feet of one piece are at most this much nearer or farther [m].
const STEP: f64 = 0.3;

/// Two pieces of one thing are at most this much nearer or farther [m].
const DEPTH: f64 = 0.6;

/// Least changed surface, as if upright at the foot [m^2]: a hand's breadth by its length.
const LEAST_SURFACE: f64 = 0.006;

/// How far the upper part of a thing may stick out to its sides [m].
const MARGIN: f64 = 0.15;

/// Nothing that is one thing is wider, both its places together [m].
const WIDEST: f64 = 1.3;

/// How well a foot is seen along and across the line of sight, pixels apart [m].
const SIGMA: [f64; 2] = [0.06, 0.04];

/// How well the middle of a thing is known of which a part is out of the picture, one sigma [m].
const HIDDEN: f64 = 0.3;

/// The nearest change in a direction.
#[derive(Clone, Copy, Debug)]
struct Foot {
    direction: usize,
    /// From the camera's foot [m].
    range: f64,
    /// Depth of a pixel on the floor there [m].
    depth: f64,
    /// Changed pixels in this direction.
    changed: usize,
    /// Whether it is next to the side or to the bottom of the picture.
    at_side: bool,
    at_bottom: bool,
}

/// Feet of one thing, or of one side of it.
#[derive(Clone, Debug)]
struct Piece {
    feet: Vec<Foot>,
}

impl Piece {
    /// The distance that a quarter of the feet stay below [m].
    fn range(&self) -> f64 {
        let mut ranges: Vec<f64> = self.feet.iter().map(|foot| foot.range).collect();
        let quarter = ranges.len() / 4;
        *ranges.select_nth_unstable_by(quarter, f64::total_cmp).1
    }

    /// Rightmost and leftmost bearing.
    fn bearings(&self, fan: &Fan) -> [f64; 2] {
        let directions = self.feet.iter().map(|foot| foot.direction);
        let (right, left) = directions.fold((usize::MAX, 0), |(r, l), d| (r.min(d), l.max(d)));
        [
            fan.bearing(right) - fan.step() / 2.0,
            fan.bearing(left) + fan.step() / 2.0,
        ]
    }

    /// What has changed, as if upright at the foot [m^2].
    fn surface(&self, fan: &Fan) -> f64 {
        let of = |foot: &Foot| foot.changed as f64 * (foot.range * fan.step()).powi(2);
        self.feet.iter().map(of).sum()
    }

    /// Whether this is but the upper part of something that stands before it.
    fn is_above(&self, other: &Self, fan: &Fan) -> bool {
        let ([r0, l0], [r1, l1]) = (self.bearings(fan), other.bearings(fan));
        let margin = MARGIN / other.range();
        other.range() + DEPTH < self.range() && r0 > r1 - margin && l0 < l1 + margin
    }

    /// Whether both are sides of one thing.
    fn joins(&self, other: &Self, fan: &Fan, params: &ObstacleParams) -> bool {
        let range = self.range().min(other.range());
        let ([r0, l0], [r1, l1]) = (self.bearings(fan), other.bearings(fan));
        let gap = (r0.max(r1) - l0.min(l1)).max(0.0) * range;
        let width = (l0.max(l1) - r0.min(r1)) * range;
        (self.range() - other.range()).abs() <= DEPTH && gap <= params.max_width && width <= WIDEST
    }
}

/// The floor regions that moved, from right to left.
pub(super) fn regions(
    changed: &[bool],
    fan: &Fan,
    camera: [f64; 2],
    params: &ObstacleParams,
    moments: [Moment; 2],
    regions: &mut Vec<MovedRegion>,
) {
    let mut pieces: Vec<Piece> = Vec::new();
    for foot in feet(changed, fan) {
        let goes_on = |before: &Foot| {
            foot.direction - before.direction <= DIRECTION_GAP
                && (before.range - foot.range).abs() <= STEP
        };
        match pieces.last_mut() {
            Some(piece) if piece.feet.last().is_some_and(goes_on) => piece.feet.push(foot),
            _ => pieces.push(Piece { feet: vec![foot] }),
        }
    }
    pieces.retain(|piece| piece.surface(fan) >= LEAST_SURFACE / 4.0);
    let mut things: Vec<Piece> = Vec::new();
    for piece in pieces {
        match things
            .iter_mut()
            .find(|thing| thing.joins(&piece, fan, params))
        {
            Some(thing) => thing.feet.extend(piece.feet),
            None => things.push(piece),
        }
    }
    things.retain(|thing| thing.surface(fan) >= LEAST_SURFACE);
    for thing in &things {
        if !things.iter().any(|other| thing.is_above(other, fan)) {
            regions.push(region(thing, fan, camera, moments));
        }
    }
}

/// The nearest change in each direction that has one, from right to left.
fn feet(changed: &[bool], fan: &Fan) -> Vec<Foot> {
    let [w, h] = fan.size;
    let mut feet: Vec<Option<Foot>> = vec![None; fan.directions()];
    for (i, _) in changed.iter().enumerate().filter(|(_, changed)| **changed) {
        let (range, direction) = (f64::from(fan.range[i]), usize::from(fan.direction[i]));
        let [u, v] = [i % w, i / w];
        let behind = f64::from(fan.range[i.saturating_sub(w)]);
        let here = Foot {
            direction,
            range,
            depth: if behind.is_finite() {
                behind - range
            } else {
                0.0
            },
            changed: 1,
            at_side: u < 3 || u + 4 > w,
            at_bottom: v + 3 > h,
        };
        let foot = feet[direction].get_or_insert(Foot { changed: 0, ..here });
        let changed = foot.changed + 1;
        if here.range < foot.range {
            *foot = here;
        }
        foot.changed = changed;
    }
    feet.into_iter().flatten().collect()
}

fn region(thing: &Piece, fan: &Fan, camera: [f64; 2], [then, now]: [Moment; 2]) -> MovedRegion {
    let range = thing.range();
    let [right, left] = thing.bearings(fan);
    let bearing = (right + left) / 2.0;
    let at_side = thing.feet.iter().any(|foot| foot.at_side);
    let at_bottom = 2 * thing.feet.iter().filter(|foot| foot.at_bottom).count() > thing.feet.len();
    let depth = thing.feet[thing.feet.len() / 2].depth;
    let sigma = [
        SIGMA[0].hypot(1.5 * depth) + if at_bottom { HIDDEN } else { 0.0 },
        SIGMA[1].hypot(1.5 * range * fan.step()) + if at_side { HIDDEN } else { 0.0 },
    ];
    let base = [
        camera[0] + range * bearing.cos(),
        camera[1] + range * bearing.sin(),
    ];
    let (sin, cos) = (now.odom_from_base[2] + bearing).sin_cos();
    let [along, across] = sigma.map(|s| s * s);
    let mixed = (along - across) * sin * cos;
    let [a, b] = [then, now].map(|moment| transform(moment.odom_from_base, camera));
    MovedRegion {
        position: transform(now.odom_from_base, base),
        covariance: [
            [along * cos * cos + across * sin * sin, mixed],
            [mixed, along * sin * sin + across * cos * cos],
        ],
        time: (then.time + now.time) / 2.0,
        gap: now.time - then.time,
        width: (left - right) * range,
        cut_off: at_side || at_bottom,
        camera: [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0],
    }
}
