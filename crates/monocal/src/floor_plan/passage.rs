//! What speaks for a door in the floor about an opening: free on both sides, wider than the opening, and apart.

use occgrid::{CellState, GridPoint, OccupancyMap};

use super::derive::DeriveParams;

/// The share of the floor that is free on the less free side of an opening, in the middle half of its width.
pub(super) fn sides_free(map: &OccupancyMap, [a, b]: [[f64; 2]; 2], depth: f64) -> f64 {
    const STEPS: u32 = 6;
    let side = |sign: f64| {
        let span = [b[0] - a[0], b[1] - a[1]];
        let width = span[0].hypot(span[1]);
        let deep = sign * depth / map.frame().resolution() / width;
        let places = (0..=STEPS).flat_map(|i| (1..=STEPS).map(move |j| (i, j)));
        let free = places.filter(|&(i, j)| {
            let along = 0.25 + 0.5 * f64::from(i) / f64::from(STEPS);
            let away = deep * f64::from(j) / f64::from(STEPS);
            let place = [
                a[0] + along * span[0] - away * span[1],
                a[1] + along * span[1] + away * span[0],
            ];
            state(map, place) == Some(CellState::Free)
        });
        free.count() as f64 / f64::from((STEPS + 1) * STEPS)
    };
    side(1.0).min(side(-1.0))
}

/// How many sides of an opening the floor goes on beyond a jamb: about a door it does, across a corridor it does not.
pub(super) fn widens(map: &OccupancyMap, [a, b]: [[f64; 2]; 2], depth: f64) -> f64 {
    const STEPS: u32 = 4;
    let span = [b[0] - a[0], b[1] - a[1]];
    let width = span[0].hypot(span[1]);
    let deep = depth / map.frame().resolution() / width;
    let side = |sign: f64| {
        [-deep, 1.0 + deep].iter().any(|&along| {
            (1..=STEPS).all(|k| {
                let away = sign * deep * (0.7 + 0.3 * f64::from(k) / f64::from(STEPS));
                // from the jamb outwards
                let from = along.clamp(0.0, 1.0);
                let along = from + (along - from) * f64::from(k) / f64::from(STEPS);
                let place = [
                    a[0] + along * span[0] - away * span[1],
                    a[1] + along * span[1] + away * span[0],
                ];
                state(map, place) == Some(CellState::Free)
            })
        })
    };
    match u8::from(side(1.0)) + u8::from(side(-1.0)) {
        2 => 1.0,
        1 => 0.6,
        _ => 0.1,
    }
}

/// How much longer the way from one side to the other is with the opening closed, over
/// [`DeriveParams::detour`]; 1 where there is none so near.
pub(super) fn parts(map: &OccupancyMap, [a, b]: [[f64; 2]; 2], params: &DeriveParams) -> f64 {
    let cell = map.frame().resolution();
    let span = [b[0] - a[0], b[1] - a[1]];
    let width = span[0].hypot(span[1]);
    let deep = params.door_depth / cell / width;
    let middle = [0, 1].map(|i| 0.5 * (a[i] + b[i]));
    let place = |away: f64| [middle[0] - away * span[1], middle[1] + away * span[0]];
    let reach = (params.detour / cell).ceil().min(1000.0) as i64;
    let side = 2 * reach as usize + 1;
    let [left, top] = middle.map(|m| m.floor() as i64 - reach);
    let index = |p: [i64; 2]| {
        let (c, r) = (p[0] - left, p[1] - top);
        let inside = (0..side as i64).contains(&c) && (0..side as i64).contains(&r);
        inside.then(|| r as usize * side + c as usize)
    };
    // closed: cells whose centres are within a cell of the line from jamb to jamb, and a little beyond
    let closed = |p: [i64; 2]| {
        let off = [0, 1].map(|i| p[i] as f64 + 0.5 - a[i]);
        let along = (off[0] * span[0] + off[1] * span[1]) / width;
        let across = (off[1] * span[0] - off[0] * span[1]) / width;
        across.abs() <= 1.0 && (-2.0..=width + 2.0).contains(&along)
    };
    let cell_of = |p: [f64; 2]| p.map(|x| x.floor() as i64);
    let (from, to) = (cell_of(place(deep)), cell_of(place(-deep)));
    let mut seen = vec![false; side * side];
    let mut ring = vec![from];
    let most = 2 * reach;
    for step in 0..most {
        let mut next = Vec::new();
        for p in ring {
            if p == to {
                let straight = 2.0 * params.door_depth / cell;
                return ((step as f64 - straight) / most as f64).clamp(0.0, 1.0);
            }
            for [dc, dr] in [[1, 0], [0, 1], [-1, 0], [0, -1]] {
                let p = [p[0] + dc, p[1] + dr];
                let Some(index) = index(p) else { continue };
                let free = state(map, p.map(|x| x as f64 + 0.5)) == Some(CellState::Free);
                if free && !closed(p) && !std::mem::replace(&mut seen[index], true) {
                    next.push(p);
                }
            }
        }
        ring = next;
    }
    1.0
}

/// What is at a place in grid coordinates [cells]; `None` outside of the map.
pub(super) fn state(map: &OccupancyMap, [col, row]: [f64; 2]) -> Option<CellState> {
    let point = map.frame().map_from_grid(GridPoint { col, row });
    map.frame().cell_at(point).map(|cell| map.state(cell))
}
