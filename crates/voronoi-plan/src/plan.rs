//! From start to goal: certified, complete for the radius, and short.

mod find;

use std::sync::{Mutex, OnceLock, PoisonError};

use occgrid::{GridPoint, MapFrame, Point2};

use crate::access::{Access, center};
use crate::answer::{Bottleneck, GraphRoute, Plan};
use crate::bottleneck::{Narrowest, Saddles};
use crate::clearance::claim;
use crate::lattice::Lattice;
use crate::roadmap::{Roadmap, Scratch};
use crate::route::Route;
use crate::seam::seam;
use crate::window::{Window, WindowScratch};
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

fn grid_of(frame: &MapFrame) -> Window {
    Window::whole((frame.width(), frame.height()))
}
