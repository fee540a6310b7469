//! What others make of the same readings, written from their documented behaviour: the yardsticks of the plain map.

use std::f64::consts::{PI, TAU};

use occgrid::{Cell, MapFrame, OccupancyGrid, Point2, Pose2, Reading, Shot, SonarModel};

/// Probabilities stay inside 1/254 and 253/254, the resolution of Nav2's costs.
const NAV2_LIMIT: f64 = 5.533;

fn echoes(shots: &[Shot]) -> impl Iterator<Item = (Pose2, f64)> + '_ {
    shots.iter().filter_map(|shot| match shot.reading {
        Reading::Echo { range } => {
            let pose = shot.map_from_base;
            Some((Pose2::new(pose.x, pose.y, pose.theta + shot.bearing), range))
        }
        _ => None,
    })
}

fn cells(frame: &MapFrame) -> impl Iterator<Item = (usize, Point2)> + '_ {
    (0..frame.cell_count()).map(|index| {
        let (col, row) = (index as u32 % frame.width(), index as u32 / frame.width());
        (index, frame.center_of(Cell { col, row }))
    })
}

/// Distance and direction of a place in a beam.
fn polar(beam: Pose2, p: Point2) -> (f64, f64) {
    let (dx, dy) = (p.x - beam.x, p.y - beam.y);
    (
        dx.hypot(dy),
        (dy.atan2(dx) - beam.theta + PI).rem_euclid(TAU) - PI,
    )
}

/// Nav2's range sensor layer (nav2_costmap_2d, `RangeSensorLayer`, defaults: phi 1.2, inflate_cone 1): a parabola
/// over the angle times a tanh over the range weighs a model that is low in front and high within `resolution *
/// range` of the echo; the cell at the echo is first set to cost 233.
pub(crate) fn nav2(frame: &MapFrame, shots: &[Shot], beam_width: f64) -> Vec<f32> {
    let mut log_odds = vec![0.0_f64; frame.cell_count()];
    for (beam, d) in echoes(shots) {
        let target = Point2::new(beam.x + d * beam.theta.cos(), beam.y + d * beam.theta.sin());
        if let Some(cell) = frame.cell_at(target) {
            let p: f64 = 233.0 / 254.0;
            log_odds[frame.index(cell)] = (p / (1.0 - p)).ln();
        }
        for (index, center) in cells(frame) {
            let (r, angle) = polar(beam, center);
            let angle = angle / (0.5 * beam_width);
            if angle.abs() > 1.0 {
                continue;
            }
            let weight = (1.0 - angle * angle) * (1.0 - (2.0 * (r - 1.2)).tanh()) / 2.0;
            let depth = frame.resolution() * d;
            let u = (r - d) / depth;
            let p = if u < -2.0 {
                0.5 - 0.5 * weight
            } else if u < -1.0 {
                0.5 - 0.5 * weight + 0.5 * weight * (u + 2.0).powi(2)
            } else if u < 1.0 {
                0.5 + weight * (0.5 - 0.5 * u * u)
            } else {
                0.5
            };
            let p = p.clamp(1e-3, 1.0 - 1e-3);
            let sum = log_odds[index] + (p / (1.0 - p)).ln();
            log_odds[index] = sum.clamp(-NAV2_LIMIT, NAV2_LIMIT);
        }
    }
    log_odds.into_iter().map(|l| l as f32).collect()
}

/// MRPT's cone (mrpt::maps::COccupancyGridMap2D with CObservationRange, default certainty 0.65): the triangle to
/// one cell before the echo is free, the cells of its chord at the echo are occupied with three times the weight.
/// Its code turns the cone by half its opening; here it looks where the sonar looks, which scores better.
pub(crate) fn mrpt(frame: &MapFrame, shots: &[Shot], beam_width: f64) -> Vec<f32> {
    let free = (0.65_f64 / 0.35).ln();
    let limit = 7.0;
    let mut log_odds = vec![0.0_f64; frame.cell_count()];
    for (beam, d) in echoes(shots) {
        let short = d - frame.resolution();
        if short < 0.0 {
            continue;
        }
        let half = 0.5 * beam_width;
        for (index, center) in cells(frame) {
            let (r, angle) = polar(beam, center);
            if angle.abs() <= half && r * angle.cos() <= short * half.cos() {
                log_odds[index] = (log_odds[index] - free).max(-limit);
            }
        }
        let end = |angle: f64| {
            let p = Point2::new(beam.x + d * angle.cos(), beam.y + d * angle.sin());
            frame.grid_from_map(p)
        };
        let (a, b) = (end(beam.theta - half), end(beam.theta + half));
        let (dc, dr) = (b.col.floor() - a.col.floor(), b.row.floor() - a.row.floor());
        let steps = dc.abs().max(dr.abs()) + 1.0;
        let mut chord = Vec::new();
        for k in 0..=steps as u32 {
            let t = f64::from(k) / steps;
            let (col, row) = (
                (a.col.floor() + 0.5 + t * dc) as u32,
                (a.row.floor() + 0.5 + t * dr) as u32,
            );
            if col < frame.width() && row < frame.height() {
                chord.push(frame.index(Cell { col, row }));
            }
        }
        chord.dedup();
        for index in chord {
            log_odds[index] = (log_odds[index] + 3.0 * free).min(limit);
        }
    }
    log_odds.into_iter().map(|l| l as f32).collect()
}

/// The plain map of a model on a given frame.
pub(crate) fn plain(empty: &OccupancyGrid, shots: &[Shot], model: &SonarModel) -> Vec<f32> {
    let mut grid = empty.clone();
    grid.integrate(model, shots).expect("shots are valid");
    if grid.frame() == empty.frame() {
        return grid.into_log_odds();
    }
    let values = cells(empty.frame()).map(|(_, center)| {
        let cell = grid.frame().cell_at(center);
        cell.map_or(0.0, |cell| grid.log_odds()[grid.frame().index(cell)])
    });
    values.collect()
}

/// The paper's own model: sigma 0.2 m, p_min 0.4, p_max 0.9.
pub(crate) fn paper(beam_width: f64) -> SonarModel {
    SonarModel {
        beam_width,
        ..SonarModel::default()
    }
}
