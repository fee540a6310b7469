//! How well a map fits a world that is known: log-loss, and what is called free.
//!
//! Cells are those of the map. A cell is *wall* if a wall crosses it (walls sampled every 0.2 mm, a cell holds its
//! lower and left edges), else *free* if its centre is inside the outline. Only cells that the log can know about
//! count: in the line of sight of a stop (a wall cell: with one cell to spare), and inside the cone (half angle
//! 0.24 rad) of one of that stop's echoes, no more than 5 cm behind it. The set depends on the densest log of a
//! world, not on the map, so that all maps are scored on the same cells.
//!
//! Log-loss: mean of -ln p(truth), p clamped to 0.001..0.999, over all these cells. A cell is *called free* if
//! p < 0.5. `at_75` and `at_80` are the shares of wall cells below the threshold that recalls 75 % and 80 % of the
//! free ones, whatever the map's own threshold.

use std::f64::consts::{PI, TAU};

use occgrid::{Cell, MapFrame, OccupancyGrid, Point2, Reading, Shot};

use crate::sonar_world::World;

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Truth {
    Wall,
    Free,
    /// Outside, or nothing that the log can know.
    Ignored,
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Score {
    pub(crate) log_loss: f64,
    /// Share of the free cells that are called free.
    pub(crate) recall: f64,
    /// Share of the wall cells that are called free.
    pub(crate) wall_free: f64,
    pub(crate) at_75: f64,
    pub(crate) at_80: f64,
}

/// The truth on a frame, for the cells that `shots` can know about.
pub(crate) fn truth(world: &World, frame: &MapFrame, shots: &[Shot]) -> Vec<Truth> {
    let mut truth = vec![Truth::Ignored; frame.cell_count()];
    let cells =
        (0..frame.height()).flat_map(|row| (0..frame.width()).map(move |col| Cell { col, row }));
    for cell in cells.clone() {
        if world.is_inside(frame.center_of(cell)) {
            truth[frame.index(cell)] = Truth::Free;
        }
    }
    for [a, b] in &world.walls {
        let steps = (a.distance(*b) / 2e-4).ceil();
        for k in 0..=steps as u32 {
            let t = f64::from(k) / steps;
            let p = Point2::new(a.x + t * (b.x - a.x) + 1e-9, a.y + t * (b.y - a.y) + 1e-9);
            if let Some(cell) = frame.cell_at(p) {
                truth[frame.index(cell)] = Truth::Wall;
            }
        }
    }
    for cell in cells {
        let index = frame.index(cell);
        let spare = match truth[index] {
            Truth::Wall => frame.resolution(),
            Truth::Free => 0.0,
            Truth::Ignored => continue,
        };
        let center = frame.center_of(cell);
        let in_sight = world.stops.iter().any(|&stop| {
            let (dx, dy) = (center.x - stop.x, center.y - stop.y);
            let (range, direction) = (dx.hypot(dy), dy.atan2(dx));
            world.cast(stop, direction).0 >= range - spare
                && is_in_a_cone(shots, stop, range, direction)
        });
        if !in_sight {
            truth[index] = Truth::Ignored;
        }
    }
    truth
}

fn is_in_a_cone(shots: &[Shot], stop: Point2, range: f64, direction: f64) -> bool {
    shots.iter().any(|shot| {
        let pose = shot.map_from_base;
        let Reading::Echo { range: echo } = shot.reading else {
            return false;
        };
        if range >= echo + 0.05 || stop.distance(pose.position()) > 1e-9 {
            return false;
        }
        let off = (direction - pose.theta - shot.bearing + PI).rem_euclid(TAU) - PI;
        off.abs() < 0.24
    })
}

/// Scores log-odds in image order.
pub(crate) fn score(log_odds: &[f32], truth: &[Truth]) -> Score {
    let (mut walls, mut free) = (Vec::new(), Vec::new());
    for (&l, truth) in log_odds.iter().zip(truth) {
        match truth {
            Truth::Wall => walls.push(f64::from(l)),
            Truth::Free => free.push(f64::from(l)),
            Truth::Ignored => {}
        }
    }
    free.sort_by(f64::total_cmp);
    let loss = |l: f64| -(1.0 / (1.0 + (-l).exp())).clamp(1e-3, 1.0 - 1e-3).ln();
    let sum =
        walls.iter().map(|&l| loss(l)).sum::<f64>() + free.iter().map(|&l| loss(-l)).sum::<f64>();
    let share = |cells: &[f64], test: &dyn Fn(f64) -> bool| {
        cells.iter().filter(|&&l| test(l)).count() as f64 / cells.len() as f64
    };
    let at = |recall: f64| {
        let threshold = free[((free.len() as f64 * recall) as usize).min(free.len() - 1)];
        share(&walls, &|l| l <= threshold)
    };
    Score {
        log_loss: sum / (walls.len() + free.len()) as f64,
        recall: share(&free, &|l| l < 0.0),
        wall_free: share(&walls, &|l| l < 0.0),
        at_75: at(0.75),
        at_80: at(0.80),
    }
}

/// An empty grid that covers a world with a metre to spare, on the lattice of multiples of the resolution.
pub(crate) fn empty_around(world: &World, resolution: f64) -> OccupancyGrid {
    let span = |values: &dyn Fn(&Point2) -> f64| {
        let all = world.walls.iter().flatten().map(values);
        let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
            (a.min(v), b.max(v))
        });
        (
            ((low - 1.0) / resolution).floor(),
            ((high + 1.0) / resolution).ceil(),
        )
    };
    let (x, y) = (span(&|p| p.x), span(&|p| p.y));
    let origin = occgrid::Pose2::new(x.0 * resolution, y.0 * resolution, 0.0);
    let frame =
        MapFrame::new((x.1 - x.0) as u32, (y.1 - y.0) as u32, resolution, origin).expect("frame");
    let cells = frame.cell_count();
    OccupancyGrid::from_log_odds(frame, vec![0.0; cells]).expect("grid")
}

/// The mean of scores, field by field.
pub(crate) fn mean(scores: &[Score]) -> Score {
    let n = scores.len() as f64;
    let of = |field: fn(&Score) -> f64| scores.iter().map(field).sum::<f64>() / n;
    Score {
        log_loss: of(|s| s.log_loss),
        recall: of(|s| s.recall),
        wall_free: of(|s| s.wall_free),
        at_75: of(|s| s.at_75),
        at_80: of(|s| s.at_80),
    }
}
