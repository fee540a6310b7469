//! Where the robot can go on what it has seen clear, and how.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use occgrid::{Cell, Point2};
use voronoi_plan::{ClearanceField, FreeSpace, Lattice};

/// How ways are weighed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachParams {
    /// Of the body [m].
    pub radius: f64,
    /// Room that the body needs beside it at least [m], 0 or more. Raised: keeps out of narrow doors.
    pub least_margin: f64,
    /// Room beside the body that it likes to have [m]. Ways with less cost up to `narrow_cost` times as much.
    pub liked_margin: f64,
    /// Factor on the cost of the narrowest ways, 1 or more.
    pub narrow_cost: f64,
}

impl Default for ReachParams {
    fn default() -> Self {
        Self {
            radius: 0.175,
            least_margin: 0.05,
            liked_margin: 0.2,
            narrow_cost: 4.0,
        }
    }
}

/// The ways from one place to all others.
#[derive(Debug, Clone)]
pub struct Reach {
    params: ReachParams,
    space: FreeSpace,
    field: ClearanceField,
    /// Cost of the cheapest way [m, narrow places count more]; infinite where there is none.
    cost: Vec<f64>,
    /// Index of the cell before, on the cheapest way.
    before: Vec<u32>,
    /// Where the ways begin.
    start: Point2,
}

const STEPS: [(i64, i64); 8] = [
    (1, 0),
    (1, 1),
    (0, 1),
    (-1, 1),
    (-1, 0),
    (-1, -1),
    (0, -1),
    (1, -1),
];
/// How far from the start its first admissible cell may be [m].
const START_REACH: f64 = 0.3;
const NONE: u32 = u32::MAX;

impl Reach {
    /// All ways from a place over free cells with room for the body. Where the robot stands it may stand: if the
    /// place itself has too little room, ways begin at the nearest cell that has enough and is straight ahead of it.
    #[must_use]
    pub fn from(space: FreeSpace, start: Point2, params: ReachParams) -> Self {
        let field = ClearanceField::new(&space);
        let cells = space.frame().cell_count();
        let mut reach = Self {
            params,
            field,
            cost: vec![f64::INFINITY; cells],
            before: vec![NONE; cells],
            start,
            space,
        };
        reach.search();
        reach
    }

    /// What is free.
    #[must_use]
    pub const fn space(&self) -> &FreeSpace {
        &self.space
    }

    /// Clearance of what is free.
    #[must_use]
    pub const fn field(&self) -> &ClearanceField {
        &self.field
    }

    /// Cost of the cheapest way to a cell, if there is one.
    #[must_use]
    pub fn cost(&self, cell: Cell) -> Option<f64> {
        let cost = self.cost[self.space.frame().index(cell)];
        cost.is_finite().then_some(cost)
    }

    /// Room beside the body at a cell's centre [m]; negative where it does not fit.
    #[must_use]
    pub fn margin(&self, cell: Cell) -> f64 {
        self.field.at(cell) * self.space.frame().resolution() - self.params.radius
    }

    /// The least clearance of ways [m].
    #[must_use]
    pub fn least_clearance(&self) -> f64 {
        self.params.radius + self.params.least_margin
    }

    /// Whether the body fits along a straight line, with this much room beside it [m].
    #[must_use]
    pub fn is_clear(&self, from: Point2, to: Point2, margin: f64) -> bool {
        let frame = self.space.frame();
        let least = (self.params.radius + margin) / frame.resolution();
        self.field
            .segment_is_clear(frame.grid_from_map(from), frame.grid_from_map(to), least)
    }

    /// The way to a cell as a line of few corners: straight pieces that keep the room that the cells of the way
    /// have, first the start. `None` where there is no way.
    #[must_use]
    pub fn way_to(&self, cell: Cell) -> Option<Vec<Point2>> {
        self.cost(cell)?;
        let frame = self.space.frame();
        let width = frame.width();
        let mut cells = vec![cell];
        let mut at = frame.index(cell);
        while self.before[at] != NONE {
            at = self.before[at] as usize;
            cells.push(Cell::new(at as u32 % width, at as u32 / width));
        }
        cells.reverse();
        let mut points = vec![self.start];
        points.extend(cells.iter().map(|&cell| frame.center_of(cell)));
        Some(self.straightened(&points))
    }

    fn straightened(&self, points: &[Point2]) -> Vec<Point2> {
        let frame = self.space.frame();
        let room = |p: Point2| {
            let cell = frame.cell_at(p);
            cell.map_or(0.0, |cell| self.margin(cell))
        };
        let mut line = vec![points[0]];
        let mut from = 0;
        while from + 1 < points.len() {
            let mut to = from + 1;
            let mut least = room(points[from]).min(room(points[to]));
            // as far as the straight line has no less room than the way had, or as is liked
            for next in from + 2..points.len() {
                least = least.min(room(points[next]));
                let needed = least
                    .min(self.params.liked_margin)
                    .max(self.params.least_margin);
                if self.is_clear(points[from], points[next], needed) {
                    to = next;
                }
            }
            line.push(points[to]);
            from = to;
        }
        line
    }

    fn search(&mut self) {
        let frame = *self.space.frame();
        let resolution = frame.resolution();
        let least = (self.params.radius + self.params.least_margin) / resolution;
        let lattice = Lattice::new(self.space.cells(), &self.field, least);
        let Some(first) = self.first(&lattice) else {
            return;
        };
        let (width, height) = (i64::from(frame.width()), i64::from(frame.height()));
        let mut front = BinaryHeap::new();
        let index = frame.index(first);
        self.cost[index] = self.start.distance(frame.center_of(first));
        front.push((Reverse(Cost(self.cost[index])), index as u32));
        while let Some((Reverse(Cost(cost)), index)) = front.pop() {
            if cost > self.cost[index as usize] {
                continue;
            }
            let cell = Cell::new(index % frame.width(), index / frame.width());
            for (dx, dy) in STEPS {
                let (x, y) = (i64::from(cell.col) + dx, i64::from(cell.row) + dy);
                if x < 0 || y < 0 || x >= width || y >= height {
                    continue;
                }
                let next = Cell::new(x as u32, y as u32);
                if !lattice.links(cell, next) {
                    continue;
                }
                let long = if dx != 0 && dy != 0 {
                    std::f64::consts::SQRT_2
                } else {
                    1.0
                };
                let step = long * resolution * self.price(self.margin(next));
                let (to, cost) = (frame.index(next), cost + step);
                if cost < self.cost[to] {
                    self.cost[to] = cost;
                    self.before[to] = index;
                    front.push((Reverse(Cost(cost)), to as u32));
                }
            }
        }
    }

    fn price(&self, margin: f64) -> f64 {
        let p = &self.params;
        let short = (1.0 - margin / p.liked_margin.max(1e-9)).clamp(0.0, 1.0);
        1.0 + (p.narrow_cost - 1.0) * short * short
    }

    /// The cell where ways begin.
    fn first(&self, lattice: &Lattice<'_>) -> Option<Cell> {
        let frame = self.space.frame();
        let here = frame.cell_at(self.start)?;
        let span = (START_REACH / frame.resolution()).ceil() as i64;
        let mut best: Option<(f64, Cell)> = None;
        for dy in -span..=span {
            for dx in -span..=span {
                let (x, y) = (i64::from(here.col) + dx, i64::from(here.row) + dy);
                if x < 0 || y < 0 || x >= i64::from(frame.width()) || y >= i64::from(frame.height())
                {
                    continue;
                }
                let cell = Cell::new(x as u32, y as u32);
                let away = frame.center_of(cell).distance(self.start);
                if away > START_REACH || !lattice.has(cell) || best.is_some_and(|b| b.0 <= away) {
                    continue;
                }
                // over free cells at least
                let line = [self.start, frame.center_of(cell)].map(|p| frame.grid_from_map(p));
                if self.field.segment_is_clear(line[0], line[1], 0.0) {
                    best = Some((away, cell));
                }
            }
        }
        best.map(|b| b.1)
    }
}

/// A finite cost, ordered.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cost(f64);

impl Eq for Cost {}

impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cost {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use morpho::BitImage;
    use occgrid::{MapFrame, Pose2};

    /// Two rooms of 2 m with a doorway between them, free elsewhere not at all.
    fn rooms(doorway_cells: usize) -> FreeSpace {
        let frame = MapFrame::new(100, 50, 0.05, Pose2::default()).expect("a frame");
        let from = 25 - doorway_cells / 2;
        let cells = BitImage::from_fn(100, 50, |x, y| {
            let room = (5..45).contains(&x) || (55..95).contains(&x);
            let door = (45..55).contains(&x) && (from..from + doorway_cells).contains(&y);
            (room && (5..45).contains(&y)) || door
        });
        FreeSpace::new(frame, cells)
    }

    #[test]
    fn ways_keep_their_room_and_lead_through_doors_that_are_wide_enough() {
        let params = ReachParams::default();
        let (here, there) = (Point2::new(1.0, 0.6), Point2::new(4.0, 2.0));
        for (doorway, passes) in [(10, true), (9, true), (8, false), (4, false)] {
            let reach = Reach::from(rooms(doorway), here, params);
            let cell = reach.space().frame().cell_at(there).expect("inside");
            let way = reach.way_to(cell);
            assert_eq!(way.is_some(), passes, "doorway of {doorway} cells");
            let Some(way) = way else { continue };
            assert!(way.len() < 12, "{way:?}");
            assert!(way[0].distance(here) < 1e-9);
            assert!(way[way.len() - 1].distance(there) < 0.05);
            for piece in way.windows(2) {
                let least = params.least_margin - 1e-6;
                assert!(reach.is_clear(piece[0], piece[1], least), "{piece:?}");
            }
            let straight = here.distance(there);
            assert!(reach.cost(cell).expect("a cost") > straight);
        }
    }

    #[test]
    fn a_robot_that_stands_too_near_to_a_wall_gets_away_from_it() {
        let reach = Reach::from(rooms(10), Point2::new(0.36, 1.0), ReachParams::default());
        let cell = reach
            .space()
            .frame()
            .cell_at(Point2::new(1.5, 1.0))
            .expect("inside");
        assert!(reach.cost(cell).is_some());
        let outside = Reach::from(rooms(10), Point2::new(9.0, 9.0), ReachParams::default());
        assert!(outside.cost(cell).is_none());
    }
}
