//! Refinement of a whole log by a forward model: what map explains all readings at once?
//!
//! Cell-by-cell Bayes lets every cell of an arc be the one that reflected, and counts overlapping beams as
//! independent. The forward model says what a reading means: *something* on its arc reflected, and nothing
//! nearer did, unless the reading is false. After S. Thrun, "Learning occupancy grid maps with forward sensor
//! models", Autonomous Robots 15, 2003 (the causes of a reading as hidden variables, expectation
//! maximization); instead of a single best map we pass messages, so that cells keep probabilities (sum-product
//! with one belief of the others a shot, as for the ray potentials of Ulusoy, Geiger and Black, "Towards
//! probabilistic volumetric reconstruction using ray potentials", 3DV 2015). A sonar answers where a surface
//! stands square to the beam, so the causes are short surfaces tangent to the arc (regions of constant depth:
//! Leonard and Durrant-Whyte, "Directed sonar sensing for mobile robot navigation", 1992).
//!
//! Per pass and shot, from the beliefs of all other shots:
//! 1. which part of the arc reflected (its places least known to be free, near the axis rather than the edge);
//! 2. whether the echo is true (arc not known to be free, nothing known in the way);
//! 3. from both, the evidence for each cell: passed, hit, or nothing.

mod beam;
mod lattice;
mod params;
mod rays;

use thiserror::Error;

use crate::explain::{contribution, sort_by_strength};
use crate::{
    Cell, Contribution, FrameError, GridError, OccupancyGrid, Shot, SonarModel, SonarModelError,
};

use beam::Scratch;
use lattice::Lattice;
pub use params::RefineParams;
use rays::Ray;

/// Strongest belief that one shot may hold about its own arc or about what is in its way [log-odds].
const BELIEF_LIMIT: f64 = 6.0;
/// Beliefs of single cells count up to here when the parts of an arc are compared [log-odds].
const CELL_LIMIT: f32 = 4.0;
/// Share of a shot's last hidden state that stays in the next pass: keeps pairs of shots from swinging.
const DAMPING: f64 = 0.3;
/// Slope at which evidence for free counts, from the doubt up to its full value.
const RAMP: f64 = 50.0;
/// Slope of what is left of doubtful evidence: keeps its order.
const GUESS: f64 = 0.02;
/// Evidence for occupied that counts as doubtful still [log-odds].
const SLIGHT: f64 = 0.1;

/// Why a refinement was refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RefineError {
    /// A parameter is out of range.
    #[error("refinement parameter {key}: expected {low} to {high}, found {found}")]
    Parameter {
        /// Name of the field of [`RefineParams`].
        key: &'static str,
        /// Lowest value allowed.
        low: f64,
        /// Highest value allowed.
        high: f64,
        /// What it was.
        found: f64,
    },
    /// The sonar model is out of range.
    #[error(transparent)]
    Model(#[from] SonarModelError),
    /// The grid or a shot is not usable.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The frame is not usable.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

/// The map that explains a whole log at once, on the frame of the plain one: log-odds, 0 = nothing known.
///
/// The result does not depend on the order of the shots, nor on what `plain` holds: only its frame counts.
/// Readings that are no evidence under the model are left out. Time: at most [`RefineParams::max_visits`]
/// visits of shots to cells, each pass linear in the area of all beams; memory: 24 bytes a cell of the working
/// lattice, whose cells are about 5 cm where the map's are larger, and about 150 bytes a shot.
///
/// ```
/// use occgrid::{OccupancyGrid, Point2, Pose2, Reading, RefineParams, Shot, SonarModel, refine};
///
/// let model = SonarModel { sigma: 0.03, ..SonarModel::default() };
/// let shots = [Shot {
///     stamp: 0.0,
///     map_from_base: Pose2::new(0.0, 0.0, 0.0),
///     bearing: 0.0,
///     reading: Reading::Echo { range: 1.5 },
/// }];
/// let mut plain = OccupancyGrid::new(0.05)?;
/// plain.integrate(&model, &shots)?;
/// let refined = refine(&shots, &model, &plain, &RefineParams::default())?;
/// let passed = refined.frame().cell_at(Point2::new(1.0, 0.0)).ok_or("outside")?;
/// assert!(refined.probability(passed) < 0.2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`RefineError`]
pub fn refine(
    shots: &[Shot],
    model: &SonarModel,
    plain: &OccupancyGrid,
    params: &RefineParams,
) -> Result<OccupancyGrid, RefineError> {
    Refinement::new(shots, model, plain, params).map(Refinement::into_grid)
}

/// A refined map together with what was found out about every shot.
#[derive(Debug, Clone)]
pub struct Refinement {
    grid: OccupancyGrid,
    lattice: Lattice,
    /// Evidence on the fine lattice.
    sums: Vec<f64>,
    model: SonarModel,
    params: RefineParams,
    rays: Vec<Ray>,
    shots: Vec<Shot>,
}

impl Refinement {
    /// Refines a log; see [`refine`].
    ///
    /// # Errors
    /// [`RefineError`]
    pub fn new(
        shots: &[Shot],
        model: &SonarModel,
        plain: &OccupancyGrid,
        params: &RefineParams,
    ) -> Result<Self, RefineError> {
        params.validate()?;
        model.validate()?;
        let frame = *plain.frame();
        let lattice = Lattice::new(&frame, plain.limits())?;
        let fine = lattice.fine;
        let mut rays = rays::prepare(shots, model, params, fine.resolution())?;
        let mut scratch = Scratch::new(fine, model, params);
        let mut sums = vec![0.0_f64; fine.cell_count()];
        for _ in 0..params.iterations {
            let mut next = vec![0.0_f64; sums.len()];
            for ray in &mut rays {
                pass(ray, &mut scratch, &sums, &mut next, params);
            }
            sums = next;
        }
        let cells = (0..frame.height())
            .flat_map(|row| (0..frame.width()).map(move |col| Cell { col, row }));
        let log_odds = cells
            .map(|cell| finish(lattice.evidence(&sums, cell), params))
            .collect();
        let grid = OccupancyGrid::from_log_odds(frame, log_odds)?.with_limits(plain.limits());
        Ok(Self {
            grid,
            lattice,
            sums,
            model: *model,
            params: *params,
            rays,
            shots: shots.to_vec(),
        })
    }

    /// The refined map.
    #[must_use]
    pub const fn grid(&self) -> &OccupancyGrid {
        &self.grid
    }

    /// The refined map alone.
    #[must_use]
    pub fn into_grid(self) -> OccupancyGrid {
        self.grid
    }

    /// For every shot of the log, the probability that its reading means what it says; `None` for readings
    /// that are no evidence, or that were merged into one like them.
    #[must_use]
    pub fn trust(&self) -> Vec<Option<f64>> {
        let mut trust = vec![None; self.shots.len()];
        for ray in &self.rays {
            trust[ray.shot] = Some(ray.trust);
        }
        trust
    }

    /// The evidence for a cell [log-odds], before [`RefineParams::doubt`] and the gains turned it into the map's.
    ///
    /// # Panics
    /// If the cell is outside the grid.
    #[must_use]
    pub fn evidence(&self, cell: Cell) -> f64 {
        self.lattice.evidence(&self.sums, cell)
    }

    /// What every shot gives to a cell, strongest first: its share of [`Self::evidence`], to rounding. Time: as
    /// one pass.
    ///
    /// # Panics
    /// If the cell is outside the grid.
    #[must_use]
    pub fn explain(&self, cell: Cell) -> Vec<Contribution> {
        let frame = self.grid.frame();
        assert!(
            cell.col < frame.width() && cell.row < frame.height(),
            "cell ({}, {}) outside the grid",
            cell.col,
            cell.row
        );
        let parts = self.lattice.strongest(&self.sums, cell);
        let mut scratch = Scratch::new(self.lattice.fine, &self.model, &self.params);
        let mut found = Vec::new();
        for ray in &self.rays {
            scratch.collect(ray);
            scratch.cover(&ray.shares);
            let messages = scratch.messages(ray.trust);
            let sum: f64 = messages
                .filter(|(at, _)| parts.contains(at))
                .map(|(_, m)| f64::from(m))
                .sum();
            let log_odds = (ray.weight * sum / parts.len() as f64) as f32;
            if log_odds != 0.0 {
                found.push(contribution(
                    &self.grid,
                    &self.model,
                    &self.shots,
                    ray.shot,
                    cell,
                    log_odds,
                ));
            }
        }
        sort_by_strength(&mut found);
        found
    }
}

/// One shot in one pass: takes its own last message out of the sums, explains its reading by what the others
/// believe, and adds its new message.
fn pass(
    ray: &mut Ray,
    scratch: &mut Scratch,
    sums: &[f64],
    next: &mut [f64],
    params: &RefineParams,
) {
    scratch.collect(ray);
    scratch.cover(&ray.shares);
    scratch.beliefs_of_others(sums, ray.trust, ray.weight);
    let blocked = scratch.blocked(params.prior);
    let mut log_ratio = -blocked.min(BELIEF_LIMIT);
    let false_share = if ray.echo {
        let (support, shares) = scratch.explain_arc(CELL_LIMIT);
        log_ratio += support.clamp(-BELIEF_LIMIT, BELIEF_LIMIT);
        for (old, new) in ray.shares.iter_mut().zip(shares) {
            *old = (DAMPING as f32) * *old + (1.0 - DAMPING as f32) * new;
        }
        params.false_echoes
    } else {
        params.false_silences
    };
    let prior = ((1.0 - false_share) / false_share).ln();
    let trust = 1.0 / (1.0 + (-(prior + log_ratio)).exp());
    ray.trust = DAMPING * ray.trust + (1.0 - DAMPING) * trust;
    scratch.cover(&ray.shares);
    for (index, message) in scratch.messages(ray.trust) {
        next[index as usize] += ray.weight * f64::from(message);
    }
}

/// Log-odds of a cell from the sum of its messages, monotone but for the untouched cells, which stay at 0. Past the
/// doubt, evidence for free soon counts in full; evidence for occupied in so far as it is more than slight. Doubtful
/// places come out just above 0: not free, and unknown to anyone who asks for more than a guess.
fn finish(sum: f64, params: &RefineParams) -> f32 {
    let doubt = params.doubt;
    let log_odds = if sum.abs() <= f64::EPSILON {
        0.0
    } else if sum < -doubt {
        (RAMP * (sum + doubt)).max(params.free_gain * sum)
    } else {
        GUESS * (sum.min(SLIGHT) + doubt) + params.occupied_gain * (sum - SLIGHT).max(0.0)
    };
    log_odds as f32
}

#[cfg(test)]
mod tests {
    use super::beam::PARTS;
    use super::*;

    #[test]
    fn the_parts_of_an_arc_are_odd_so_that_one_lies_on_the_axis() {
        assert_eq!(PARTS % 2, 1);
    }

    #[test]
    fn every_parameter_is_checked_by_name() {
        let good = RefineParams::default();
        assert_eq!(good.validate(), Ok(()));
        let bad = RefineParams {
            hit: f64::NAN,
            ..good
        };
        assert!(matches!(
            bad.validate(),
            Err(RefineError::Parameter { key: "hit", .. })
        ));
        let bad = RefineParams {
            iterations: 0,
            ..good
        };
        assert!(matches!(
            bad.validate(),
            Err(RefineError::Parameter {
                key: "iterations",
                ..
            })
        ));
    }
}
