//! A floor plan from an occupancy map: walls along the boundary, openings as door candidates.

use std::collections::{BTreeMap, BTreeSet};

use occgrid::{CellState, GridPoint, OccupancyMap, Point2};

use super::FloorPlan;
use super::outline::chains;
use super::wall_fit::{Piece, pieces};

/// How a plan is derived from a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeriveParams {
    /// How far a boundary may stray from a straight wall [cells], 0.5 or more. More bridges rougher walls
    /// and rounds off what stands out less.
    pub tolerance_cells: f64,
    /// Walls shorter than this are left out [m]. More drops furniture, and short walls.
    pub wall_min: f64,
    /// Pieces of wall this far apart are one wall [m], below `door_min`. More hides narrow openings.
    pub gap_max: f64,
    /// The narrowest opening that can be a door [m].
    pub door_min: f64,
    /// The widest opening that can be a door [m]. More takes the mouths of corridors for doors.
    pub door_max: f64,
}

impl Default for DeriveParams {
    fn default() -> Self {
        Self {
            tolerance_cells: 1.5,
            wall_min: 0.4,
            gap_max: 0.4,
            door_min: 0.6,
            door_max: 2.0,
        }
    }
}

impl FloorPlan {
    /// The plan of a map: straight walls fitted to the boundary between free and occupied cells, placed
    /// where the occupancy crosses one half; and door corners where a wall ends and, as far on as a door is
    /// wide, goes on or meets another. Openings are candidates: a map does not show what is a door, and a
    /// gap between furniture looks the same. Nearly linear in the cells of the map.
    #[must_use]
    pub fn from_map(map: &OccupancyMap, params: &DeriveParams) -> Self {
        let cell = map.frame().resolution();
        let tolerance = params.tolerance_cells.max(0.5);
        let mut rough = Vec::new();
        for chain in chains(map) {
            pieces(&chain, tolerance, tolerance + 1.0, &mut rough);
        }
        let mut walls = join(&rough, tolerance, params.gap_max / cell);
        walls.retain(|wall| wall.length() * cell >= params.wall_min);
        let at = |[col, row]: [f64; 2]| map.frame().map_from_grid(GridPoint { col, row });
        let mut door_corners: Vec<Point2> = Vec::new();
        for jambs in openings(map, &walls, params) {
            door_corners.extend(jambs.map(at));
        }
        Self {
            walls: walls.iter().map(|w| w.ends.map(at)).collect(),
            door_corners,
        }
    }
}

/// Where pieces start and end, in squares of `side` cells.
struct Ends {
    side: f64,
    squares: [BTreeMap<(i64, i64), Vec<usize>>; 2],
}

impl Ends {
    fn new(pieces: &[Piece], side: f64) -> Self {
        let mut ends = Self {
            side,
            squares: [BTreeMap::new(), BTreeMap::new()],
        };
        for (index, piece) in pieces.iter().enumerate() {
            for (which, end) in piece.ends.iter().enumerate() {
                let square = ends.square(*end);
                ends.squares[which].entry(square).or_default().push(index);
            }
        }
        ends
    }

    fn square(&self, [col, row]: [f64; 2]) -> (i64, i64) {
        let along = |x: f64| (x / self.side).floor() as i64;
        (along(col), along(row))
    }

    /// Pieces whose start (0) or end (1) is within about `side` of a point.
    fn near(&self, which: usize, point: [f64; 2]) -> impl Iterator<Item = usize> {
        let (col, row) = self.square(point);
        let squares =
            (col - 1..=col + 1).flat_map(move |c| (row - 1..=row + 1).map(move |r| (c, r)));
        let found = squares.filter_map(move |s| self.squares[which].get(&s));
        found.flatten().copied()
    }
}

/// Pieces that continue each other become one, across gaps of at most `gap` cells.
fn join(pieces: &[Piece], tolerance: f64, gap: f64) -> Vec<Piece> {
    let ends = Ends::new(pieces, (gap + 2.0).max(4.0));
    let mut taken = vec![false; pieces.len()];
    // long pieces know their direction best, so they grow first
    let mut order: Vec<usize> = (0..pieces.len()).collect();
    let length = |index: &usize| pieces[*index].length();
    order.sort_by(|a, b| length(b).total_cmp(&length(a)).then(a.cmp(b)));
    let mut joined = Vec::with_capacity(pieces.len());
    for first in order {
        if std::mem::replace(&mut taken[first], true) {
            continue;
        }
        let mut wall = pieces[first];
        for side in [1, 0] {
            // forwards, what follows starts where this ends; backwards, it ends where this starts
            let sign = if side == 1 { 1.0 } else { -1.0 };
            loop {
                let from = wall.line.along(wall.ends[side]);
                let ahead =
                    |index: usize| sign * (wall.line.along(pieces[index].ends[1 - side]) - from);
                let fits = |&index: &usize| {
                    !taken[index]
                        && ahead(index) > -2.0
                        && ahead(index) <= gap
                        && wall.continues_as(&pieces[index], tolerance)
                };
                let near = ends.near(1 - side, wall.ends[side]).filter(fits);
                let nearest = near.min_by(|&a, &b| ahead(a).total_cmp(&ahead(b)).then(a.cmp(&b)));
                let Some(index) = nearest else { break };
                taken[index] = true;
                wall = if side == 1 {
                    wall.joined(&pieces[index])
                } else {
                    pieces[index].joined(&wall)
                };
            }
        }
        joined.push(wall);
    }
    joined
}

/// Openings as wide as a door: a wall ends, goes on free in its own direction, and meets something occupied.
/// Both faces of a wall have their own; seen from both jambs they are found once.
fn openings(map: &OccupancyMap, walls: &[Piece], params: &DeriveParams) -> Vec<[[f64; 2]; 2]> {
    let cell = map.frame().resolution();
    let mut found: Vec<[[f64; 2]; 2]> = Vec::new();
    let mut known = BTreeSet::new();
    for wall in walls {
        for (end, sign) in [(wall.ends[1], 1.0), (wall.ends[0], -1.0)] {
            let ahead = wall.line.direction.map(|d| sign * d);
            // half a cell into the wall: the line along the faces runs between cells
            let [c, r] = wall.line.direction.map(|d| 0.5 * d);
            let Some((first, last)) = free_run(map, [end[0] - r, end[1] + c], ahead, params) else {
                continue;
            };
            let jambs = [first, last].map(|t| [0, 1].map(|i| end[i] + t * ahead[i]));
            let middle = [0, 1].map(|i| 0.5 * (jambs[0][i] + jambs[1][i]) / SAME_OPENING);
            let [c, r] = middle.map(|m| m.round() as i64);
            if (params.door_min..=params.door_max).contains(&((last - first) * cell))
                && !(c - 1..=c + 1).any(|c| (r - 1..=r + 1).any(|r| known.contains(&(c, r))))
            {
                known.insert((c, r));
                found.push(jambs);
            }
        }
    }
    found
}

/// Openings whose middles are this near are one [cells].
const SAME_OPENING: f64 = 1.5;

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
        let [col, row] = [0, 1].map(|i| from[i] + f64::from(k) / SAMPLES * ahead[i]);
        let point = map.frame().map_from_grid(GridPoint { col, row });
        map.frame().cell_at(point).map(|cell| map.state(cell))
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
