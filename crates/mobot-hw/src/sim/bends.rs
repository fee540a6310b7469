//! The corners of an outline, which send sound back.

use occgrid::Point2;

use super::buckets::Buckets;
use super::outline::{Piece, Shape, TOUCH, nearest_on};
use crate::real::distance;

/// A place where the outline bends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Corner {
    pub(crate) at: Point2,
    /// Whether free space is inside the angle: sound comes back from two walls.
    pub(crate) hollow: bool,
    pub(crate) bottom: f64,
    pub(crate) top: f64,
}

/// The corners of the outline: where a line ends and another begins in another direction, or at a line
/// that goes on, or nowhere.
pub(crate) fn bends(pieces: &[Piece], buckets: &Buckets) -> Vec<Corner> {
    let mut corners = Vec::new();
    for (index, piece) in pieces.iter().enumerate() {
        let Shape::Line(line) = piece.shape else {
            continue;
        };
        for (end, at) in line.into_iter().enumerate() {
            let joint = joint(pieces, buckets, index, line, end);
            // a joint is met from both of its lines: count it where the first one ends
            let counts = end == 1 || joint.is_none_or(|j| !j.continued);
            let turn = joint.map_or(-2.0, |j| j.turn);
            if counts && turn.abs() > 0.05 {
                corners.push(Corner {
                    at,
                    hollow: turn > 0.0,
                    bottom: piece.bottom,
                    top: piece.top,
                });
            }
        }
    }
    corners
}

#[derive(Clone, Copy)]
struct Joint {
    /// Whether another line takes over here, and does not just pass by.
    continued: bool,
    /// How far the outline turns to the left, the free side: the sine, past a right angle 2 less it.
    turn: f64,
}

/// What happens at one end of a line; of several lines that take over, the leftmost bounds the free
/// space.
fn joint(
    pieces: &[Piece],
    buckets: &Buckets,
    index: usize,
    line: [Point2; 2],
    end: usize,
) -> Option<Joint> {
    let at = line[end];
    let near = |p: Point2| distance(p, at) <= 10.0 * TOUCH;
    let mut found: Option<Joint> = None;
    buckets.around(at, 0.0, |other| {
        let Shape::Line([c, d]) = pieces[other].shape else {
            return;
        };
        let joins = near([c, d][1 - end]);
        let passes = !near(c) && !near(d) && near(nearest_on(&pieces[other].shape, at));
        if other == index || !(joins || passes) {
            return;
        }
        let turn = left_turn(line, [c, d]);
        let joint = Joint {
            continued: joins,
            turn: if joins {
                turn
            } else {
                turn.abs().min(2.0 - turn.abs())
            },
        };
        let better = found.is_none_or(|f| (joins, joint.turn) > (f.continued, f.turn));
        if better {
            found = Some(joint);
        }
    });
    found
}

/// -2 (back, around an end) to 2.
fn left_turn([a, b]: [Point2; 2], [c, d]: [Point2; 2]) -> f64 {
    let long = distance(a, b) * distance(c, d);
    let sine = ((b.x - a.x) * (d.y - c.y) - (b.y - a.y) * (d.x - c.x)) / long;
    let cosine = ((b.x - a.x) * (d.x - c.x) + (b.y - a.y) * (d.y - c.y)) / long;
    if cosine >= 0.0 {
        sine
    } else if sine > 1e-6 {
        2.0 - sine
    } else {
        -2.0 - sine
    }
}
