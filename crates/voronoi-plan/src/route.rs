//! Routes, and how they are shortened inside their certificate.

use occgrid::{GridPoint, Point2};

use crate::ClearanceField;
use crate::square::{between, squared_distance};

/// A certified way from a start to a goal.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Route {
    /// The centre line in the map frame: first the start, last the goal, exactly as asked.
    pub points: Vec<Point2>,
    /// Length of the centre line [m].
    pub length: f64,
    /// The certificate: no point of the centre line is nearer to a cell that is not free [m].
    pub clearance: f64,
    /// Where on the centre line the clearance is least.
    pub bottleneck: Point2,
    /// The nearest point of a not-free cell to it.
    pub nearest_obstacle: Point2,
    /// The arcs of the roadmap that the route follows before it is shortened, in order; empty where it
    /// does not use the roadmap.
    pub arcs: Vec<usize>,
}

/// Rounds of relaxation at most; each costs a few clearance tests a vertex.
const ROUNDS: usize = 4;

/// Bisections when a vertex is drawn towards its chord.
const BISECTIONS: usize = 5;

/// Shortens a polyline whose pieces all keep `min` cells of clearance: the result does too, has the same
/// ends, and is never longer.
///
/// Vertices are skipped where the straight line is clear, then drawn towards the chord of their neighbours
/// and corners cut, until little is gained; every piece that is not of the given line is tested exactly.
pub(crate) fn shorten(field: &ClearanceField, line: &[GridPoint], min: f64) -> Vec<GridPoint> {
    let mut points = pull(field, line, min);
    let mut length = length_of(&points);
    for _ in 0..ROUNDS {
        if points.len() < 3 {
            break;
        }
        draw_in(field, &mut points, min);
        points = cut_corners(field, &points, min);
        points = pull(field, &points, min);
        let shorter = length_of(&points);
        let gained = length - shorter;
        length = shorter;
        if gained < 1e-3 * length {
            break;
        }
    }
    points
}

/// Length of a polyline [cells].
pub(crate) fn length_of(points: &[GridPoint]) -> f64 {
    points
        .windows(2)
        .map(|p| squared_distance(p[0], p[1]).sqrt())
        .sum()
}

/// From each vertex kept, goes straight to the last one that a doubling and halving stride finds clear.
pub(crate) fn pull(field: &ClearanceField, line: &[GridPoint], min: f64) -> Vec<GridPoint> {
    let mut kept = Vec::new();
    let Some(&first) = line.first() else {
        return kept;
    };
    kept.push(first);
    let mut at = 0;
    while at + 1 < line.len() {
        let mut reached = at + 1;
        let clear = |to: usize| to < line.len() && field.segment_is_clear(line[at], line[to], min);
        let mut stride = 1;
        while clear(reached + stride) {
            reached += stride;
            stride *= 2;
        }
        while stride > 1 {
            stride /= 2;
            if clear(reached + stride) {
                reached += stride;
            }
        }
        kept.push(line[reached]);
        at = reached;
    }
    kept
}

/// Draws every inner vertex as far towards the chord of its neighbours as stays clear; drops it there.
fn draw_in(field: &ClearanceField, points: &mut Vec<GridPoint>, min: f64) {
    let mut i = 1;
    while i + 1 < points.len() {
        let (before, at, after) = (points[i - 1], points[i], points[i + 1]);
        if field.segment_is_clear(before, after, min) {
            points.remove(i);
            i = i.saturating_sub(1).max(1);
            continue;
        }
        let (a, b) = (
            squared_distance(before, at).sqrt(),
            squared_distance(at, after).sqrt(),
        );
        let target = between(before, after, a / (a + b).max(f64::MIN_POSITIVE));
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = (low + high) / 2.0;
            let there = between(at, target, middle);
            if field.segment_is_clear(before, there, min)
                && field.segment_is_clear(there, after, min)
            {
                low = middle;
            } else {
                high = middle;
            }
        }
        points[i] = between(at, target, low);
        i += 1;
    }
}

/// Replaces every inner vertex by two on its pieces, as far from it as the line between them is clear.
fn cut_corners(field: &ClearanceField, points: &[GridPoint], min: f64) -> Vec<GridPoint> {
    let mut cut = vec![points[0]];
    for i in 1..points.len() - 1 {
        let (before, at, after) = (points[i - 1], points[i], points[i + 1]);
        let found = [0.5, 0.25, 0.1].into_iter().find_map(|t| {
            let (a, b) = (between(at, before, t), between(at, after, t));
            field.segment_is_clear(a, b, min).then_some([a, b])
        });
        match found {
            Some(pair) => cut.extend(pair),
            None => cut.push(at),
        }
    }
    cut.extend(points.last());
    cut
}
