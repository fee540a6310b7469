//! Spurs pruned by what they mean.
//!
//! A medial axis grows a branch into every dent of a wall. The branch tells something new only where
//! it leaves the free disc that its junction already has for itself: a branch that stays in the clear
//! disc of its junction is covered by it, as a ball of a medial axis is covered by a larger one (Amenta
//! and Kolluri, The medial axis of a union of balls, 2001; the local-disc test of Couprie, Coeurjolly
//! and Zrour, Discrete bisector function and Euclidean skeleton in 2D and 3D, 2007, looks at the same discs).

use occgrid::Cell;

use crate::NodeKind;
use crate::draft::{Incidence, Trace, TraceArc};

/// Which dead ends of the skeleton the roadmap keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Prune {
    /// Every branch of the skeleton.
    Nothing,
    /// A branch that ends free goes unless one of its points is farther from its junction than the
    /// junction's clearance. Branches that then end free are judged anew, until nothing changes. Arcs
    /// between junctions, loops, and components without a junction stay; a component never vanishes.
    #[default]
    Covered,
}

/// Removes covered end branches until none is left. `squared_doubled` gives the `(2 d)^2` of a cell.
///
/// Linear in nodes and arcs a round; each round removes a layer of the trees that hang on the rest.
pub(crate) fn prune_covered(mut trace: Trace, squared_doubled: impl Fn(Cell) -> u32) -> Trace {
    loop {
        let incidence = Incidence::new(&trace);
        let goes: Vec<bool> = trace
            .arcs
            .iter()
            .map(|arc| {
                parent_end(arc, &incidence).is_some_and(|parent| {
                    let center = trace.nodes[arc.ends[parent]].cell;
                    is_covered(arc, center, squared_doubled(center))
                })
            })
            .collect();
        if !goes.contains(&true) {
            return trace;
        }
        let mut lost = vec![false; trace.nodes.len()];
        for (arc, _) in trace.arcs.iter().zip(&goes).filter(|&(_, &goes)| goes) {
            if let Some(parent) = parent_end(arc, &incidence) {
                lost[arc.ends[1 - parent]] = true;
            }
        }
        trace = without(trace, &goes, &lost).merge_chains();
    }
}

/// Which end of an end branch is its junction; `None` for any other arc.
fn parent_end(arc: &TraceArc, incidence: &Incidence) -> Option<usize> {
    let degree = arc.ends.map(|n| incidence.at(n).len());
    match degree {
        [junction, 1] if junction >= 3 => Some(0),
        [1, junction] if junction >= 3 => Some(1),
        _ => None,
    }
}

/// Whether every cell of a branch lies in the disc of `(2 r)^2 = squared_doubled` about `center`.
fn is_covered(arc: &TraceArc, center: Cell, squared_doubled: u32) -> bool {
    arc.path.iter().all(|cell| {
        let across = u64::from(cell.col.abs_diff(center.col));
        let down = u64::from(cell.row.abs_diff(center.row));
        4 * (across * across + down * down) <= u64::from(squared_doubled)
    })
}

fn without(trace: Trace, goes: &[bool], lost: &[bool]) -> Trace {
    let mut rest = Trace::default();
    let mut index = vec![usize::MAX; trace.nodes.len()];
    for (n, &node) in trace.nodes.iter().enumerate() {
        if !lost[n] || node.kind == NodeKind::Bridge {
            index[n] = rest.nodes.len();
            rest.nodes.push(node);
        }
    }
    for (arc, _) in trace.arcs.into_iter().zip(goes).filter(|&(_, &goes)| !goes) {
        let ends = arc.ends.map(|n| index[n]);
        rest.arcs.push(TraceArc { ends, ..arc });
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::trace;
    use morpho::{BitImage, Border, distance::squared_to_squares};

    fn cycles_and_components(trace: &Trace) -> (usize, usize) {
        let mut parts = petgraph::unionfind::UnionFind::<usize>::new(trace.nodes.len());
        let joins = trace
            .arcs
            .iter()
            .filter(|arc| parts.union(arc.ends[0], arc.ends[1]));
        let joins = joins.count();
        (trace.arcs.len() - joins, trace.nodes.len() - joins)
    }

    #[test]
    fn a_covered_branch_is_never_left_and_an_uncovered_one_never_taken() {
        let (mut before, mut after) = (0, 0);
        for seed in 0..300_u64 {
            let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
            let image = BitImage::from_fn(70, 40, |_, _| {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                state >> 20 & 63 > seed % 12
            });
            let distance = squared_to_squares(&image, Border::Background);
            let clearance = |cell: Cell| distance[cell.row as usize * 70 + cell.col as usize];
            let all = trace(&morpho::thin::homotopic(&image));
            let kept = prune_covered(all.clone(), clearance);
            assert_eq!(cycles_and_components(&all), cycles_and_components(&kept));
            let incidence = Incidence::new(&kept);
            for arc in &kept.arcs {
                if let Some(parent) = parent_end(arc, &incidence) {
                    let center = kept.nodes[arc.ends[parent]].cell;
                    let beyond = arc.path.iter().any(|cell| {
                        let across = f64::from(cell.col) - f64::from(center.col);
                        let down = f64::from(cell.row) - f64::from(center.row);
                        across.hypot(down) > f64::from(clearance(center)).sqrt() / 2.0
                    });
                    assert!(beyond, "seed {seed}: {center:?}");
                }
            }
            // a branch of the whole skeleton that reaches beyond stays, up to joins with others
            let whole = Incidence::new(&all);
            for arc in &all.arcs {
                if let Some(parent) = parent_end(arc, &whole) {
                    let center = all.nodes[arc.ends[parent]].cell;
                    if !is_covered(arc, center, clearance(center)) {
                        let tip = all.nodes[arc.ends[1 - parent]].cell;
                        assert!(
                            kept.nodes.iter().any(|node| node.cell == tip),
                            "seed {seed}"
                        );
                    }
                }
            }
            before += all.arcs.len();
            after += kept.arcs.len();
        }
        assert!(after < before);
    }
}
