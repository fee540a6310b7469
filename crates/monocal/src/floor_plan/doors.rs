//! Doorways of a map: where a wall ends, goes on free as far as a door is wide, and begins again or meets another.

use std::collections::BTreeMap;

use occgrid::{CellState, GridPoint, OccupancyMap, Point2};

use super::derive::DeriveParams;
use super::passage::{parts, sides_free, state, widens};
use super::wall_fit::Piece;

/// What may be a doorway: an opening in a wall, or between a wall's end and a wall across, free on both sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Doorway {
    /// The corners of its two jambs in the map frame [m], a pair for each face of the wall on which both were found.
    pub faces: Vec<[Point2; 2]>,
    /// Between the jambs [m].
    pub width: f64,
    /// How much it looks like a door, 0 to 1: how long the walls are that make its jambs, how free the floor is on
    /// both sides, and whether both faces of the wall show it. An order, not a probability.
    pub confidence: f64,
}

/// An opening in one face of a wall, in grid coordinates [cells].
#[derive(Clone, Copy)]
struct Opening {
    jambs: [[f64; 2]; 2],
    /// From the first jamb to the second.
    ahead: [f64; 2],
    confidence: f64,
}

impl Opening {
    fn width(&self) -> f64 {
        let [a, b] = self.jambs;
        (b[0] - a[0]).hypot(b[1] - a[1])
    }

    fn middle(&self) -> [f64; 2] {
        let [a, b] = self.jambs;
        [0, 1].map(|i| 0.5 * (a[i] + b[i]))
    }

    /// Whether both are openings of one doorway: parallel, beside each other, no farther apart than a wall is thick.
    fn is_of(&self, other: &Self, thickness: f64) -> bool {
        let (a, b) = (self.middle(), other.middle());
        let off = [b[0] - a[0], b[1] - a[1]];
        let along = off[0] * self.ahead[0] + off[1] * self.ahead[1];
        let across = off[1] * self.ahead[0] - off[0] * self.ahead[1];
        let parallel = self.ahead[0] * other.ahead[0] + self.ahead[1] * other.ahead[1];
        parallel.abs() > IN_LINE
            && across.abs() <= thickness
            && along.abs() <= 0.3 * self.width().max(other.width())
    }
}

/// The doorways among walls that were fitted to a map, the likeliest first.
pub(super) fn doorways(map: &OccupancyMap, walls: &[Piece], params: &DeriveParams) -> Vec<Doorway> {
    let cell = map.frame().resolution();
    let mut found = openings(map, walls, params);
    found.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    let at = |[col, row]: [f64; 2]| map.frame().map_from_grid(GridPoint { col, row });
    let mut doorways: Vec<(Opening, Doorway)> = Vec::new();
    for opening in found {
        let corners = opening.jambs.map(at);
        let known = doorways
            .iter_mut()
            .find(|(first, _)| first.is_of(&opening, params.wall_max / cell));
        match known {
            Some((_, doorway)) => {
                let apart = |face: &[Point2; 2]| {
                    let middle = |f: &[Point2; 2]| {
                        Point2::new(0.5 * (f[0].x + f[1].x), 0.5 * (f[0].y + f[1].y))
                    };
                    middle(face).distance(middle(&corners))
                };
                // seen from its other jamb, it is the same face again
                if doorway
                    .faces
                    .iter()
                    .all(|face| apart(face) > SAME_FACE * cell)
                {
                    doorway.faces.push(corners);
                    doorway.confidence =
                        1.0 - (1.0 - doorway.confidence) * (1.0 - 0.5 * opening.confidence);
                }
            }
            None => doorways.push((
                opening,
                Doorway {
                    faces: vec![corners],
                    width: opening.width() * cell,
                    confidence: opening.confidence,
                },
            )),
        }
    }
    let mut doorways: Vec<Doorway> = doorways.into_iter().map(|(_, doorway)| doorway).collect();
    doorways.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    doorways
}

/// Openings whose middles are this near are the same face [cells].
const SAME_FACE: f64 = 1.5;

/// Cosine of the angle by which walls in line may differ (15 degrees: the ends beside doors are short and rough).
const IN_LINE: f64 = 0.966;
/// Cosine above which a wall is not across.
const ACROSS: f64 = 0.5;
/// How far from its wall a jamb may be [cells].
const JAMB: f64 = 4.0;

/// From the end of each wall that ends freely to what stands in its line.
fn openings(map: &OccupancyMap, walls: &[Piece], params: &DeriveParams) -> Vec<Opening> {
    let cell = map.frame().resolution();
    let near = Near::new(walls);
    let mut found = Vec::new();
    let long_enough = |wall: &Piece| wall.length() * cell >= params.wall_min;
    for (index, wall) in walls.iter().enumerate().filter(|(_, w)| long_enough(w)) {
        for (end, sign) in [(wall.ends[1], 1.0), (wall.ends[0], -1.0)] {
            let ahead = wall.line.direction.map(|d| sign * d);
            // half a cell into the wall: the line along the faces runs between cells
            let [c, r] = wall.line.direction.map(|d| 0.5 * d);
            let Some((first, last)) = free_run(map, [end[0] - r, end[1] + c], ahead, params) else {
                continue;
            };
            let jambs = [first, last].map(|t| [0, 1].map(|i| end[i] + t * ahead[i]));
            let width = (last - first) * cell;
            if !(params.door_min..=params.door_max).contains(&width) {
                continue;
            }
            // a room's corner is no jamb: there the wall turns
            let turns = |other: usize| {
                walls[other].length() * cell > params.wall_max + 4.0 * cell
                    && stands_across(&walls[other], wall, jambs[0])
            };
            if near.around(jambs[0]).any(turns) {
                continue;
            }
            let Some(far) = near
                .around(jambs[1])
                .filter(|&other| other != index)
                .filter(|&other| makes_jamb(&walls[other], wall, sign, jambs[1]))
                .map(|other| walls[other].length() * cell)
                .max_by(f64::total_cmp)
            else {
                continue;
            };
            let long = |length: f64| length / (length + params.wall_min);
            let confidence = long(far.max(wall.length() * cell))
                * sides_free(map, jambs, params.door_depth)
                * widens(map, jambs, params.door_depth)
                * parts(map, jambs, params);
            if confidence < LEAST {
                continue;
            }
            found.push(Opening {
                jambs,
                ahead,
                confidence,
            });
        }
    }
    found
}

/// Whether a wall stands where an opening in the line of another ends: going on in that line with the same face, or
/// across it.
fn makes_jamb(wall: &Piece, from: &Piece, sign: f64, jamb: [f64; 2]) -> bool {
    let (a, b) = (wall.line.direction, from.line.direction);
    let cosine = a[0] * b[0] + a[1] * b[1];
    let across = wall.line.across(jamb).abs();
    if cosine > IN_LINE {
        let start = if sign > 0.0 {
            wall.ends[0]
        } else {
            wall.ends[1]
        };
        across <= JAMB && (start[0] - jamb[0]).hypot(start[1] - jamb[1]) <= 2.0 * JAMB
    } else {
        stands_across(wall, from, jamb)
    }
}

/// Whether a wall passes or touches the line of another at a jamb.
fn stands_across(wall: &Piece, line_of: &Piece, jamb: [f64; 2]) -> bool {
    let (a, b) = (wall.line.direction, line_of.line.direction);
    let along = wall.line.along(jamb);
    let reach = [0, 1].map(|end| wall.line.along(wall.ends[end]));
    (a[0] * b[0] + a[1] * b[1]).abs() < ACROSS
        && wall.line.across(jamb).abs() <= JAMB
        && (reach[0] - JAMB..=reach[1] + JAMB).contains(&along)
}

/// Openings of less confidence are none.
const LEAST: f64 = 0.05;

/// Places a cell along an opening.
const SAMPLES: f64 = 4.0;

/// From where to where the cells along a ray are free, in cells from its start; `None` where the ray starts
/// too far from free cells, or ends at nothing occupied.
fn free_run(
    map: &OccupancyMap,
    from: [f64; 2],
    ahead: [f64; 2],
    params: &DeriveParams,
) -> Option<(f64, f64)> {
    let cell = map.frame().resolution();
    let state = |k: u32| {
        state(
            map,
            [0, 1].map(|i| from[i] + f64::from(k) / SAMPLES * ahead[i]),
        )
    };
    let free = |k: &u32| state(*k) == Some(CellState::Free);
    let samples = |length: f64| (SAMPLES * length / cell).min(1e6) as u32;
    let first = (0..=samples(params.gap_max)).find(free)?;
    let last = (first..=first + samples(params.door_max) + 1).find(|k| !free(k))?;
    let rim = 2 * SAMPLES as u32;
    (last..last + rim).find(|&k| state(k) == Some(CellState::Occupied))?;
    let place = |k: u32| (f64::from(k) - 0.5).max(0.0) / SAMPLES;
    Some((place(first), place(last)))
}

/// Walls by the squares of the grid that they pass.
struct Near {
    squares: BTreeMap<(i64, i64), Vec<usize>>,
}

impl Near {
    /// Side of a square [cells]: no jamb is farther from its wall.
    const SIDE: f64 = 8.0;

    fn new(walls: &[Piece]) -> Self {
        let mut squares: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
        for (index, wall) in walls.iter().enumerate() {
            let steps = (wall.length() / (0.5 * Self::SIDE)).ceil().max(1.0);
            for step in 0..=steps as u32 {
                let t = f64::from(step) / steps;
                let [a, b] = wall.ends;
                let square = Self::square([0, 1].map(|i| a[i] + t * (b[i] - a[i])));
                let there = squares.entry(square).or_default();
                if there.last() != Some(&index) {
                    there.push(index);
                }
            }
        }
        Self { squares }
    }

    fn square([col, row]: [f64; 2]) -> (i64, i64) {
        let at = |x: f64| (x / Self::SIDE).floor() as i64;
        (at(col), at(row))
    }

    fn around(&self, point: [f64; 2]) -> impl Iterator<Item = usize> {
        let (col, row) = Self::square(point);
        let squares =
            (col - 1..=col + 1).flat_map(move |c| (row - 1..=row + 1).map(move |r| (c, r)));
        let found = squares.filter_map(|s| self.squares.get(&s));
        found.flatten().copied()
    }
}
