//! The boundary of free space, as chains of points with sub-cell places.

use occgrid::{Cell, CellState, OccupancyMap};

/// Longest chain [edges]; a longer boundary is cut, and its walls are joined again later.
const CHAIN_MAX: usize = 4096;

/// Directions of cell edges in the picture: right, down, left, up. Free cells lie to the left of travel.
const STEPS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];
/// The cells to the left and to the right of an edge that leaves the lattice point (0, 0).
const LEFT: [[i64; 2]; 4] = [[0, -1], [0, 0], [-1, 0], [-1, -1]];
const RIGHT: [[i64; 2]; 4] = [[0, 0], [-1, 0], [-1, -1], [0, -1]];

/// A stretch of boundary in grid coordinates [cells], free cells to its left as the picture shows it.
pub(super) struct Chain {
    /// Where the occupancy crosses one half, one a cell edge.
    pub(super) crossings: Vec<[f64; 2]>,
    /// Of the first so many crossings, how many have something occupied behind them.
    pub(super) backed: Vec<u32>,
    /// Corners of cells along the way, one more than the crossings.
    pub(super) corners: Vec<[f64; 2]>,
}

/// All boundaries of free space. Linear in cells.
pub(super) fn chains(map: &OccupancyMap) -> Vec<Chain> {
    let (width, height) = (map.frame().width() as usize, map.frame().height() as usize);
    let mut seen = vec![0_u8; (width + 1) * (height + 1)];
    let mut out = Vec::new();
    for row in 0..=height {
        for col in 0..=width {
            for direction in 0..4 {
                let start = [col as i64, row as i64];
                if seen[row * (width + 1) + col] & 1 << direction == 0
                    && crossing(map, start, direction).is_some()
                {
                    out.push(follow(map, &mut seen, start, direction));
                }
            }
        }
    }
    out
}

fn follow(map: &OccupancyMap, seen: &mut [u8], start: [i64; 2], direction: usize) -> Chain {
    let stride = map.frame().width() as usize + 1;
    let (mut at, mut direction) = (start, direction);
    let mut chain = Chain {
        crossings: Vec::new(),
        backed: vec![0],
        corners: vec![[at[0] as f64, at[1] as f64]],
    };
    while let Some(here) = crossing(map, at, direction) {
        let mark = &mut seen[at[1] as usize * stride + at[0] as usize];
        if *mark & 1 << direction != 0 || chain.crossings.len() == CHAIN_MAX {
            break;
        }
        *mark |= 1 << direction;
        chain.crossings.push(here.point);
        let before = chain.backed[chain.backed.len() - 1];
        chain.backed.push(before + u32::from(here.backed));
        at = [at[0] + STEPS[direction][0], at[1] + STEPS[direction][1]];
        chain.corners.push([at[0] as f64, at[1] as f64]);
        // left first: cells that are not free hang together over their corners, as thin slanted walls do
        let turns = [(direction + 3) % 4, direction, (direction + 1) % 4];
        match turns.iter().find(|&&t| crossing(map, at, t).is_some()) {
            Some(&next) => direction = next,
            None => break,
        }
    }
    chain
}

/// The boundary between a free cell and one that is not.
struct Crossing {
    /// Where the occupancy crosses one half.
    point: [f64; 2],
    /// Whether something occupied is behind it.
    backed: bool,
}

/// How far behind the boundary an occupied cell may be [cells]: mapped walls have a blurred rim.
const RIM: i64 = 2;

fn crossing(map: &OccupancyMap, at: [i64; 2], direction: usize) -> Option<Crossing> {
    let cell = |offset: [i64; 2]| [at[0] + offset[0], at[1] + offset[1]];
    let (left, right) = (cell(LEFT[direction]), cell(RIGHT[direction]));
    let free = value(map, left).filter(|&v| map.classify(v) == CellState::Free)?;
    let neighbour = value(map, right);
    if neighbour.is_some_and(|v| map.classify(v) == CellState::Free) {
        return None;
    }
    let inward = [right[0] - left[0], right[1] - left[1]];
    let behind = (0..RIM).find_map(|k| {
        let deep = [right[0] + k * inward[0], right[1] + k * inward[1]];
        let value = value(map, deep)?;
        (map.classify(value) == CellState::Occupied).then_some((k, f64::from(value)))
    });
    let free = f64::from(free);
    let depth = behind.map_or(0.5, |(k, occupied)| {
        let share = ((50.0 - free) / (occupied - free)).clamp(0.0, 1.0);
        share * (k + 1) as f64
    });
    Some(Crossing {
        point: [0, 1].map(|i| left[i] as f64 + 0.5 + depth * inward[i] as f64),
        backed: behind.is_some(),
    })
}

fn value(map: &OccupancyMap, [col, row]: [i64; 2]) -> Option<i8> {
    let frame = map.frame();
    let inside = (0..i64::from(frame.width())).contains(&col)
        && (0..i64::from(frame.height())).contains(&row);
    inside.then(|| map.values()[frame.index(Cell::new(col as u32, row as u32))])
}
