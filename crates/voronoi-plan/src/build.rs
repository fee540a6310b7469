//! From free space to the certified roadmap.

use std::borrow::Cow;

use morpho::distance::at_least;
use morpho::{BitImage, Border};
use thiserror::Error;

use crate::bridge::bridge;
use crate::certify::certify;
use crate::lattice::Lattice;
use crate::prune::{Prune, prune_covered};
use crate::samples::{Ranked, Samples};
use crate::skeleton::trace_ranked;
use crate::{ClearanceField, FreeSpace, VoronoiGraph};

/// What a roadmap is made for.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default))]
pub struct GraphParams {
    /// Radius of the robot, seen as a disc about the point that follows the graph [m], 0 or more and
    /// finite. Raising it closes passages. Default 0.375: half the side of the 0.75 m base of Choi, Ryu
    /// and Kim, 1999.
    pub radius: f64,
    /// Which dead ends stay. Default: those that reach what their junction does not cover.
    pub prune: Prune,
}

impl Default for GraphParams {
    fn default() -> Self {
        Self {
            radius: 0.375,
            prune: Prune::default(),
        }
    }
}

/// Why a roadmap was not made.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The radius is not a length.
    #[error("radius must be 0 m or more and finite, found {found}")]
    Radius {
        /// [m]
        found: f64,
    },
}

impl VoronoiGraph {
    /// The roadmap of a free space for a robot's radius. An empty graph where the robot fits nowhere.
    ///
    /// Every arc keeps at least the radius from everything that is not free, by construction. Two cells
    /// where the robot fits are joined by admissible links (see [`Lattice`]) only if the roadmap's nearest
    /// parts are joined too: it has exactly one component for each component of the lattice.
    ///
    /// Method: the cells whose clearance suffices for every link between them are thinned to a skeleton
    /// of the same components and holes, which is traced, pruned, bridged where only a link of less spare
    /// clearance passes, and certified.
    ///
    /// # Errors
    /// [`BuildError::Radius`] where the radius is negative or not finite.
    pub fn build(space: &FreeSpace, params: &GraphParams) -> Result<Self, BuildError> {
        let radius = checked_radius(params)?;
        let need = ClearanceField::threshold(radius / space.frame().resolution());
        Ok(roadmap(space, need, params))
    }
}

fn roadmap(space: &FreeSpace, need: u32, params: &GraphParams) -> VoronoiGraph {
    let free = space.cells();
    let admissible = at_least(free, need, Border::Background);
    let left_out = left_out(free, &admissible, need);
    let mut core = Cow::Borrowed(&admissible);
    if let Some(left_out) = &left_out {
        core.to_mut().subtract(left_out);
    }
    let skeleton = morpho::thin::homotopic(&core);
    let pixels = Ranked::new(&skeleton);
    let mut draft = trace_ranked(&pixels);
    let samples = Samples::new(free, &pixels);
    let lattice = Lattice::sampled(free, &admissible, need, Some(&samples));
    if params.prune == Prune::Covered {
        draft = prune_covered(draft, |cell| lattice.squared_doubled(cell));
    }
    draft = draft.merge_clusters(|cell| lattice.squared_doubled(cell));
    if let Some(left_out) = &left_out {
        draft.keep_to(&lattice);
        draft = bridge(draft, &core, left_out, &lattice);
    }
    certify(draft, space.frame(), &lattice, params.radius)
}

fn checked_radius(params: &GraphParams) -> Result<f64, BuildError> {
    let found = params.radius;
    if found.is_finite() && found >= 0.0 {
        Ok(found)
    } else {
        Err(BuildError::Radius { found })
    }
}

/// The admissible cells that are not to be thinned, if any lacks the spare clearance that makes every link
/// between 8-neighbours admissible.
///
/// A point obstacle that keeps `m` from both ends of a link of length `l` keeps `sqrt(m^2 - l^2 / 4)` from
/// the link, and `l^2 <= 2`: with `(2 m)^2` at least `need + 2` at both ends nothing can go wrong. A cell
/// below that stays in where every link to a diagonal neighbour is admissible, or can go round by a cell
/// beside it.
fn left_out(free: &BitImage, admissible: &BitImage, need: u32) -> Option<BitImage> {
    if !is_clearance(need) && !is_clearance(need.saturating_add(1)) {
        return None;
    }
    let mut narrow = admissible.clone();
    narrow.subtract(&at_least(free, need.saturating_add(2), Border::Background));
    if narrow.count_ones() == 0 {
        return None;
    }
    let lattice = Lattice::sampled(free, admissible, need, None);
    let (width, height) = (free.width(), free.height());
    let mut core = admissible.clone();
    let mut left_out = BitImage::new(width, height);
    for cell in Lattice::cells_of(&narrow) {
        let stuck = lattice.neighbours(cell).any(|other| {
            core.get(other.col as usize, other.row as usize) && lattice.way(cell, other).is_none()
        });
        if stuck {
            left_out.set(cell.col as usize, cell.row as usize, true);
            core.set(cell.col as usize, cell.row as usize, false);
        }
    }
    Some(left_out)
}

/// Whether `(2 d)^2` of any cell of any map can be this value: squares lie an odd number of half cells
/// away in one direction, or in both. (Odd squares are 1 modulo 8.)
fn is_clearance(squared_doubled: u32) -> bool {
    let is_square = |n: u32| n.isqrt().pow(2) == n;
    match squared_doubled % 8 {
        1 => is_square(squared_doubled),
        2 => (1..=squared_doubled.isqrt())
            .step_by(2)
            .any(|odd| is_square(squared_doubled - odd * odd)),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clearances_are_those_of_some_offset() {
        let edge = |n: u32| (2 * n).saturating_sub(1);
        let mut possible = vec![false; 4_000];
        for across in 0..40 {
            for down in 0..40 {
                let value = edge(across).pow(2) + edge(down).pow(2);
                if let Some(slot) = possible.get_mut(value as usize) {
                    *slot = value > 0;
                }
            }
        }
        for (value, &possible) in possible.iter().enumerate() {
            assert_eq!(is_clearance(value as u32), possible, "{value}");
        }
        assert!(!is_clearance(u32::MAX));
    }
}
