//! Frontiers: floor that can be reached and was not looked at from near, and gaps that may be ways on.
//!
//! After B. Yamauchi, "A frontier-based approach for autonomous exploration", IEEE CIRA 1997, where a frontier is
//! free space beside unknown space. A sonar sees walls only from near and square. So floor that was passed by the
//! beam of a far stop still counts as not looked at; and beside unknown space only those places count where nothing
//! known would keep the robot from going on.

use std::collections::VecDeque;

use morpho::{BitImage, Components, Connectivity};
use occgrid::{Cell, MapFrame, Point2};
use voronoi_plan::{ClearanceField, FreeSpace};

use super::reach::Reach;

/// What counts as looked at, and which frontier comes first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontierParams {
    /// Places near things are looked at from stops no farther than this on the way [m].
    pub near: f64,
    /// Open floor is looked at from stops no farther than this [m], at least `near`.
    pub far: f64,
    /// Floor is open with this much room beside the body [m].
    pub open: f64,
    /// Frontiers smaller than this do not matter [m^2].
    pub least_area: f64,
    /// Room beside the body at a stop [m]: nearer to a wall ahead the robot would be stopped on its way there.
    pub room: f64,
    /// How far a way on must lead before it counts [m], up to 1.
    pub depth: f64,
    /// Gaps are looked at from stops that are this far apart at least [m].
    pub apart: f64,
    /// Around a place that could not be reached nothing is asked for again [m].
    pub refused: f64,
    /// How much way a square metre of frontier is worth [m].
    pub worth: f64,
}

impl Default for FrontierParams {
    fn default() -> Self {
        Self {
            near: 0.9,
            far: 1.8,
            open: 1.0,
            least_area: 0.03,
            room: 0.2,
            depth: 0.4,
            apart: 0.3,
            refused: 0.3,
            worth: 0.5,
        }
    }
}

/// A place from which there is something to see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frontier {
    /// Where to stop.
    pub stop: Cell,
    /// The same, map frame.
    pub place: Point2,
    /// Cost of the way there.
    pub cost: f64,
    /// Its size [m^2].
    pub area: f64,
}

/// All frontiers, best first: cheap to reach and large; of equals the first in raster order. `open` is what is not
/// known to be occupied, in the frame of what can be reached.
#[must_use]
pub fn frontiers(
    reach: &Reach,
    open: &FreeSpace,
    stops: &[Point2],
    refused: &[Point2],
    params: &FrontierParams,
) -> Vec<Frontier> {
    let search = Search {
        reach,
        frame: *reach.space().frame(),
        stops,
        refused,
        params,
    };
    let mut found = search.unseen_floor();
    found.extend(search.gaps(open));
    let rank = |f: &Frontier| f.cost - params.worth * f.area.min(4.0);
    found.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    found
}

struct Search<'a> {
    reach: &'a Reach,
    frame: MapFrame,
    stops: &'a [Point2],
    refused: &'a [Point2],
    params: &'a FrontierParams,
}

impl Search<'_> {
    fn size(&self) -> (usize, usize) {
        (self.frame.width() as usize, self.frame.height() as usize)
    }

    fn may_stop(&self, cell: Cell) -> bool {
        self.reach.cost(cell).is_some() && self.reach.margin(cell) >= self.params.room
    }

    fn is_refused(&self, place: Point2) -> bool {
        let near = self.params.refused;
        self.refused.iter().any(|r| r.distance(place) <= near)
    }

    /// Floor farther from every stop than it should be looked at from.
    fn unseen_floor(&self) -> Vec<Frontier> {
        let p = self.params;
        let (width, height) = self.size();
        let way = self.way_from_stops();
        let unseen = BitImage::from_fn(width, height, |x, y| {
            let cell = Cell::new(x as u32, y as u32);
            let least = if self.reach.margin(cell) >= p.open {
                p.far
            } else {
                p.near
            };
            self.may_stop(cell)
                && way[y * width + x] > least
                && !self.is_refused(self.frame.center_of(cell))
        });
        self.cheapest(&unseen)
    }

    /// Places at the edge of what can be reached beyond which the robot would fit, for all that is known.
    fn gaps(&self, open: &FreeSpace) -> Vec<Frontier> {
        let p = self.params;
        let (width, height) = self.size();
        let field = ClearanceField::new(open);
        let radius = self.reach.least_clearance() / self.frame.resolution();
        let beyond = |cell: Cell| field.at(cell) >= radius && self.reach.cost(cell).is_none();
        // from the edge outwards, no deeper than needed
        let most = (p.depth / self.frame.resolution()).ceil() as u32;
        let mut depth = vec![0_u32; self.frame.cell_count()];
        let mut front = VecDeque::new();
        for y in 0..height {
            for x in 0..width {
                let cell = Cell::new(x as u32, y as u32);
                if self.reach.cost(cell).is_some() {
                    front.push_back((cell, 0));
                }
            }
        }
        let mut region = BitImage::new(width, height);
        while let Some((cell, so_far)) = front.pop_front() {
            if so_far == most {
                continue;
            }
            for next in self.beside(cell) {
                let index = self.frame.index(next);
                if depth[index] == 0 && beyond(next) {
                    depth[index] = so_far + 1;
                    region.set(next.col as usize, next.row as usize, true);
                    front.push_back((next, so_far + 1));
                }
            }
        }
        let components = Components::label(&region, Connectivity::Eight);
        let mut deep = vec![false; components.count()];
        for y in 0..height {
            for x in 0..width {
                if depth[y * width + x] == most {
                    let label = components.label_at(x, y) as usize;
                    if let Some(slot) = deep.get_mut(label.wrapping_sub(1)) {
                        *slot = true;
                    }
                }
            }
        }
        let edge = BitImage::from_fn(width, height, |x, y| {
            let cell = Cell::new(x as u32, y as u32);
            let place = self.frame.center_of(cell);
            self.may_stop(cell)
                && self.around(cell).any(|next| {
                    let label = components.label_at(next.col as usize, next.row as usize) as usize;
                    deep.get(label.wrapping_sub(1)).copied().unwrap_or(false)
                })
                && self.stops.iter().all(|s| s.distance(place) > p.apart)
                && !self.is_refused(place)
        });
        self.middles(&edge)
    }

    /// The cheapest cell of every component that is large enough.
    fn cheapest(&self, image: &BitImage) -> Vec<Frontier> {
        let (width, height) = self.size();
        let components = Components::label(image, Connectivity::Eight);
        let mut best: Vec<Option<(f64, Cell)>> = vec![None; components.count()];
        for y in 0..height {
            for x in 0..width {
                let label = components.label_at(x, y) as usize;
                let cell = Cell::new(x as u32, y as u32);
                let (Some(slot), Some(cost)) =
                    (best.get_mut(label.wrapping_sub(1)), self.reach.cost(cell))
                else {
                    continue;
                };
                if slot.is_none_or(|(least, _)| cost < least) {
                    *slot = Some((cost, cell));
                }
            }
        }
        let cell_area = self.frame.resolution() * self.frame.resolution();
        let all = components.as_slice().iter().zip(best);
        all.filter_map(|(component, best)| {
            let area = component.area as f64 * cell_area;
            let (cost, stop) = best?;
            (area >= self.params.least_area).then(|| self.frontier(stop, cost, area))
        })
        .collect()
    }

    /// The cell of every component that is nearest to its middle.
    fn middles(&self, image: &BitImage) -> Vec<Frontier> {
        let (width, height) = self.size();
        let components = Components::label(image, Connectivity::Eight);
        let mut sums = vec![(0.0, 0.0, 0.0_f64); components.count()];
        let mut cells: Vec<Vec<Cell>> = vec![Vec::new(); components.count()];
        for y in 0..height {
            for x in 0..width {
                let label = components.label_at(x, y) as usize;
                if let Some(sum) = sums.get_mut(label.wrapping_sub(1)) {
                    *sum = (sum.0 + x as f64, sum.1 + y as f64, sum.2 + 1.0);
                    cells[label - 1].push(Cell::new(x as u32, y as u32));
                }
            }
        }
        let nearest = sums
            .into_iter()
            .zip(cells)
            .filter_map(|((x, y, n), cells)| {
                let off =
                    |cell: &Cell| (f64::from(cell.col) - x / n).hypot(f64::from(cell.row) - y / n);
                let stop = cells
                    .iter()
                    .copied()
                    .min_by(|a, b| off(a).total_cmp(&off(b)))?;
                let area = n * self.frame.resolution() * self.params.depth;
                let wide = n * self.frame.resolution() >= 0.1;
                wide.then(|| self.frontier(stop, self.reach.cost(stop).unwrap_or(0.0), area))
            });
        nearest.collect()
    }

    fn frontier(&self, stop: Cell, cost: f64, area: f64) -> Frontier {
        Frontier {
            stop,
            place: self.frame.center_of(stop),
            cost,
            area,
        }
    }

    /// Way over free cells from the nearest stop [m], up to `far`; infinite beyond.
    fn way_from_stops(&self) -> Vec<f64> {
        let mut way = vec![f64::INFINITY; self.frame.cell_count()];
        let mut front = VecDeque::new();
        for cell in self
            .stops
            .iter()
            .filter_map(|&stop| self.frame.cell_at(stop))
        {
            way[self.frame.index(cell)] = 0.0;
            front.push_back(cell);
        }
        // label correcting: a first-in first-out front needs few corrections on a grid
        while let Some(cell) = front.pop_front() {
            let so_far = way[self.frame.index(cell)];
            for next in self.beside(cell) {
                if !self
                    .reach
                    .space()
                    .cells()
                    .get(next.col as usize, next.row as usize)
                {
                    continue;
                }
                let straight = next.col == cell.col || next.row == cell.row;
                let step = if straight {
                    1.0
                } else {
                    std::f64::consts::SQRT_2
                };
                let long = so_far + step * self.frame.resolution();
                let index = self.frame.index(next);
                if long <= self.params.far && long < way[index] - 1e-9 {
                    way[index] = long;
                    front.push_back(next);
                }
            }
        }
        way
    }

    /// The cells at the distance by which stops lie back from the edge of what can be reached.
    fn around(&self, cell: Cell) -> impl Iterator<Item = Cell> + use<> {
        let back = self.params.room + self.frame.resolution();
        let span = (back / self.frame.resolution()).ceil() as i32;
        let (width, height) = (self.frame.width(), self.frame.height());
        (-span..=span).flat_map(move |dy| {
            (-span..=span).filter_map(move |dx| {
                let col = cell.col.checked_add_signed(dx).filter(|&c| c < width)?;
                let row = cell.row.checked_add_signed(dy).filter(|&r| r < height)?;
                (dx * dx + dy * dy <= span * span).then(|| Cell::new(col, row))
            })
        })
    }

    fn beside(&self, cell: Cell) -> impl Iterator<Item = Cell> + use<> {
        let (width, height) = (self.frame.width(), self.frame.height());
        STEPS.into_iter().filter_map(move |(dx, dy)| {
            let col = cell.col.checked_add_signed(dx).filter(|&c| c < width)?;
            let row = cell.row.checked_add_signed(dy).filter(|&r| r < height)?;
            Some(Cell::new(col, row))
        })
    }
}

/// Neighbours, those that share a side first.
const STEPS: [(i32, i32); 8] = [
    (1, 0),
    (0, 1),
    (-1, 0),
    (0, -1),
    (1, 1),
    (-1, 1),
    (-1, -1),
    (1, -1),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nav::ReachParams;
    use occgrid::Pose2;

    /// A corridor 6 m long and 1.6 m wide from the origin, unknown at its right end; with a doorway of 0.9 m in its
    /// upper wall at x = 3, behind which all is unknown. Walls are occupied.
    fn corridor(doorway: bool) -> (FreeSpace, FreeSpace) {
        let frame = MapFrame::new(160, 80, 0.05, Pose2::new(-0.5, -0.5, 0.0)).expect("a frame");
        let free = |x: usize, y: usize| (10..130).contains(&x) && (38..70).contains(&y);
        let door = |x: usize, y: usize| doorway && (61..79).contains(&x) && y < 38;
        let open =
            |x: usize, y: usize| free(x, y) || door(x, y) || (x >= 130 && (38..70).contains(&y));
        (
            FreeSpace::new(frame, BitImage::from_fn(160, 80, free)),
            FreeSpace::new(frame, BitImage::from_fn(160, 80, open)),
        )
    }

    fn found(doorway: bool, stops: &[Point2], refused: &[Point2]) -> Vec<Frontier> {
        let (free, open) = corridor(doorway);
        let reach = Reach::from(free, Point2::new(1.0, 0.8), ReachParams::default());
        frontiers(&reach, &open, stops, refused, &FrontierParams::default())
    }

    fn every(step: f64, to: f64) -> Vec<Point2> {
        let count = (to / step) as u32;
        (0..=count)
            .map(|k| Point2::new(0.5 + f64::from(k) * step, 0.8))
            .collect()
    }

    #[test]
    fn floor_that_no_stop_has_seen_from_near_comes_first_where_it_is_near() {
        let all = found(false, &[Point2::new(1.0, 0.8)], &[]);
        let first = all.first().expect("a frontier");
        assert!(
            (first.place.x - 1.0).abs() > 0.85 && first.place.x < 2.3,
            "{all:?}"
        );
        assert!(
            all.is_sorted_by(
                |a, b| a.cost - 0.5 * a.area.min(4.0) <= b.cost - 0.5 * b.area.min(4.0)
            )
        );
    }

    #[test]
    fn an_end_and_a_doorway_are_gaps_until_looked_at() {
        let near = |at: Point2| move |f: &Frontier| f.place.distance(at) < 0.6;
        let (end, door) = (Point2::new(5.7, 0.8), Point2::new(3.0, 1.3));
        let mut stops = every(0.8, 4.8);
        let all = found(true, &stops, &[]);
        assert!(
            all.iter().any(near(end)) && all.iter().any(near(door)),
            "{all:?}"
        );
        assert!(!found(false, &stops, &[]).iter().any(near(door)));
        // refused, a place is not asked for again
        let places: Vec<Point2> = all.iter().map(|f| f.place).collect();
        let left = found(true, &stops, &places);
        assert!(
            left.iter()
                .all(|f| places.iter().all(|p| p.distance(f.place) > 0.3))
        );
        // and looking from everywhere leaves nothing
        for _ in 0..60 {
            let Some(next) = found(true, &stops, &[]).first().copied() else {
                break;
            };
            stops.push(next.place);
        }
        assert_eq!(found(true, &stops, &[]), vec![]);
    }

    #[test]
    fn walls_are_no_gaps() {
        // stops so that all floor counts as seen; the end beyond is closed
        let frame = MapFrame::new(80, 60, 0.05, Pose2::new(-0.5, -0.5, 0.0)).expect("a frame");
        let room = BitImage::from_fn(80, 60, |x, y| {
            (10..50).contains(&x) && (10..40).contains(&y)
        });
        let space = FreeSpace::new(frame, room);
        let here = Point2::new(1.0, 1.2);
        let reach = Reach::from(space.clone(), here, ReachParams::default());
        let stops = [here, Point2::new(0.4, 1.2), Point2::new(1.6, 1.2)];
        assert_eq!(
            frontiers(&reach, &space, &stops, &[], &FrontierParams::default()),
            vec![]
        );
    }
}
