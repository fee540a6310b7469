//! The definition of a sonar update as plain code: every cell of a box, one `atan2`, one `exp`, one `ln` each.
//!
//! The twin of [`OccupancyGrid::update`](crate::OccupancyGrid::update), which gives the same log-odds bit
//! for bit. What lies on the rim of a beam is decided here for both: see `Beam`.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::{Cell, MapFrame, Reading, Shot, SonarModel};

/// Increments are multiples of this [log-odds].
const QUANTUM: f64 = 1.0 / 1024.0;

/// What lies exactly on an edge is inside, up to this much (relative, and in radians).
const EDGE: f64 = 1e-9;

/// Steps in which evidence is tabulated over range: from 5 sigma before an echo to 3 behind it, or from the
/// sonar to the range listened to.
const RANGE_STEPS: f64 = 1000.0;

/// The sonar's place is taken to 2^-20 of a cell: then the places of cells from it are exact, whatever
/// frame the cells are counted in.
const PLACE_STEPS: f64 = (1_u32 << 20) as f64;

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
    let pose = model.map_from_beam(shot);
    let apex = frame.grid_from_map(pose.position());
    let apex = [
        to_place_step(apex.col),
        to_place_step(f64::from(frame.height()) - apex.row),
    ];
    let heading = pose.theta - frame.origin().theta;
    let beam = Beam::new(heading, model.beam_width, reach / frame.resolution());
    let (cols, rows) = sector_box(frame, apex, &beam);
    for row in rows.0..rows.1 {
        for col in cols.0..cols.1 {
            let left = f64::from(col) - apex[0];
            let bottom = f64::from(frame.height() - 1 - row) - apex[1];
            let (x, y) = (left + 0.5, bottom + 0.5);
            if beam.contains(x, y) || beam.crosses(left, bottom) {
                let index = frame.index(Cell::new(col, row));
                let place = [x as f32, y as f32];
                log_odds[index] += evidence(model, shot.reading, place, frame.resolution());
            }
        }
    }
}

/// The place of a sonar as both updates take it [cells].
pub(crate) fn to_place_step(cells: f64) -> f64 {
    (cells * PLACE_STEPS).round() / PLACE_STEPS
}

/// The sector of one shot, seen from the sonar [cells]: x to the right, y up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Beam {
    /// -pi..=pi [rad]
    pub(crate) heading: f64,
    /// Half the opening angle and a little, less than a right angle [rad].
    pub(crate) half_angle: f64,
    /// Of the axis, of length 1.
    pub(crate) direction: [f64; 2],
    /// Where the axis ends.
    pub(crate) tip: [f64; 2],
    /// The cone's radius and a little.
    pub(crate) radius: f64,
    /// The square of that.
    pub(crate) radius_squared: f64,
}

impl Beam {
    /// A cone of full angle `width` (at most pi) and length `reach` [cells].
    pub(crate) fn new(heading: f64, width: f64, reach: f64) -> Self {
        let heading = if heading.abs() <= PI {
            heading
        } else {
            wrapped(heading)
        };
        let (sin, cos) = heading.sin_cos();
        let radius = reach * (1.0 + EDGE);
        Self {
            heading,
            direction: [cos, sin],
            // half a disc ends before its straight edge, which keeps every cone convex
            half_angle: (0.5 * width + EDGE).min(FRAC_PI_2 - EDGE),
            tip: [reach * cos, reach * sin],
            radius,
            radius_squared: radius * radius,
        }
    }

    /// Whether a point is in the cone.
    pub(crate) fn contains(&self, x: f64, y: f64) -> bool {
        let off_axis = wrapped(y.atan2(x) - self.heading).abs();
        off_axis <= self.half_angle && x * x + y * y <= self.radius_squared
    }

    /// Whether the axis meets the closed square of the cell whose lower left corner is at (left, bottom):
    /// what is left of the axis between the square's four sides.
    pub(crate) fn crosses(&self, left: f64, bottom: f64) -> bool {
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (step, low) in [(self.tip[0], left), (self.tip[1], bottom)] {
            let high = low + 1.0;
            if step == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
            } else {
                from = from.max((low / step).min(high / step));
                to = to.min((low / step).max(high / step));
            }
        }
        from <= to
    }
}

/// Evidence of a reading for a cell of the given size whose centre is at `x`, `y` from the sonar [cells]; as
/// log-odds. Its distance is taken to the 24 bits of an `f32`: 0.3 um at 5 m.
fn evidence(model: &SonarModel, reading: Reading, [x, y]: [f32; 2], resolution: f64) -> f32 {
    let squared = x * x + y * y;
    // a cell at the very blanking distance is not nearer, however the distance is rounded
    let blanking = model.blanking * (1.0 - 1e-6) / resolution;
    if squared < (blanking * blanking) as f32 {
        return 0.0;
    }
    let r = squared.sqrt();
    let log_odds = |p: f64| (p / (1.0 - p)).ln();
    let value = match reading {
        Reading::Echo { range } => {
            let margin = margin(model, resolution);
            let front = 5.0 * model.sigma + margin;
            let step = (front + (3.0 * model.sigma + margin)) / RANGE_STEPS;
            let place = r * (resolution / step) as f32 + ((front - range) / step) as f32;
            let k = f64::from(place.round_ties_even().max(0.0));
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
            let place = r * (resolution / (listened / RANGE_STEPS)) as f32;
            let k = f64::from(place.round_ties_even());
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
        Reading::Echo { range } => range + (3.0 * model.sigma + margin(model, resolution)),
        Reading::NoEcho { listened } => listened.min(model.max_range),
        Reading::TooClose | Reading::Fault => 0.0,
    }
}

/// Columns and rows of the frame around the sector, and a little.
fn sector_box(frame: &MapFrame, apex: [f64; 2], beam: &Beam) -> ((u32, u32), (u32, u32)) {
    let mut corners = vec![[0.0, 0.0], beam.tip];
    let quarter_turns = [0.0, 0.5 * PI, PI, 1.5 * PI];
    let extremes = quarter_turns
        .into_iter()
        .filter(|a| wrapped(a - beam.heading).abs() <= beam.half_angle);
    for angle in [
        beam.heading - beam.half_angle,
        beam.heading + beam.half_angle,
    ]
    .into_iter()
    .chain(extremes)
    {
        corners.push([beam.radius * angle.cos(), beam.radius * angle.sin()]);
    }
    let span = |k: usize, side: u32| {
        let values = || corners.iter().map(|c| c[k]);
        let from = (values().fold(f64::INFINITY, f64::min) + apex[k] - 1e-6).floor();
        let to = (values().fold(f64::NEG_INFINITY, f64::max) + apex[k] + 1e-6).floor() + 1.0;
        (
            from.clamp(0.0, f64::from(side)) as u32,
            to.clamp(0.0, f64::from(side)) as u32,
        )
    };
    let (bottom, top) = span(1, frame.height());
    (
        span(0, frame.width()),
        (frame.height() - top, frame.height() - bottom),
    )
}

/// An angle in -pi..=pi.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(2.0 * PI) - PI
}
