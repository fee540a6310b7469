//! From start to goal: certified, complete for the radius, and short.

use std::sync::{Mutex, OnceLock, PoisonError};

use occgrid::{Cell, GridPoint, MapFrame, Point2};

use crate::access::{Access, center, entries};
use crate::answer::{Bottleneck, GraphRoute, Plan};
use crate::bottleneck::{Narrowest, Saddles, widest};
use crate::clearance::claim;
use crate::lattice::Lattice;
use crate::roadmap::{Roadmap, Scratch, Spot, Way};
use crate::route::{Route, length_of, pull, shorten};
use crate::seam::seam;
use crate::square::squared_distance;
use crate::window::{self, Limits, STEP_COST, Window, WindowScratch};
use crate::{ClearanceField, FreeSpace, TIE_CELLS, VoronoiGraph};

/// How hard to look for a short route.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default))]
pub struct PlanParams {
    /// Routes over the roadmap that are shortened and compared, 1 or more. Raising it costs the same
    /// time again for each. Default 4.
    pub alternatives: usize,
    /// The factor by which the arcs of a route get dearer for the next alternative, above 1. Raising it
    /// makes the alternatives differ more. Default 1.4.
    pub penalty: f32,
    /// Start and goal that lie in a window of at most this many cells are joined by an exact search of
    /// the grid in that window as well [cells]. Default 16384.
    pub window: usize,
    /// Where a route is much longer than the straight line, the grid is searched for one that is shorter
    /// by a fifth, expanding at most this many cells; 0 for never. Raising it costs about 0.1 microseconds
    /// a cell in halls full of obstacles, and makes detours on large maps rarer. Default 500000.
    pub effort: usize,
}

impl Default for PlanParams {
    fn default() -> Self {
        Self {
            alternatives: 4,
            penalty: 1.4,
            window: 16_384,
            effort: 500_000,
        }
    }
}

/// A route this much longer than the straight line at most is not compared with others.
const GOOD_ENOUGH: f64 = 1.03;

/// A route may be this much longer than the shortest before the grid is searched for a better one.
const DETOUR: f64 = 1.25;

/// Cells that a window may have for every cell that may be expanded in it.
const WINDOW_PER_EFFORT: usize = 16;

/// An alternative is shortened to the end only if it is below this much of the best after one pass.
const WORTH_A_LOOK: f64 = 1.02;

/// A roadmap and its map made ready for queries.
///
/// Complete: a route is found whenever start and goal are joined by links between 8-neighbour cells that
/// keep the radius (see [`Lattice`]), even if the roadmap is not.
///
/// 5 bytes and 1 bit a cell, and the roadmap. Answers are a function of the inputs alone.
#[derive(Debug)]
pub struct Planner {
    frame: MapFrame,
    radius: f64,
    min: f64,
    field: ClearanceField,
    road: Roadmap,
    access: Access,
    params: PlanParams,
    idle: Mutex<Vec<Memory>>,
    /// Made for the first query that has no route.
    saddles: OnceLock<Saddles>,
}

/// What one query at a time works in.
#[derive(Debug, Default)]
struct Memory {
    road: Scratch,
    window: WindowScratch,
}

/// One end of a query.
struct End {
    point: GridPoint,
    entries: Vec<Cell>,
}

impl End {
    /// The cells to start from: the entries, or else the cell that holds the point.
    fn cells(&self) -> Vec<Cell> {
        if self.entries.is_empty() {
            vec![Cell::new(self.point.col as u32, self.point.row as u32)]
        } else {
            self.entries.clone()
        }
    }
}

impl Planner {
    /// A planner for the graph's radius, with [`PlanParams::default`]. Arcs that do not keep the radius
    /// from what is not free in `space` are not used. Linear in the cells of the map.
    ///
    /// # Panics
    /// If the field is not of the size of the space.
    #[must_use]
    pub fn new(space: &FreeSpace, graph: &VoronoiGraph, field: ClearanceField) -> Self {
        Self::with_params(space, graph, field, PlanParams::default())
    }

    /// As [`Self::new`], with parameters.
    ///
    /// # Panics
    /// If the field is not of the size of the space.
    #[must_use]
    pub fn with_params(
        space: &FreeSpace,
        graph: &VoronoiGraph,
        field: ClearanceField,
        params: PlanParams,
    ) -> Self {
        let frame = *space.frame();
        let min = graph.radius / frame.resolution();
        let road = Roadmap::new(graph, &frame, &field, min);
        let lattice = Lattice::new(field.free_cells(), &field, min);
        let access = Access::new(&lattice, &road, grid_of(&frame));
        Self {
            frame,
            radius: graph.radius,
            min,
            road,
            access,
            field,
            params,
            idle: Mutex::default(),
            saddles: OnceLock::new(),
        }
    }

    /// Radius of the robot [m].
    #[must_use]
    pub const fn radius(&self) -> f64 {
        self.radius
    }

    /// The clearance of the map.
    #[must_use]
    pub const fn field(&self) -> &ClearanceField {
        &self.field
    }

    /// A certified route between two points of the map frame, or why there is none.
    #[must_use]
    pub fn plan(&self, from: Point2, to: Point2) -> Plan {
        if self.frame.cell_at(from).is_none() || self.frame.cell_at(to).is_none() {
            return Plan::Outside;
        }
        let [start, goal] = [from, to].map(|p| self.frame.grid_from_map(p));
        let metres = self.frame.resolution();
        let clearance = self.field.of_point(start);
        if !self.fits(clearance) {
            return Plan::StartBlocked {
                clearance: claim(clearance * metres, self.radius),
            };
        }
        let clearance = self.field.of_point(goal);
        if !self.fits(clearance) {
            return Plan::GoalBlocked {
                clearance: claim(clearance * metres, self.radius),
            };
        }
        let mut memory = self.take_memory();
        let found = self.find(start, goal, &mut memory);
        self.idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(memory);
        match found {
            Ok((line, arcs)) => Plan::Ok(self.certified(&line, arcs, (from, to))),
            Err(narrowest) => Plan::NoRoute {
                bottleneck: narrowest.map_or_else(|| self.wall(from, to), |n| self.bottleneck(n)),
            },
        }
    }

    /// The shortest way over the roadmap between two of its nodes; `None` where they are not joined.
    #[must_use]
    pub fn search(&self, from: usize, to: usize) -> Option<GraphRoute> {
        let (from, to) = (self.road.spot_at_node(from)?, self.road.spot_at_node(to)?);
        let mut memory = self.take_memory();
        let way = self.road.search(from, to, &mut memory.road);
        self.idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(memory);
        way.map(|way| GraphRoute {
            arcs: self.arcs_of(&way),
            length: way.length * self.frame.resolution(),
        })
    }

    fn take_memory(&self) -> Memory {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.pop().unwrap_or_default()
    }

    fn lattice(&self, min: f64) -> Lattice<'_> {
        Lattice::new(self.field.free_cells(), &self.field, min)
    }

    fn fits(&self, clearance: f64) -> bool {
        clearance > 0.0 && clearance >= self.min - TIE_CELLS
    }

    /// The clearance to which new pieces of a route are held: the radius, with no more tolerance than
    /// rounding needs where a passage is exactly as wide as the robot.
    fn strict(&self) -> f64 {
        self.min + TIE_CELLS - 1e-12
    }

    /// The shortest line found, with the arcs it came from, or the bottleneck.
    fn find(
        &self,
        start: GridPoint,
        goal: GridPoint,
        memory: &mut Memory,
    ) -> Result<(Vec<GridPoint>, Vec<usize>), Option<Narrowest>> {
        if self.field.segment_is_clear(start, goal, self.strict()) {
            return Ok((vec![start, goal], Vec::new()));
        }
        let lattice = self.lattice(self.min);
        let [start, goal] = [start, goal].map(|point| End {
            point,
            entries: entries(&lattice, &self.field, point, self.min),
        });
        let near = self.near(&lattice, &start, &goal, memory);
        let far = self.over_the_roadmap(
            &start,
            &goal,
            near.as_ref().map(|line| length_of(line)),
            memory,
        );
        let best = match (near, far) {
            (_, Some(found)) => found,
            (Some(near), None) => (near, Vec::new()),
            (None, None) => return self.last_resort(&lattice, &start, &goal, memory),
        };
        Ok(
            match self.without_detour(&lattice, &start, &goal, length_of(&best.0), memory) {
                Some(line) => (line, Vec::new()),
                None => best,
            },
        )
    }

    /// A way on the grid that is shorter than `length` by more than the detour allowed, if the straight
    /// line leaves room for one: only cells in the ellipse of such ways are looked at.
    fn without_detour(
        &self,
        lattice: &Lattice<'_>,
        start: &End,
        goal: &End,
        length: f64,
        memory: &mut Memory,
    ) -> Option<Vec<GridPoint>> {
        let (&a, &b) = (start.entries.first()?, goal.entries.first()?);
        let wanted = length / DETOUR;
        let squared_width = wanted * wanted - squared_distance(center(a), center(b));
        if squared_width <= 0.0 || self.params.effort == 0 {
            return None;
        }
        let size = (self.frame.width(), self.frame.height());
        let margin = (squared_width.sqrt() / 2.0) as u32 + 2;
        let window = Window::around([a, b].into_iter(), margin, size);
        if window.area() > self.params.effort.saturating_mul(WINDOW_PER_EFFORT) {
            return None;
        }
        let limits = Limits {
            cost: (wanted * f64::from(STEP_COST[0])) as u32,
            cells: self.params.effort,
        };
        let cells = window::search(lattice, window, (a, b), limits, &mut memory.window)?;
        let line = ends_and_cells(start, &cells, goal);
        let line = shorten(&self.field, &line, self.strict());
        (length_of(&line) < length).then_some(line)
    }

    /// The shortest way on the grid in a window around start and goal, if that is small.
    fn near(
        &self,
        lattice: &Lattice<'_>,
        start: &End,
        goal: &End,
        memory: &mut Memory,
    ) -> Option<Vec<GridPoint>> {
        let (&a, &b) = (start.entries.first()?, goal.entries.first()?);
        let margin = 8 + a.col.abs_diff(b.col).max(a.row.abs_diff(b.row)) / 2;
        let size = (self.frame.width(), self.frame.height());
        let window = Window::around([a, b].into_iter(), margin, size);
        if window.area() > self.params.window {
            return None;
        }
        let cells = window::search(lattice, window, (a, b), Limits::NONE, &mut memory.window)?;
        let line = ends_and_cells(start, &cells, goal);
        Some(shorten(&self.field, &line, self.strict()))
    }

    /// The best of several ways over the roadmap, if one is shorter than `bound`.
    fn over_the_roadmap(
        &self,
        start: &End,
        goal: &End,
        bound: Option<f64>,
        memory: &mut Memory,
    ) -> Option<(Vec<GridPoint>, Vec<usize>)> {
        let ((walk_in, from), (walk_out, to)) = self.spots(start, goal)?;
        let mut best: Option<(Vec<GridPoint>, Vec<usize>)> = None;
        let mut least = bound.unwrap_or(f64::INFINITY);
        let mut least_pulled = f64::INFINITY;
        let direct = squared_distance(start.point, goal.point).sqrt();
        let mut seen: Vec<Way> = Vec::new();
        for _ in 0..self.params.alternatives.max(1) {
            let Some(way) = self.road.search(from, to, &mut memory.road) else {
                break;
            };
            memory.road.penalise(&way, self.params.penalty);
            if seen.contains(&way) {
                continue;
            }
            let line = self.line(start, &walk_in, &way, &walk_out, goal);
            let line = pull(&self.field, &line, self.strict());
            let pulled = length_of(&line);
            if pulled < least_pulled * WORTH_A_LOOK {
                least_pulled = least_pulled.min(pulled);
                let line = shorten(&self.field, &line, self.strict());
                let length = length_of(&line);
                if length < least {
                    least = length;
                    best = Some((line, self.arcs_of(&way)));
                }
            }
            seen.push(way);
            if least <= direct * GOOD_ENOUGH {
                break;
            }
        }
        memory.road.forgive();
        best
    }

    /// Where start and goal enter the same component of the roadmap, and the cells on the way there.
    #[expect(clippy::type_complexity, reason = "two of the same pair, used once")]
    fn spots(&self, start: &End, goal: &End) -> Option<((Vec<Cell>, Spot), (Vec<Cell>, Spot))> {
        let outs: Vec<_> = goal
            .entries
            .iter()
            .filter_map(|&cell| self.access.walk(cell))
            .collect();
        start.entries.iter().find_map(|&cell| {
            let walk_in = self.access.walk(cell)?;
            let component = self.road.component(walk_in.1);
            let walk_out = outs
                .iter()
                .find(|out| self.road.component(out.1) == component)?;
            Some((walk_in, walk_out.clone()))
        })
    }

    fn line(
        &self,
        start: &End,
        walk_in: &[Cell],
        way: &Way,
        walk_out: &[Cell],
        goal: &End,
    ) -> Vec<GridPoint> {
        let mut line = vec![start.point];
        line.extend(walk_in.iter().map(|&cell| center(cell)));
        for &leg in &way.legs {
            line.extend(self.road.points(leg));
        }
        line.extend(walk_out.iter().rev().map(|&cell| center(cell)));
        line.push(goal.point);
        line.dedup();
        line
    }

    fn arcs_of(&self, way: &Way) -> Vec<usize> {
        let mut arcs: Vec<usize> = way
            .legs
            .iter()
            .filter(|leg| leg.from != leg.to)
            .filter_map(|&leg| self.road.arc_of(leg))
            .collect();
        arcs.dedup();
        arcs
    }

    /// Start and goal are not joined over the roadmap: are they at all?
    fn last_resort(
        &self,
        lattice: &Lattice<'_>,
        start: &End,
        goal: &End,
        memory: &mut Memory,
    ) -> Result<(Vec<GridPoint>, Vec<usize>), Option<Narrowest>> {
        let grid = grid_of(&self.frame);
        let narrowest = match (self.parts(start), self.parts(goal)) {
            (Some(from), Some(to)) => {
                let saddles = self.saddles(lattice);
                let pairs = from.iter().flat_map(|&a| to.iter().map(move |&b| (a, b)));
                pairs
                    .filter_map(|(a, b)| saddles.between(a, b))
                    .reduce(|a, b| {
                        if b.squared_doubled > a.squared_doubled {
                            b
                        } else {
                            a
                        }
                    })
            }
            _ => widest(&self.lattice(0.0), grid, &start.cells(), &goal.cells()),
        };
        if narrowest.is_none_or(|n| n.squared_doubled < lattice.need()) {
            return Err(narrowest);
        }
        for &a in &start.entries {
            for &b in &goal.entries {
                let found = window::search(lattice, grid, (a, b), Limits::NONE, &mut memory.window);
                if let Some(cells) = found {
                    let line = ends_and_cells(start, &cells, goal);
                    return Ok((shorten(&self.field, &line, self.strict()), Vec::new()));
                }
            }
        }
        Err(narrowest)
    }

    /// The parts of the roadmap that an end may enter; `None` unless there are some and every entry
    /// leads to one.
    fn parts(&self, end: &End) -> Option<Vec<u32>> {
        let part = |&cell: &Cell| Some(self.road.component(self.access.walk(cell)?.1));
        let mut parts = end.entries.iter().map(part).collect::<Option<Vec<u32>>>()?;
        parts.sort_unstable();
        parts.dedup();
        (!parts.is_empty()).then_some(parts)
    }

    fn saddles(&self, lattice: &Lattice<'_>) -> &Saddles {
        self.saddles.get_or_init(|| {
            let spots = self.access.spots().iter();
            let named = spots.map(|&(cell, spot)| (cell, self.road.component(spot)));
            let free = self.lattice(0.0);
            let grid = grid_of(&self.frame);
            Saddles::new(lattice, &free, grid, named, self.road.node_count())
        })
    }

    fn certified(
        &self,
        line: &[GridPoint],
        arcs: Vec<usize>,
        (from, to): (Point2, Point2),
    ) -> Route {
        let mut least = self.field.of_segment(line[0], line[0]);
        for piece in line.windows(2) {
            let found = self.field.of_segment(piece[0], piece[1]);
            if found.clearance < least.clearance {
                least = found;
            }
        }
        let mut points: Vec<Point2> = line.iter().map(|&p| self.frame.map_from_grid(p)).collect();
        let last = points.len() - 1;
        points[0] = from;
        points[last] = to;
        Route {
            length: points.windows(2).map(|p| p[0].distance(p[1])).sum(),
            points,
            clearance: claim(least.clearance * self.frame.resolution(), self.radius),
            bottleneck: self.frame.map_from_grid(least.at),
            nearest_obstacle: self.frame.map_from_grid(least.obstacle),
            arcs,
        }
    }

    /// The bottleneck of places that no way joins: the wall between them where it is thinnest.
    fn wall(&self, from: Point2, to: Point2) -> Bottleneck {
        let [a, b] = [from, to].map(|p| self.frame.cell_at(p));
        let place = match (a, b) {
            (Some(a), Some(b)) => self
                .frame
                .map_from_grid(seam(self.field.free_cells(), a, b)),
            _ => to,
        };
        Bottleneck {
            place,
            width: 0.0,
            needed: 2.0 * self.radius,
        }
    }

    fn bottleneck(&self, narrowest: Narrowest) -> Bottleneck {
        let [a, b] = narrowest.link.map(center);
        let at = self.field.of_segment(a, b).at;
        Bottleneck {
            place: self.frame.map_from_grid(at),
            width: f64::from(narrowest.squared_doubled).sqrt() * self.frame.resolution(),
            needed: 2.0 * self.radius,
        }
    }
}

fn ends_and_cells(start: &End, cells: &[Cell], goal: &End) -> Vec<GridPoint> {
    let mut line = vec![start.point];
    line.extend(cells.iter().map(|&cell| center(cell)));
    line.push(goal.point);
    line.dedup();
    line
}

fn grid_of(frame: &MapFrame) -> Window {
    Window::whole((frame.width(), frame.height()))
}
