//! From changed pixels to regions of the floor: the nearest change in each direction is a foot; feet that
//! stand side by side at one distance are one thing's, and so are the two sides of a thing.

use std::ops::Range;

use super::fan::Fan;
use super::{Moment, MovedRegion, ObstacleParams, transform};
use crate::bits::Bits;

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

/// Of a foot that is no thing's.
const NONE: usize = usize::MAX;

/// At most so many regions are told, the nearest.
pub(super) const MOST_REGIONS: usize = 64;

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
    /// Number of the thing whose foot it is.
    thing: usize,
}

/// Feet of one thing, or of one side of it.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// The distance that a quarter of the feet stay below [m].
    range: f64,
    /// Depth of a pixel on the floor at its middle [m].
    depth: f64,
    /// Rightmost and leftmost bearing [rad].
    right: f64,
    left: f64,
    /// What has changed, as if upright at the foot [m^2].
    surface: f64,
    /// Whether the picture's side or its bottom hides a part of it.
    at_side: bool,
    at_bottom: bool,
}

/// Finds the floor regions that moved; keeps its buffers.
#[derive(Debug, Default)]
pub(super) struct Feet {
    nearest: Vec<Option<Foot>>,
    feet: Vec<Foot>,
    ranges: Vec<f64>,
    things: Vec<Piece>,
}

impl Piece {
    /// Whether this is but the upper part of something that stands before it.
    fn is_above(&self, other: &Self) -> bool {
        let margin = MARGIN / other.range;
        other.range + DEPTH < self.range
            && self.right > other.right - margin
            && self.left < other.left + margin
    }

    /// Whether both are sides of one thing.
    fn joins(&self, other: &Self, params: &ObstacleParams) -> bool {
        let range = self.range.min(other.range);
        let gap = (self.right.max(other.right) - self.left.min(other.left)).max(0.0) * range;
        let width = (self.left.max(other.left) - self.right.min(other.right)) * range;
        (self.range - other.range).abs() <= DEPTH && gap <= params.max_width && width <= WIDEST
    }
}

impl Feet {
    /// The floor regions that moved, nearest first.
    pub(super) fn regions(
        &mut self,
        changed: &Bits,
        fan: &Fan,
        camera: [f64; 2],
        params: &ObstacleParams,
        moments: [Moment; 2],
        regions: &mut Vec<MovedRegion>,
    ) {
        self.stand(changed, fan);
        self.join(fan, params);
        self.things.retain(|thing| thing.surface >= LEAST_SURFACE);
        let by_range = |a: &Piece, b: &Piece| a.range.total_cmp(&b.range);
        self.things
            .sort_unstable_by(|a, b| by_range(a, b).then(a.right.total_cmp(&b.right)));
        regions.reserve(MOST_REGIONS);
        regions.extend(
            self.things
                .iter()
                .enumerate()
                // what stands before a thing is nearer
                .filter(|(i, thing)| !self.things[..*i].iter().any(|o| thing.is_above(o)))
                .map(|(_, thing)| region(thing, fan, camera, moments))
                .take(MOST_REGIONS),
        );
    }

    /// Takes the nearest change in each direction that has one, from right to left.
    fn stand(&mut self, changed: &Bits, fan: &Fan) {
        let [_, h] = fan.size;
        self.nearest.clear();
        self.nearest.resize(fan.directions(), None);
        let rows = (0..h).flat_map(|v| changed.row(v).iter().enumerate().map(move |i| (v, i)));
        for (v, (i, &word)) in rows {
            let mut word = word;
            while word != 0 {
                let u = 64 * i + word.trailing_zeros() as usize;
                word &= word - 1;
                self.take([u, v], fan);
            }
        }
        self.feet.clear();
        self.feet.reserve(fan.directions());
        self.feet.extend(self.nearest.iter().flatten());
    }

    fn take(&mut self, [u, v]: [usize; 2], fan: &Fan) {
        let [w, h] = fan.size;
        let i = v * w + u;
        let (range, direction) = (f64::from(fan.range[i]), usize::from(fan.direction[i]));
        let behind = f64::from(fan.range[i.saturating_sub(w)]);
        let here = Foot {
            direction,
            range,
            depth: if behind.is_finite() {
                behind - range
            } else {
                0.0
            },
            changed: 0,
            at_side: u < 3 || u + 4 > w,
            at_bottom: v + 3 > h,
            thing: NONE,
        };
        let foot = self.nearest[direction].get_or_insert(here);
        let changed = foot.changed + 1;
        if here.range < foot.range {
            *foot = here;
        }
        foot.changed = changed;
    }

    /// Joins feet to pieces and pieces to things.
    fn join(&mut self, fan: &Fan, params: &ObstacleParams) {
        self.ranges.reserve(fan.directions());
        self.things.clear();
        self.things.reserve(fan.directions());
        let mut from = 0;
        while from < self.feet.len() {
            let goes_on = |pair: &&[Foot]| {
                pair[1].direction - pair[0].direction <= DIRECTION_GAP
                    && (pair[0].range - pair[1].range).abs() <= STEP
            };
            let to = from + 1 + self.feet[from..].windows(2).take_while(goes_on).count();
            let new = self.things.len();
            self.feet[from..to].iter_mut().for_each(|f| f.thing = new);
            let piece = self.piece(new, from..to, fan);
            if piece.surface < LEAST_SURFACE / 4.0 {
                self.feet[from..to].iter_mut().for_each(|f| f.thing = NONE);
            } else if let Some(thing) = self.things.iter().position(|t| t.joins(&piece, params)) {
                self.feet[from..to].iter_mut().for_each(|f| f.thing = thing);
                self.things[thing] = self.piece(thing, 0..to, fan);
            } else {
                self.things.push(piece);
            }
            from = to;
        }
    }

    /// The feet of a thing among some feet, of which it has at least one.
    fn piece(&mut self, thing: usize, among: Range<usize>, fan: &Fan) -> Piece {
        let feet = self.feet[among].iter().filter(|foot| foot.thing == thing);
        self.ranges.clear();
        self.ranges.extend(feet.clone().map(|foot| foot.range));
        let count = self.ranges.len();
        let (_, range, _) = self
            .ranges
            .select_nth_unstable_by(count / 4, f64::total_cmp);
        let (right, left) = feet.clone().fold((usize::MAX, 0), |(r, l), foot| {
            (r.min(foot.direction), l.max(foot.direction))
        });
        let of = |foot: &Foot| foot.changed as f64 * (foot.range * fan.step()).powi(2);
        Piece {
            range: *range,
            depth: feet.clone().nth(count / 2).map_or(0.0, |foot| foot.depth),
            right: fan.bearing(right) - fan.step() / 2.0,
            left: fan.bearing(left) + fan.step() / 2.0,
            surface: feet.clone().map(of).sum(),
            at_side: feet.clone().any(|foot| foot.at_side),
            at_bottom: 2 * feet.filter(|foot| foot.at_bottom).count() > count,
        }
    }
}

fn region(thing: &Piece, fan: &Fan, camera: [f64; 2], [then, now]: [Moment; 2]) -> MovedRegion {
    let Piece {
        range,
        depth,
        right,
        left,
        at_side,
        at_bottom,
        ..
    } = *thing;
    let bearing = (right + left) / 2.0;
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
