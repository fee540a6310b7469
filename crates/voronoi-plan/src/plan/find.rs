//! The ways that a query looks at, and the shortest of them.

use occgrid::{Cell, GridPoint};

use super::{Memory, Planner, grid_of};
use crate::access::{center, entries};
use crate::bottleneck::{Narrowest, Saddles, widest};
use crate::lattice::Lattice;
use crate::roadmap::{Spot, Way};
use crate::route::{length_of, pull, shorten};
use crate::square::squared_distance;
use crate::window::{self, Limits, STEP_COST, Window};

/// A route this much longer than the straight line at most is not compared with others.
const GOOD_ENOUGH: f64 = 1.03;

/// A route may be this much longer than the shortest before the grid is searched for a better one.
const DETOUR: f64 = 1.25;

/// Cells that a window may have for every cell that may be expanded in it.
const WINDOW_PER_EFFORT: usize = 16;

/// An alternative is shortened to the end only if it is below this much of the best after one pass.
const WORTH_A_LOOK: f64 = 1.02;
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
    /// The shortest line found, with the arcs it came from, or the bottleneck.
    pub(super) fn find(
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

    pub(super) fn arcs_of(&self, way: &Way) -> Vec<usize> {
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
}

fn ends_and_cells(start: &End, cells: &[Cell], goal: &End) -> Vec<GridPoint> {
    let mut line = vec![start.point];
    line.extend(cells.iter().map(|&cell| center(cell)));
    line.push(goal.point);
    line.dedup();
    line
}
