//! How true a map of a simulated building is: measured against the building's exact outline, for the
//! robot that made it.

use std::collections::VecDeque;

use mobot_hw::sim::World;
use morpho::BitImage;
use occgrid::{Cell, CellState, OccupancyMap, Point2, Pose2};
use serde::Serialize;

/// Walls that the robot's body can come this near to count as walls to be found [m].
const NEAR_WALL: f64 = 0.10;
/// A piece of wall is found where an occupied cell's centre is no farther from it than this [m].
const FOUND_WITHIN: f64 = 0.10;
/// Walls are asked for every so often along them [m].
const WALL_STEP: f64 = 0.05;
/// Side of the cells in which the building's floor is searched for what the robot can reach [m].
const FLOOR_STEP: f64 = 0.05;
/// Farthest wall that an occupied cell is compared with [m].
const OFFSET_REACH: f64 = 1.0;

/// The robot for which a map is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JudgedRobot {
    /// Of the round body [m].
    pub radius: f64,
    /// Of the body [m].
    pub height: f64,
}

/// Figures of a map against the building that it shows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MapScore {
    /// Floor on which the robot's centre can be, from its start on [m^2].
    pub reachable_m2: f64,
    /// Share of it that the map knows to be free.
    pub coverage: f64,
    /// Cells that the map calls free, as many as their centres lie on the building's plan or not.
    pub free_cells: usize,
    /// Share of the free cells whose centres are inside something that stands there.
    pub false_free: f64,
    /// Walls that the robot's body can come near to [m].
    pub walls_m: f64,
    /// Share of those walls with an occupied cell beside them.
    pub recall: f64,
    /// Occupied cells.
    pub occupied_cells: usize,
    /// Mean distance of the occupied cells' centres from the nearest wall [m], at most 1 m a cell.
    pub offset_mean_m: f64,
    /// The same, exceeded by one cell in twenty [m].
    pub offset_p95_m: f64,
}

/// A building's floor as the robot knows it: which of it can be reached.
#[derive(Debug, Clone)]
pub struct Floor {
    /// Lower left corner of the searched rectangle, world frame.
    corner: Point2,
    reachable: BitImage,
    outline: Vec<[Point2; 2]>,
}

impl Floor {
    /// Searches the floor from the building's start; `None` where the outline is empty.
    #[must_use]
    pub fn of(world: &World, robot: JudgedRobot) -> Option<Self> {
        let outline = world.floor_outline();
        let xs = || outline.iter().flatten().map(|p| p.x);
        let ys = || outline.iter().flatten().map(|p| p.y);
        let low = Point2::new(
            xs().reduce(f64::min)? - FLOOR_STEP,
            ys().reduce(f64::min)? - FLOOR_STEP,
        );
        let high = Point2::new(xs().reduce(f64::max)?, ys().reduce(f64::max)?);
        let width = ((high.x - low.x) / FLOOR_STEP).ceil() as usize + 1;
        let height = ((high.y - low.y) / FLOOR_STEP).ceil() as usize + 1;
        let at = |x: usize, y: usize| {
            Point2::new(
                low.x + (x as f64 + 0.5) * FLOOR_STEP,
                low.y + (y as f64 + 0.5) * FLOOR_STEP,
            )
        };
        let stands = BitImage::from_fn(width, height, |x, y| {
            world.room_at(at(x, y), robot.radius + 0.01, robot.height) >= robot.radius
        });
        let start = world.start();
        let seed = (
            ((start.x - low.x) / FLOOR_STEP) as usize,
            ((start.y - low.y) / FLOOR_STEP) as usize,
        );
        Some(Self {
            corner: low,
            reachable: connected(&stands, seed),
            outline,
        })
    }

    /// The centres of the cells on which the robot's centre can be, world frame.
    pub fn reachable(&self) -> impl Iterator<Item = Point2> + '_ {
        (0..self.reachable.height()).flat_map(move |y| {
            (0..self.reachable.width())
                .filter(move |&x| self.reachable.get(x, y))
                .map(move |x| self.at(x, y))
        })
    }

    fn at(&self, x: usize, y: usize) -> Point2 {
        Point2::new(
            self.corner.x + (x as f64 + 0.5) * FLOOR_STEP,
            self.corner.y + (y as f64 + 0.5) * FLOOR_STEP,
        )
    }

    /// Whether reachable floor lies within `reach` [m] of a place.
    fn near(&self, place: Point2, reach: f64) -> bool {
        let span = (reach / FLOOR_STEP).ceil() as i64;
        let col = ((place.x - self.corner.x) / FLOOR_STEP).floor() as i64;
        let row = ((place.y - self.corner.y) / FLOOR_STEP).floor() as i64;
        (row - span..=row + span).any(|y| {
            (col - span..=col + span).any(|x| {
                let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
                    return false;
                };
                self.reachable.get(x, y) && self.at(x, y).distance(place) <= reach
            })
        })
    }
}

fn connected(stands: &BitImage, seed: (usize, usize)) -> BitImage {
    let mut reached = BitImage::new(stands.width(), stands.height());
    let mut front = VecDeque::new();
    if stands.get(seed.0, seed.1) {
        reached.set(seed.0, seed.1, true);
        front.push_back(seed);
    }
    while let Some((x, y)) = front.pop_front() {
        let beside = [
            (x.wrapping_sub(1), y),
            (x + 1, y),
            (x, y.wrapping_sub(1)),
            (x, y + 1),
        ];
        for (x, y) in beside {
            if stands.get(x, y) && !reached.get(x, y) {
                reached.set(x, y, true);
                front.push_back((x, y));
            }
        }
    }
    reached
}

impl MapScore {
    /// Judges a map whose frame lies in the building at `world_from_map`.
    #[must_use]
    pub fn of(
        map: &OccupancyMap,
        world_from_map: Pose2,
        world: &World,
        floor: &Floor,
        robot: JudgedRobot,
    ) -> Self {
        let map_from_world = world_from_map.inverse();
        let state = |place: Point2| {
            let cell = map.frame().cell_at(map_from_world.transform_from(place));
            cell.map_or(CellState::Unknown, |cell| map.state(cell))
        };
        let (mut total, mut covered) = (0_usize, 0_usize);
        for place in floor.reachable() {
            total += 1;
            covered += usize::from(state(place) == CellState::Free);
        }
        let cells = Cells::of(map, world_from_map, world, floor, robot);
        let (walls_m, recall) = recall(map, map_from_world, floor, robot);
        Self {
            reachable_m2: total as f64 * FLOOR_STEP * FLOOR_STEP,
            coverage: share(covered, total),
            free_cells: cells.free,
            false_free: share(cells.false_free, cells.free),
            walls_m,
            recall,
            occupied_cells: cells.offsets.len(),
            offset_mean_m: cells.offsets.iter().sum::<f64>() / cells.offsets.len().max(1) as f64,
            offset_p95_m: quantile(cells.offsets, 0.95),
        }
    }
}

/// Cell by cell.
struct Cells {
    free: usize,
    false_free: usize,
    offsets: Vec<f64>,
}

impl Cells {
    fn of(
        map: &OccupancyMap,
        world_from_map: Pose2,
        world: &World,
        floor: &Floor,
        robot: JudgedRobot,
    ) -> Self {
        let frame = map.frame();
        let mut cells = Self {
            free: 0,
            false_free: 0,
            offsets: Vec::new(),
        };
        let all = (0..frame.height())
            .flat_map(|row| (0..frame.width()).map(move |col| Cell::new(col, row)));
        for cell in all {
            let place = world_from_map.transform_from(frame.center_of(cell));
            match map.state(cell) {
                CellState::Free => {
                    cells.free += 1;
                    let inside = world.room_at(place, 1e-3, robot.height) <= 0.0;
                    cells.false_free += usize::from(inside);
                }
                CellState::Occupied => cells.offsets.push(floor.offset(place)),
                CellState::Unknown => {}
            }
        }
        cells
    }
}

impl Floor {
    /// From a place to the nearest outline [m], at most [`OFFSET_REACH`].
    fn offset(&self, place: Point2) -> f64 {
        let nearest = self.outline.iter().map(|&[a, b]| to_segment(place, a, b));
        nearest.fold(OFFSET_REACH, f64::min)
    }
}

/// Length of the walls that the robot can come near to [m], and the share of them found.
fn recall(
    map: &OccupancyMap,
    map_from_world: Pose2,
    floor: &Floor,
    robot: JudgedRobot,
) -> (f64, f64) {
    let (mut asked, mut found) = (0_usize, 0_usize);
    for &[a, b] in &floor.outline {
        let length = a.distance(b);
        let count = (length / WALL_STEP).ceil() as usize;
        for k in 0..count {
            let t = (k as f64 + 0.5) / count as f64;
            let place = Point2::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y));
            if floor.near(place, robot.radius + NEAR_WALL) {
                asked += 1;
                found += usize::from(occupied_near(map, map_from_world.transform_from(place)));
            }
        }
    }
    (asked as f64 * WALL_STEP, share(found, asked))
}

fn occupied_near(map: &OccupancyMap, place: Point2) -> bool {
    let frame = map.frame();
    let at = frame.grid_from_map(place);
    let reach = FOUND_WITHIN / frame.resolution();
    let (width, height) = (i64::from(frame.width()), i64::from(frame.height()));
    let rows = (at.row - reach).floor() as i64..=(at.row + reach).ceil() as i64;
    rows.filter(|row| (0..height).contains(row)).any(|row| {
        let cols = (at.col - reach).floor() as i64..=(at.col + reach).ceil() as i64;
        cols.filter(|col| (0..width).contains(col)).any(|col| {
            let cell = Cell::new(col as u32, row as u32);
            map.state(cell) == CellState::Occupied
                && frame.center_of(cell).distance(place) <= FOUND_WITHIN
        })
    })
}

fn to_segment(p: Point2, a: Point2, b: Point2) -> f64 {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let along = (p.x - a.x) * dx + (p.y - a.y) * dy;
    let t = (along / (dx * dx + dy * dy).max(1e-18)).clamp(0.0, 1.0);
    p.distance(Point2::new(a.x + t * dx, a.y + t * dy))
}

fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}

fn quantile(mut values: Vec<f64>, q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    let at = (q * last as f64).round() as usize;
    values.get(at).copied().unwrap_or(0.0)
}
