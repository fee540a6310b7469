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
//! A smooth wall is silent at a slant, so what passes says little against a wall that it would have grazed: each place
//! may be free, or a wall of one of four turns, and evidence is kept for each turn apart. Rooms are mostly right-angled:
//! the main direction is the one on whose walls echoes from different places agree and with which the log is explained
//! best. And walls go on straight: along each turn, wall and no wall alternate as a Markov chain.
//!
//! Per pass and shot, from the beliefs of all other shots and of the places along the same walls:
//! 1. which part of the arc reflected (its places least known to be free, the way to them least blocked, facing the
//!    sonar, near the axis rather than the edge);
//! 2. whether the echo is true (arc not known to be free, nothing known in the way);
//! 3. from both, the evidence for each cell and turn: passed, hit, or nothing.

mod beam;
mod heading;
mod lattice;
mod lines;
mod params;
mod passes;
mod rays;
mod turns;

use thiserror::Error;

use crate::explain::{contribution, sort_by_strength};
use crate::{
    Cell, Contribution, FrameError, GridError, OccupancyGrid, Shot, SonarModel, SonarModelError,
};

use beam::Scratch;
use lattice::Lattice;
pub use params::RefineParams;
use passes::Beliefs;

/// Slope at which evidence for free counts, from the doubt up to its full value.
const RAMP: f64 = 50.0;
/// Slope of what is left of doubtful evidence: keeps its order.
const GUESS: f64 = 0.02;
/// Evidence for occupied that counts as doubtful still: in test rooms, half of such places are wall [log-odds].
const SLIGHT: f64 = 1.5;

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
/// visits of shots to cells and a tenth more for the main direction, each pass linear in the area of all beams and in
/// the cells; memory: 60 bytes a cell of the working lattice, whose cells are about 5 cm where the map's are larger,
/// and about 200 bytes a shot.
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
    beliefs: Beliefs,
    /// Evidence for a wall of any turn on the fine lattice, from all sides.
    any: Vec<f32>,
    main: f64,
    model: SonarModel,
    params: RefineParams,
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
        let rays = rays::prepare(shots, model, params, lattice.fine.resolution())?;
        let mut scratch = Scratch::new(lattice.fine, model, params);
        let main = params.main_direction.unwrap_or_else(|| {
            passes::main_direction(&rays, &mut scratch, &lattice.fine, model, params)
        });
        let beliefs = passes::explain_log(rays, &mut scratch, &lattice.fine, main, params);
        let any = beliefs.any();
        let cells = (0..frame.height())
            .flat_map(|row| (0..frame.width()).map(move |col| Cell { col, row }));
        let log_odds = cells
            .map(|cell| {
                let strongest = lattice.strongest(&any, cell);
                finish(mean(&strongest, |at| f64::from(any[at])), params)
            })
            .collect();
        let grid = OccupancyGrid::from_log_odds(frame, log_odds)?.with_limits(plain.limits());
        Ok(Self {
            grid,
            lattice,
            beliefs,
            any,
            main,
            model: *model,
            params: *params,
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

    /// The direction to which most walls are taken to be square or parallel [rad, in the map].
    #[must_use]
    pub const fn main_direction(&self) -> f64 {
        self.main
    }

    /// For every shot of the log, the probability that its reading means what it says; `None` for readings
    /// that are no evidence, or that were merged into one like them.
    #[must_use]
    pub fn trust(&self) -> Vec<Option<f64>> {
        let mut trust = vec![None; self.shots.len()];
        for ray in &self.beliefs.rays {
            trust[ray.shot] = Some(ray.trust);
        }
        trust
    }

    /// What all shots together say of a cell, for a wall that stands as is likeliest there [log-odds]: before the places
    /// along that wall are asked too, and before [`RefineParams::doubt`] and the gains turn it into the map's.
    ///
    /// # Panics
    /// If the cell is outside the grid.
    #[must_use]
    pub fn evidence(&self, cell: Cell) -> f64 {
        let strongest = self.lattice.strongest(&self.any, cell);
        mean(&strongest, |at| {
            f64::from(self.beliefs.sums[at][self.beliefs.likeliest(at)])
        })
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
        let parts = self.lattice.strongest(&self.any, cell);
        let mut scratch = Scratch::new(self.lattice.fine, &self.model, &self.params);
        scratch.face(self.beliefs.turns.clone());
        let mut found = Vec::new();
        for ray in &self.beliefs.rays {
            scratch.collect(ray);
            scratch.cover(&ray.shares);
            let messages = scratch.messages(ray.trust);
            let sum: f64 = messages
                .filter(|(at, _)| parts.contains(at))
                .map(|(at, m)| f64::from(m[self.beliefs.likeliest(at as usize)]))
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

fn mean(indices: &[u32], value: impl Fn(usize) -> f64) -> f64 {
    let sum: f64 = indices.iter().map(|&at| value(at as usize)).sum();
    sum / indices.len() as f64
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
