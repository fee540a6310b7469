//! Walls from a map: the outline of its occupied cells, runs of equal edges joined.

use occgrid::{Cell, CellState, GridPoint, OccupancyMap, Point2, Pose2};

use super::building::Wall;
use super::solid::{ALL_SIDES, Band, Finish, Footprint, Solid};
use crate::real::{Placed, atan2, distance};

/// Adds a thin wall for every run of edges between occupied and other cells.
pub(crate) fn add(map: &OccupancyMap, height: f64, solids: &mut Vec<Solid>) {
    let frame = map.frame();
    let (w, h) = (frame.width(), frame.height());
    let full = |col: i64, row: i64| {
        let inside = col >= 0 && row >= 0 && col < i64::from(w) && row < i64::from(h);
        inside && map.state(Cell::new(col as u32, row as u32)) == CellState::Occupied
    };
    for row in 0..=i64::from(h) {
        runs(
            w,
            |col| sides(full(col, row - 1), full(col, row)),
            |kind, from, to| {
                let (a, b) = ([from, row], [to, row]);
                // free space is to the left of the wall's direction
                let (a, b) = if kind == FULL_BEFORE { (b, a) } else { (a, b) };
                solids.push(wall(map, a, b, height));
            },
        );
    }
    for col in 0..=i64::from(w) {
        runs(
            h,
            |row| sides(full(col - 1, row), full(col, row)),
            |kind, from, to| {
                let (a, b) = ([col, from], [col, to]);
                let (a, b) = if kind == FULL_BEFORE { (a, b) } else { (b, a) };
                solids.push(wall(map, a, b, height));
            },
        );
    }
}

const ALIKE: u8 = 0;
const FULL_BEFORE: u8 = 1;
const FULL_AFTER: u8 = 2;

fn sides(before: bool, after: bool) -> u8 {
    match (before, after) {
        (true, false) => FULL_BEFORE,
        (false, true) => FULL_AFTER,
        _ => ALIKE,
    }
}

/// Calls `found` for every longest run of one kind of edge.
fn runs(length: u32, kind: impl Fn(i64) -> u8, mut found: impl FnMut(u8, i64, i64)) {
    let (mut begin, mut current) = (0, ALIKE);
    for i in 0..=i64::from(length) {
        let next = if i < i64::from(length) {
            kind(i)
        } else {
            ALIKE
        };
        if next != current {
            if current != ALIKE {
                found(current, begin, i);
            }
            (begin, current) = (i, next);
        }
    }
}

fn wall(map: &OccupancyMap, from: [i64; 2], to: [i64; 2], height: f64) -> Solid {
    let place = |[col, row]: [i64; 2]| -> Point2 {
        map.frame().map_from_grid(GridPoint {
            col: col as f64,
            row: row as f64,
        })
    };
    let (a, b) = (place(from), place(to));
    let paint = Wall::default();
    let heading = atan2(b.y - a.y, b.x - a.x);
    let middle = Pose2::new((a.x + b.x) / 2.0, (a.y + b.y) / 2.0, heading);
    Solid {
        footprint: Footprint::Block {
            placed: Placed::at(middle),
            half: [distance(a, b) / 2.0, 0.0],
        },
        bottom: 0.0,
        top: height,
        finish: Finish {
            brightness: paint.brightness,
            texture: paint.texture,
            along: 0.0,
            bands: vec![Band {
                sides: ALL_SIDES,
                along: [f64::NEG_INFINITY, f64::INFINITY],
                up: [0.0, paint.skirting],
                brightness: paint.skirting_brightness,
            }],
        },
        backed: true,
    }
}
