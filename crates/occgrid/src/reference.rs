//! The definition of a sonar update as plain code: every cell of a box, one `atan2`, one `exp`, one `ln` each.
//!
//! The twin of [`OccupancyGrid::update`](crate::OccupancyGrid::update), which gives the same log-odds bit
//! for bit, except where rounding decides: at a distance halfway between two steps of the tabulated range, and
//! in cells of whose square the beam's axis touches no more than a corner.

use std::f64::consts::PI;

use crate::{Cell, GridPoint, MapFrame, Reading, Shot, SonarModel};

/// Increments are multiples of this [log-odds].
const QUANTUM: f64 = 1.0 / 1024.0;

/// What lies exactly on an edge is inside, up to this much (relative, and in radians).
const EDGE: f64 = 1e-9;

/// Steps in which evidence is tabulated over range: from 5 sigma before an echo to 3 behind it, or from the
/// sonar to the range listened to.
const RANGE_STEPS: f64 = 1000.0;

/// Adds the evidence of one shot to the log-odds of a grid that does not grow; what the beam touches outside
/// the frame is dropped.
///
/// # Panics
/// If there is not one value a cell, or the beam is outside the documented range of the model.
pub fn update(frame: &MapFrame, log_odds: &mut [f32], model: &SonarModel, shot: &Shot) {
    assert_eq!(log_odds.len(), frame.cell_count(), "one value a cell");
    assert!(model.validate().is_ok(), "the model must be valid");
    if !model.is_evidence(shot.reading) {
        return;
    }
    let reach = reach(model, shot.reading, frame.resolution());
    let beam = model.map_from_beam(shot);
    let apex = frame.grid_from_map(beam.position());
    let heading = beam.theta - frame.origin().theta;
    let end = GridPoint {
        col: apex.col + reach / frame.resolution() * heading.cos(),
        row: apex.row - reach / frame.resolution() * heading.sin(),
    };
    let (cols, rows) = sector_box(frame, apex, heading, 0.5 * model.beam_width, reach);
    for row in rows.0..rows.1 {
        for col in cols.0..cols.1 {
            let dx = (f64::from(col) + 0.5 - apex.col) * frame.resolution();
            let dy = (apex.row - f64::from(row) - 0.5) * frame.resolution();
            let r = (dx * dx + dy * dy).sqrt();
            let off_axis = wrapped(dy.atan2(dx) - heading).abs();
            let in_cone = off_axis <= 0.5 * model.beam_width + EDGE && r <= reach * (1.0 + EDGE);
            if in_cone || crosses(apex, end, Cell::new(col, row)) {
                let index = frame.index(Cell::new(col, row));
                log_odds[index] += evidence(model, shot.reading, r, frame.resolution());
            }
        }
    }
}

/// Evidence of a reading for a cell of the given size whose centre is at distance `r` from the sonar
/// [log-odds].
fn evidence(model: &SonarModel, reading: Reading, r: f64, resolution: f64) -> f32 {
    if r < model.blanking * (1.0 - EDGE) {
        return 0.0;
    }
    let log_odds = |p: f64| (p / (1.0 - p)).ln();
    let value = match reading {
        Reading::Echo { range } => {
            let margin = margin(model, resolution);
            let front = 5.0 * model.sigma + margin;
            let step = (8.0 * model.sigma + 2.0 * margin) / RANGE_STEPS;
            let k = ((r - range + front) / step + 1e-7)
                .round_ties_even()
                .max(0.0);
            if k > RANGE_STEPS {
                return 0.0;
            }
            let end = 3.0 * model.sigma * (1.0 - 1e-12) + margin;
            let from_echo = (k * step - front).min(end);
            let samples = depth_samples(model, resolution);
            let mut sum = 0.0;
            for s in 0..samples {
                let depth = ((s as f64 + 0.5) / samples as f64 - 0.5) * resolution;
                sum += log_odds(model.occupancy(from_echo + depth, 0.0));
            }
            sum / samples as f64
        }
        Reading::NoEcho { listened } => {
            let listened = listened.min(model.max_range);
            let k = (r / (listened / RANGE_STEPS) + 1e-7).round_ties_even();
            log_odds(model.occupancy_no_echo(k / RANGE_STEPS, 1.0))
        }
        Reading::TooClose | Reading::Fault => 0.0,
    };
    ((value / QUANTUM).round() * QUANTUM) as f32
}

/// Points over a cell's depth at which an echo's evidence is taken: at most half a sigma apart.
fn depth_samples(model: &SonarModel, resolution: f64) -> usize {
    (2.0 * resolution / model.sigma).ceil().clamp(1.0, 64.0) as usize
}

/// By how much a cell's depth widens the band of an echo [m].
fn margin(model: &SonarModel, resolution: f64) -> f64 {
    if depth_samples(model, resolution) > 1 {
        0.5 * resolution
    } else {
        0.0
    }
}

/// How far a reading has anything to say [m].
fn reach(model: &SonarModel, reading: Reading, resolution: f64) -> f64 {
    match reading {
        Reading::Echo { range } => range + 3.0 * model.sigma + margin(model, resolution),
        Reading::NoEcho { listened } => listened.min(model.max_range),
        Reading::TooClose | Reading::Fault => 0.0,
    }
}

/// Columns and rows of the frame around the sector.
fn sector_box(
    frame: &MapFrame,
    apex: GridPoint,
    heading: f64,
    half_width: f64,
    reach: f64,
) -> ((u32, u32), (u32, u32)) {
    let mut corners = vec![apex];
    let quarter_turns = [0.0, 0.5 * PI, PI, 1.5 * PI];
    let extremes = quarter_turns
        .into_iter()
        .filter(|a| wrapped(a - heading).abs() <= half_width);
    for angle in [heading - half_width, heading, heading + half_width]
        .into_iter()
        .chain(extremes)
    {
        corners.push(GridPoint {
            col: apex.col + reach / frame.resolution() * angle.cos(),
            row: apex.row - reach / frame.resolution() * angle.sin(),
        });
    }
    let span = |values: &dyn Fn(&GridPoint) -> f64, side: u32| {
        let from = corners
            .iter()
            .map(values)
            .fold(f64::INFINITY, f64::min)
            .floor();
        let to = corners
            .iter()
            .map(values)
            .fold(f64::NEG_INFINITY, f64::max)
            .floor()
            + 1.0;
        (
            from.clamp(0.0, f64::from(side)) as u32,
            to.clamp(0.0, f64::from(side)) as u32,
        )
    };
    (
        span(&|p| p.col, frame.width()),
        span(&|p| p.row, frame.height()),
    )
}

/// Whether the segment from `a` to `b` meets the square of a cell: what is left of it between the square's
/// four sides.
fn crosses(a: GridPoint, b: GridPoint, cell: Cell) -> bool {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (start, end, low) in [
        (a.col, b.col, f64::from(cell.col)),
        (a.row, b.row, f64::from(cell.row)),
    ] {
        let (low, high) = (low - start, low + 1.0 - start);
        let step = end - start;
        if step == 0.0 {
            if low > 0.0 || high <= 0.0 {
                return false;
            }
        } else {
            from = from.max((low / step).min(high / step));
            to = to.min((low / step).max(high / step));
        }
    }
    from <= to
}

/// An angle in -pi..=pi.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(2.0 * PI) - PI
}
