//! A floor plan from an occupancy map: walls along the boundary, openings as door candidates.

use std::collections::BTreeMap;

use occgrid::{GridPoint, OccupancyMap};

use super::FloorPlan;
use super::doors::{Doorway, doorways};
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
    /// How far the floor before and behind a door is looked at [m], above 0. More refuses doors of small rooms.
    pub door_depth: f64,
    /// A door keeps apart what is on its sides: with it closed, the way round is this much longer or more [m], above 0.
    /// More takes longer and trusts fewer doors between rooms that have two.
    pub detour: f64,
    /// The thickest wall that has doors [m]: openings of its two faces are one doorway.
    pub wall_max: f64,
    /// Doorways of less confidence are left out of the plan, 0 to 1. More leaves out doors beside short walls.
    pub least_confidence: f64,
}

impl Default for DeriveParams {
    fn default() -> Self {
        Self {
            tolerance_cells: 1.5,
            wall_min: 0.4,
            gap_max: 0.4,
            door_min: 0.6,
            door_max: 1.4,
            door_depth: 0.5,
            detour: 3.0,
            wall_max: 0.4,
            least_confidence: 0.6,
        }
    }
}

impl FloorPlan {
    /// The plan of a map: straight walls fitted to the boundary between free and occupied cells, placed
    /// where the occupancy crosses one half, and the corners of its doorways. Nearly linear in the cells of the map.
    #[must_use]
    pub fn from_map(map: &OccupancyMap, params: &DeriveParams) -> Self {
        Self::with_doorways(map, params).0
    }

    /// The plan of a map and all that may be a doorway in it, the likeliest first; those that the plan has are the
    /// ones of [`DeriveParams::least_confidence`] and more. They are candidates: a map does not show what is a
    /// door, and a gap in a wall or between long shelves looks the same.
    #[must_use]
    pub fn with_doorways(map: &OccupancyMap, params: &DeriveParams) -> (Self, Vec<Doorway>) {
        let cell = map.frame().resolution();
        let tolerance = params.tolerance_cells.max(0.5);
        let mut rough = Vec::new();
        for chain in chains(map) {
            pieces(&chain, tolerance, tolerance + 1.0, &mut rough);
        }
        let mut walls = join(&rough, tolerance, params.gap_max / cell);
        // the piece of wall between a door and a corner may be shorter than any wall of the plan
        let doorways = doorways(map, &walls, params);
        walls.retain(|wall| wall.length() * cell >= params.wall_min);
        let at = |[col, row]: [f64; 2]| map.frame().map_from_grid(GridPoint { col, row });
        let likely = |d: &&Doorway| d.confidence >= params.least_confidence;
        let corners = doorways.iter().filter(likely).flat_map(|d| &d.faces);
        let plan = Self {
            walls: walls.iter().map(|w| w.ends.map(at)).collect(),
            door_corners: corners.flatten().copied().collect(),
        };
        (plan, doorways)
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
