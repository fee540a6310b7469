//! The occupancy grid: Bayes updates as sums of log-odds, growing with what the sonar sees (§2.1).

use std::ops::Range;

use thiserror::Error;

use crate::add::{AddShots, BATCH, Prepared, joined};
use crate::evidence::{EvidenceTables, RangeEvidence};
use crate::footprint::{Bounds, Footprint};
use crate::frame::MAX_SIDE_CELLS;
use crate::{Cell, FrameError, MapFrame, Point2, Pose2, Shot, SonarModel, SonarModelError};

/// Log-odds beyond which [`OccupancyGrid::probability`] does not go: p = 0.000045 and 0.999955.
pub const LOG_ODDS_LIMIT: f32 = 10.0;

/// Grids grow by whole blocks of this side [cells].
const BLOCK: i64 = 64;

/// How far a grid may grow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridLimits {
    /// Cells of the whole rectangle, 4 bytes each. Default 2^26: 410 m by 410 m at 0.05 m.
    pub max_cells: usize,
}

impl Default for GridLimits {
    fn default() -> Self {
        Self { max_cells: 1 << 26 }
    }
}

/// Why a grid refused a shot or values.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GridError {
    /// The sonar model is out of range.
    #[error(transparent)]
    Model(#[from] SonarModelError),
    /// The resolution, the origin or the size of the grid is out of range.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A pose, a bearing or a range is not a finite number, or a range is negative.
    #[error("shot at {stamp} s: expected finite numbers and a range of 0 or more")]
    Shot {
        /// Stamp of the shot [s].
        stamp: f64,
    },
    /// The grid would have to grow past its limit.
    #[error(
        "map would grow to {width} x {height} cells, allowed are {max_cells} cells and {MAX_SIDE_CELLS} a side"
    )]
    TooLarge {
        /// [cells]
        width: u64,
        /// [cells]
        height: u64,
        /// [`GridLimits::max_cells`]
        max_cells: usize,
    },
    /// The memory for a larger grid is not there.
    #[error("no memory for a map of {cells} cells")]
    Memory {
        /// [cells]
        cells: usize,
    },
    /// Not one value a cell.
    #[error("expected {expected} log-odds, found {found}")]
    Length {
        /// Cells of the frame.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A value is not finite.
    #[error("log-odds {index} is not a finite number: {found}")]
    Value {
        /// Index in image order.
        index: usize,
        /// The value.
        found: f32,
    },
}

/// An occupancy grid: one `f32` of log-odds a cell, 0 = unknown (p = 0.5), row 0 at the top.
#[derive(Debug, Clone)]
pub struct OccupancyGrid {
    frame: MapFrame,
    log_odds: Vec<f32>,
    limits: GridLimits,
    /// Corner of the lattice on which cells lie; fixed for the life of the grid.
    anchor: Pose2,
    /// What the frame covers on the lattice; `None` before the first evidence.
    covered: Option<Bounds>,
    tables: Option<Box<EvidenceTables>>,
}

impl OccupancyGrid {
    /// An empty grid of cells of `resolution` [m], whose corners lie on multiples of the resolution in the
    /// map frame. Until the first evidence arrives its frame is a single unknown cell at the origin.
    ///
    /// # Errors
    /// [`FrameError::Resolution`]
    pub fn new(resolution: f64) -> Result<Self, FrameError> {
        let anchor = Pose2::default();
        Ok(Self {
            frame: MapFrame::new(1, 1, resolution, anchor)?,
            log_odds: vec![0.0],
            limits: GridLimits::default(),
            anchor,
            covered: None,
            tables: None,
        })
    }

    /// A grid from log-odds in image order (row 0 = top), for instance one that was saved.
    ///
    /// # Errors
    /// [`GridError::Length`] and [`GridError::Value`].
    pub fn from_log_odds(frame: MapFrame, log_odds: Vec<f32>) -> Result<Self, GridError> {
        let (expected, found) = (frame.cell_count(), log_odds.len());
        if expected != found {
            return Err(GridError::Length { expected, found });
        }
        if let Some(index) = log_odds.iter().position(|v| !v.is_finite()) {
            return Err(GridError::Value {
                index,
                found: log_odds[index],
            });
        }
        let covered = Bounds {
            cols: 0..i64::from(frame.width()),
            rows: 0..i64::from(frame.height()),
        };
        Ok(Self {
            frame,
            log_odds,
            limits: GridLimits::default(),
            anchor: frame.origin(),
            covered: Some(covered),
            tables: None,
        })
    }

    /// The same grid with other limits to its growth.
    #[must_use]
    pub fn with_limits(mut self, limits: GridLimits) -> Self {
        self.limits = limits;
        self
    }

    /// Where the cells are. Changes when the grid grows.
    #[must_use]
    pub const fn frame(&self) -> &MapFrame {
        &self.frame
    }

    /// How far the grid may grow.
    #[must_use]
    pub const fn limits(&self) -> GridLimits {
        self.limits
    }

    /// The sums of all evidence in image order, row 0 = top; not clamped.
    #[must_use]
    pub fn log_odds(&self) -> &[f32] {
        &self.log_odds
    }

    /// The sums of all evidence in image order.
    #[must_use]
    pub fn into_log_odds(self) -> Vec<f32> {
        self.log_odds
    }

    /// Probability that a cell is occupied, from the log-odds clamped to [`LOG_ODDS_LIMIT`].
    ///
    /// # Panics
    /// If the cell is outside the grid.
    #[must_use]
    pub fn probability(&self, cell: Cell) -> f32 {
        assert!(
            cell.col < self.frame.width() && cell.row < self.frame.height(),
            "cell ({}, {}) outside the grid",
            cell.col,
            cell.row
        );
        probability(self.log_odds[self.frame.index(cell)])
    }

    /// Adds the evidence of one shot; grows where its beam leaves the grid. Readings that are no evidence
    /// under the model ([`SonarModel::is_evidence`]) change nothing.
    ///
    /// Time is proportional to the cells touched, plus the cells of the grid when it grows.
    ///
    /// # Errors
    /// [`GridError`]; the grid is then unchanged.
    pub fn update(&mut self, model: &SonarModel, shot: &Shot) -> Result<(), GridError> {
        self.integrate(model, std::slice::from_ref(shot))
    }

    /// Adds the evidence of many shots. The result does not depend on their order, bit for bit, as long
    /// as no cell's evidence for or against adds up to more than 16 384 (7 400 echoes at its very place).
    ///
    /// # Errors
    /// The first [`GridError`]; the shots before it have been added.
    pub fn integrate(&mut self, model: &SonarModel, shots: &[Shot]) -> Result<(), GridError> {
        let tables = match self.tables.take() {
            Some(tables) if tables.is_for(model, self.frame.resolution()) => tables,
            _ => Box::new(EvidenceTables::new(model, self.frame.resolution())?),
        };
        let result = self.integrate_with(&tables, model, shots);
        self.tables = Some(tables);
        result
    }

    /// The evidence that one shot gives to one cell [log-odds], whether or not it has been added; 0 for a
    /// cell that it does not touch.
    ///
    /// # Errors
    /// [`GridError::Model`] and [`GridError::Shot`].
    pub fn evidence(&self, model: &SonarModel, shot: &Shot, cell: Cell) -> Result<f32, GridError> {
        let fresh;
        let tables = match &self.tables {
            Some(tables) if tables.is_for(model, self.frame.resolution()) => tables,
            _ => {
                fresh = EvidenceTables::new(model, self.frame.resolution())?;
                &fresh
            }
        };
        check_shot(shot)?;
        let Some(evidence) = tables.of(shot.reading) else {
            return Ok(0.0);
        };
        let covered = self.covered.clone().unwrap_or(Bounds {
            cols: 0..1,
            rows: 0..1,
        });
        let i = covered.cols.start + i64::from(cell.col);
        let j = covered.rows.end - 1 - i64::from(cell.row);
        let footprint = self.footprint(model, shot, &evidence);
        let spans = footprint.row(j);
        let touched = spans.cone.contains(&i) || spans.axis.iter().any(|a| a.contains(&i));
        let [x, y] = footprint.apex();
        Ok(if touched {
            evidence.at(i as f64 + 0.5 - x, j as f64 + 0.5 - y)
        } else {
            0.0
        })
    }

    fn footprint(
        &self,
        model: &SonarModel,
        shot: &Shot,
        evidence: &RangeEvidence<'_>,
    ) -> Footprint {
        let beam = model.map_from_beam(shot);
        Footprint::new(
            self.anchor,
            self.frame.resolution(),
            beam,
            model.beam_width,
            evidence.reach,
        )
    }

    /// In batches of consecutive shots whose rows overlap or touch.
    fn integrate_with(
        &mut self,
        tables: &EvidenceTables,
        model: &SonarModel,
        shots: &[Shot],
    ) -> Result<(), GridError> {
        let mut batch: Vec<Prepared<'_>> = Vec::with_capacity(shots.len().min(BATCH));
        let mut rows = 0..0;
        let mut result = Ok(());
        for shot in shots {
            match self.prepare(tables, model, shot) {
                Ok(Some(next)) => {
                    let all = joined(&rows, &next.bounds.rows).filter(|_| batch.len() < BATCH);
                    if all.is_none() {
                        self.add(&mut batch, rows);
                    }
                    rows = all.unwrap_or_else(|| next.bounds.rows.clone());
                    batch.push(next);
                }
                Ok(None) => {}
                Err(error) => {
                    result = Err(error);
                    break;
                }
            }
        }
        self.add(&mut batch, rows);
        result
    }

    /// Makes room for a shot.
    fn prepare<'a>(
        &mut self,
        tables: &'a EvidenceTables,
        model: &SonarModel,
        shot: &Shot,
    ) -> Result<Option<Prepared<'a>>, GridError> {
        check_shot(shot)?;
        let Some(evidence) = tables.of(shot.reading) else {
            return Ok(None);
        };
        let footprint = self.footprint(model, shot, &evidence);
        let bounds = footprint.bounds().ok_or(GridError::TooLarge {
            width: u64::MAX,
            height: u64::MAX,
            max_cells: self.limits.max_cells,
        })?;
        self.grow(&bounds)?;
        Ok(Some(Prepared::new(evidence, footprint, bounds)))
    }

    /// Adds prepared shots, which lie in `rows`, and forgets them.
    fn add(&mut self, shots: &mut Vec<Prepared<'_>>, rows: Range<i64>) {
        if let Some(covered) = &self.covered {
            let work = AddShots::new(shots, rows, &mut self.log_odds, covered);
            pulp::Arch::new().dispatch(work);
        }
        shots.clear();
    }

    /// Makes the grid cover a rectangle of the lattice, in whole blocks.
    fn grow(&mut self, needed: &Bounds) -> Result<(), GridError> {
        let old = self.covered.clone();
        let new = Bounds {
            cols: extended(old.as_ref().map(|b| &b.cols), &needed.cols),
            rows: extended(old.as_ref().map(|b| &b.rows), &needed.rows),
        };
        if old.as_ref() == Some(&new) {
            return Ok(());
        }
        let width = (new.cols.end - new.cols.start) as u64;
        let height = (new.rows.end - new.rows.start) as u64;
        let side = u64::from(MAX_SIDE_CELLS);
        if width > side || height > side || width * height > self.limits.max_cells as u64 {
            let max_cells = self.limits.max_cells;
            return Err(GridError::TooLarge {
                width,
                height,
                max_cells,
            });
        }
        let resolution = self.frame.resolution();
        let corner = self.anchor.transform_from(Point2::new(
            new.cols.start as f64 * resolution,
            new.rows.start as f64 * resolution,
        ));
        let origin = Pose2::new(corner.x, corner.y, self.anchor.theta);
        let frame = MapFrame::new(width as u32, height as u32, resolution, origin)?;
        let mut log_odds = Vec::new();
        let cells = frame.cell_count();
        log_odds
            .try_reserve_exact(cells)
            .map_err(|_| GridError::Memory { cells })?;
        log_odds.resize(cells, 0.0);
        if let Some(old) = old {
            let left = (old.cols.start - new.cols.start) as usize;
            let top = (new.rows.end - old.rows.end) as usize;
            let old_width = self.frame.width() as usize;
            for (row, values) in self.log_odds.chunks_exact(old_width).enumerate() {
                let at = (top + row) * width as usize + left;
                log_odds[at..at + old_width].copy_from_slice(values);
            }
        }
        self.frame = frame;
        self.log_odds = log_odds;
        self.covered = Some(new);
        Ok(())
    }
}

/// Probability of clamped log-odds.
pub(crate) fn probability(log_odds: f32) -> f32 {
    1.0 / (1.0 + (-log_odds.clamp(-LOG_ODDS_LIMIT, LOG_ODDS_LIMIT)).exp())
}

fn check_shot(shot: &Shot) -> Result<(), GridError> {
    let Pose2 { x, y, theta } = shot.map_from_base;
    let range = match shot.reading {
        crate::Reading::Echo { range } => range,
        crate::Reading::NoEcho { listened } => listened,
        crate::Reading::TooClose | crate::Reading::Fault => 0.0,
    };
    let finite = [x, y, theta, shot.bearing, range]
        .iter()
        .all(|v| v.is_finite());
    (finite && range >= 0.0)
        .then_some(())
        .ok_or(GridError::Shot { stamp: shot.stamp })
}

/// What is covered, extended to what is needed: each side that must move goes to the end of a block, the others
/// stay, so the result does not depend on the order of the needs.
fn extended(covered: Option<&Range<i64>>, needed: &Range<i64>) -> Range<i64> {
    let start = needed.start.div_euclid(BLOCK) * BLOCK;
    let end = (needed.end + BLOCK - 1).div_euclid(BLOCK) * BLOCK;
    match covered {
        Some(covered) => {
            let start = if needed.start < covered.start {
                start
            } else {
                covered.start
            };
            start..if needed.end > covered.end {
                end
            } else {
                covered.end
            }
        }
        None => start..end,
    }
}
