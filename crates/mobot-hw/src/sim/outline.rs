//! The world in plan: the outline of its solids as exact lines and circles, and what a ray or a body
//! meets of it.

use std::f64::consts::TAU;

use occgrid::Point2;

use super::bends::{Corner, bends};
use super::buckets::Buckets;
use super::solid::{Footprint, Solid};
use crate::real::{distance, length, sin_cos};

/// Lines closer than this to a place pass through it [m].
pub(crate) const TOUCH: f64 = 1e-6;

/// A piece of outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    /// A line with free space on its left.
    Line([Point2; 2]),
    Circle {
        center: Point2,
        radius: f64,
    },
}

/// An outline and the heights between which it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    pub(crate) shape: Shape,
    pub(crate) bottom: f64,
    pub(crate) top: f64,
}

/// What a ray in plan met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Strike {
    pub(crate) range: f64,
    /// Outward, unit length, towards where the ray came from.
    pub(crate) normal: Point2,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Outline {
    pub(crate) pieces: Vec<Piece>,
    buckets: Buckets,
    corners: Vec<Corner>,
    corner_buckets: Buckets,
}

impl Outline {
    pub(crate) fn of(solids: &[Solid]) -> Self {
        let pieces = union(solids);
        let buckets = Buckets::new(&pieces.iter().map(extent).collect::<Vec<_>>());
        let corners = bends(&pieces, &buckets);
        let places: Vec<_> = corners.iter().map(|c| ([c.at; 2], 0.0)).collect();
        Self {
            buckets,
            pieces,
            corner_buckets: Buckets::new(&places),
            corners,
        }
    }

    /// Lines of everything that stands on the floor, circles as polygons of 24 sides.
    pub(crate) fn floor_segments(&self) -> Vec<[Point2; 2]> {
        let mut segments = Vec::new();
        for piece in self.pieces.iter().filter(|p| p.bottom <= 0.0) {
            match piece.shape {
                Shape::Line(ends) => segments.push(ends),
                Shape::Circle { center, radius } => {
                    let corner = |k: i32| {
                        let (sin, cos) = sin_cos(-f64::from(k) * TAU / 24.0);
                        Point2::new(center.x + radius * cos, center.y + radius * sin)
                    };
                    segments.extend((0..24).map(|k| [corner(k), corner(k + 1)]));
                }
            }
        }
        segments
    }

    /// The first outline that a ray meets before `far`, at a height above the floor.
    pub(crate) fn cast(
        &self,
        from: Point2,
        direction: Point2,
        far: f64,
        height: f64,
    ) -> Option<Strike> {
        let mut first: Option<Strike> = None;
        self.buckets.walk(from, direction, far, |list| {
            for index in list {
                let piece = &self.pieces[*index as usize];
                if height < piece.bottom || height > piece.top {
                    continue;
                }
                let limit = first.map_or(far, |s| s.range);
                first = meet(&piece.shape, from, direction)
                    .filter(|s| s.range < limit)
                    .or(first);
            }
            first.map_or(far, |s| s.range)
        });
        first
    }

    /// The place of the outline nearest to a point, within `reach`, of what stands below `height`.
    pub(crate) fn nearest(&self, to: Point2, reach: f64, height: f64) -> Option<Point2> {
        let (mut best, mut place) = (reach, None);
        self.buckets.around(to, reach, |index| {
            let piece = &self.pieces[index];
            if piece.bottom >= height {
                return;
            }
            let near = nearest_on(&piece.shape, to);
            let away = distance(near, to);
            if away < best {
                (best, place) = (away, Some(near));
            }
        });
        place
    }

    /// Calls `found` with every corner within `reach` of a place, at a height.
    pub(crate) fn corners_around(
        &self,
        place: Point2,
        reach: f64,
        height: f64,
        mut found: impl FnMut(&Corner),
    ) {
        self.corner_buckets.around(place, reach, |index| {
            let corner = &self.corners[index];
            if (corner.bottom..=corner.top).contains(&height) && distance(corner.at, place) <= reach
            {
                found(corner);
            }
        });
    }
}

/// Where a ray meets a shape, ahead of its start.
pub(crate) fn meet(shape: &Shape, from: Point2, direction: Point2) -> Option<Strike> {
    match *shape {
        Shape::Line([a, b]) => {
            let (ex, ey) = (b.x - a.x, b.y - a.y);
            let (wx, wy) = (a.x - from.x, a.y - from.y);
            let cross = direction.x * ey - direction.y * ex;
            let range = (wx * ey - wy * ex) / cross;
            let along = (wx * direction.y - wy * direction.x) / cross;
            let long = length(ex, ey);
            let slack = 1e-9 / long;
            // a ray along the line divides by 0 and meets nothing
            let hit = range >= 0.0 && along >= -slack && along <= 1.0 + slack;
            hit.then(|| {
                let sign = if cross > 0.0 { -1.0 } else { 1.0 };
                let normal = Point2::new(sign * ey / long, -sign * ex / long);
                Strike { range, normal }
            })
        }
        Shape::Circle { center, radius } => {
            let (x, y) = (center.x - from.x, center.y - from.y);
            let middle = x * direction.x + y * direction.y;
            let off = x * direction.y - y * direction.x;
            let half = (radius * radius - off * off).sqrt();
            let range = middle - half;
            // NaN where the ray passes by
            (range >= 0.0).then(|| Strike {
                range,
                normal: Point2::new(
                    (direction.x * range - x) / radius,
                    (direction.y * range - y) / radius,
                ),
            })
        }
    }
}

pub(crate) fn nearest_on(shape: &Shape, to: Point2) -> Point2 {
    match *shape {
        Shape::Line([a, b]) => {
            let (ex, ey) = (b.x - a.x, b.y - a.y);
            let t = ((to.x - a.x) * ex + (to.y - a.y) * ey) / (ex * ex + ey * ey);
            let t = t.clamp(0.0, 1.0);
            Point2::new(a.x + t * ex, a.y + t * ey)
        }
        Shape::Circle { center, radius } => {
            let away = distance(center, to).max(1e-12);
            let (x, y) = ((to.x - center.x) / away, (to.y - center.y) / away);
            Point2::new(center.x + radius * x, center.y + radius * y)
        }
    }
}

fn extent(piece: &Piece) -> ([Point2; 2], f64) {
    match piece.shape {
        Shape::Line(ends) => (ends, 0.0),
        Shape::Circle { center, radius } => ([center; 2], radius),
    }
}

/// The outlines of all solids, without what lies inside another that is as tall.
fn union(solids: &[Solid]) -> Vec<Piece> {
    let bodies: Vec<(usize, &Solid)> = solids
        .iter()
        .enumerate()
        .filter(|(_, s)| !is_thin(s))
        .collect();
    let spans: Vec<_> = bodies
        .iter()
        .map(|(_, s)| {
            let [a, _, b, _] = s.footprint.corners();
            let center = Point2::new((a.x + b.x) / 2.0, (a.y + b.y) / 2.0);
            ([center; 2], distance(a, b) / 2.0)
        })
        .collect();
    let buckets = Buckets::new(&spans);
    let mut pieces = Vec::new();
    for (own, solid) in solids.iter().enumerate() {
        let place = |shape| Piece {
            shape,
            bottom: solid.bottom,
            top: solid.top,
        };
        if let Footprint::Disc { center, radius } = solid.footprint {
            pieces.push(place(Shape::Circle { center, radius }));
            continue;
        }
        let corners = solid.footprint.corners();
        let sides: &[[usize; 2]] = if solid.backed {
            &[[1, 0]]
        } else if is_thin(solid) {
            &[[1, 0], [3, 2]]
        } else {
            &[[1, 0], [2, 1], [3, 2], [0, 3]]
        };
        for [from, to] in sides {
            let side = [corners[*from], corners[*to]];
            let mut hidden = Vec::new();
            buckets.around(middle(side), distance(side[0], side[1]) / 2.0, |index| {
                let (other, body) = bodies[index];
                let covers = body.bottom <= solid.bottom && body.top >= solid.top;
                if !covers || other == own {
                    return;
                }
                // of two sides that lie on one line, the one of the earlier solid stays
                hidden.extend(inside(&body.footprint, side, other < own));
            });
            pieces.extend(
                rest(side, hidden)
                    .into_iter()
                    .map(|s| place(Shape::Line(s))),
            );
        }
    }
    pieces
}

fn is_thin(solid: &Solid) -> bool {
    matches!(solid.footprint, Footprint::Block { half, .. } if half[1] <= 0.0)
}

fn middle([a, b]: [Point2; 2]) -> Point2 {
    Point2::new((a.x + b.x) / 2.0, (a.y + b.y) / 2.0)
}

/// The part of a line, as shares of it, that lies inside a footprint; with `border`, also on a side that
/// has free space on the same side as the line.
fn inside(footprint: &Footprint, [a, b]: [Point2; 2], border: bool) -> Option<[f64; 2]> {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    match footprint {
        Footprint::Block { placed, half } => {
            let (p, q) = (placed.inward(a), placed.inward(b));
            // the line's left, outward, along each axis
            let out = [p.y - q.y, q.x - p.x];
            for (p, q, half, out) in [(p.x, q.x, half[0], out[0]), (p.y, q.y, half[1], out[1])] {
                let d = q - p;
                if d.abs() < TOUCH {
                    let same_side = border && p * out > 0.0;
                    if p.abs()
                        >= if same_side {
                            half + TOUCH
                        } else {
                            half - TOUCH
                        }
                    {
                        return None;
                    }
                    continue;
                }
                let half = half - TOUCH;
                let (t0, t1) = ((-half - p) / d, (half - p) / d);
                enter = enter.max(t0.min(t1));
                leave = leave.min(t0.max(t1));
            }
        }
        Footprint::Disc { center, radius } => {
            let long = distance(a, b);
            let (dx, dy) = ((b.x - a.x) / long, (b.y - a.y) / long);
            let (x, y) = (center.x - a.x, center.y - a.y);
            let (along, off) = (x * dx + y * dy, x * dy - y * dx);
            let half = (radius * radius - off * off).max(0.0).sqrt();
            enter = enter.max((along - half) / long);
            leave = leave.min((along + half) / long);
        }
    }
    (leave - enter > 1e-9).then_some([enter, leave])
}

/// What is left of a line without some parts of it.
fn rest([a, b]: [Point2; 2], mut hidden: Vec<[f64; 2]>) -> Vec<[Point2; 2]> {
    hidden.sort_by(|p, q| p[0].total_cmp(&q[0]));
    let long = distance(a, b);
    let at = |t: f64| Point2::new(a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t);
    let mut left = Vec::new();
    let mut from = 0.0;
    for [begin, end] in hidden.into_iter().chain([[1.0, 1.0]]) {
        if (begin - from) * long > 2.0 * TOUCH {
            left.push([at(from), at(begin)]);
        }
        from = end.max(from);
    }
    left
}
