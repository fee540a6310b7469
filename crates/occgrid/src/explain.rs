//! Why a cell is what it is: the readings that made it so, and how much each gave.

use crate::{Cell, GridError, OccupancyGrid, Pose2, Reading, Shot, SonarModel};

/// Where a cell lies in the beam of a shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Relation {
    /// Nearer than the echo: the pulse passed it.
    InFront,
    /// At the distance of the echo, within one sigma or half a cell, whichever is more.
    AtEcho,
    /// Farther than the echo.
    Beyond,
    /// The sonar heard nothing from here.
    InSilence,
}

/// What one shot gave to one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contribution {
    /// Index of the shot in the log that was given.
    pub shot: usize,
    /// Evidence, above 0 for occupied [log-odds].
    pub log_odds: f32,
    /// Distance from the sonar to the centre of the cell [m].
    pub range: f64,
    /// Direction of the cell's centre from the axis of the beam, counter-clockwise, -pi..pi [rad].
    pub offset: f64,
    /// Where in the beam the cell lies.
    pub relation: Relation,
}

/// The shots that touched a cell of a map built from `shots` by [`OccupancyGrid::integrate`], strongest
/// evidence first, equal ones in the order of the log. Shots that gave nothing are left out.
///
/// The contributions add up exactly to the cell's log-odds: every increment is a multiple of one quantum.
/// For a map that was saved and loaded this holds where its origin is a multiple of the resolution, up to
/// rounding of the cell's position. Time: linear in the shots, plus one copy of the grid.
///
/// # Errors
/// [`GridError::Model`] and [`GridError::Shot`].
///
/// # Panics
/// If the cell is outside the grid.
pub fn explain(
    grid: &OccupancyGrid,
    model: &SonarModel,
    shots: &[Shot],
    cell: Cell,
) -> Result<Vec<Contribution>, GridError> {
    assert!(
        cell.col < grid.frame().width() && cell.row < grid.frame().height(),
        "cell ({}, {}) outside the grid",
        cell.col,
        cell.row
    );
    // An update that is no evidence prepares the grid's tables for this model, once for all shots.
    let mut prepared = grid.clone();
    prepared.update(
        model,
        &Shot {
            stamp: 0.0,
            map_from_base: Pose2::default(),
            bearing: 0.0,
            reading: Reading::Fault,
        },
    )?;
    let mut found = Vec::new();
    for (index, shot) in shots.iter().enumerate() {
        let log_odds = prepared.evidence(model, shot, cell)?;
        if log_odds != 0.0 {
            found.push(contribution(&prepared, model, shots, index, cell, log_odds));
        }
    }
    sort_by_strength(&mut found);
    Ok(found)
}

/// Strongest first; equal ones in the order of the log.
pub(crate) fn sort_by_strength(found: &mut [Contribution]) {
    found.sort_by(|a, b| (b.log_odds.abs().total_cmp(&a.log_odds.abs())).then(a.shot.cmp(&b.shot)));
}

/// Places a cell in the beam of one shot of a log.
pub(crate) fn contribution(
    grid: &OccupancyGrid,
    model: &SonarModel,
    shots: &[Shot],
    index: usize,
    cell: Cell,
    log_odds: f32,
) -> Contribution {
    let shot = &shots[index];
    let beam = model.map_from_beam(shot);
    let center = beam.inverse().transform_from(grid.frame().center_of(cell));
    let range = center.x.hypot(center.y);
    let tolerance = model.sigma.max(0.5 * grid.frame().resolution());
    let relation = match shot.reading {
        Reading::Echo { range: echo } if range < echo - tolerance => Relation::InFront,
        Reading::Echo { range: echo } if range > echo + tolerance => Relation::Beyond,
        Reading::Echo { .. } => Relation::AtEcho,
        Reading::NoEcho { .. } | Reading::TooClose | Reading::Fault => Relation::InSilence,
    };
    Contribution {
        shot: index,
        log_odds,
        range,
        offset: center.y.atan2(center.x),
        relation,
    }
}
