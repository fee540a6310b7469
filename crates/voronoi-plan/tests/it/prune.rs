//! Which branches the roadmap keeps.

use proptest::prelude::*;
use voronoi_plan::{ClearanceField, GraphParams, NodeKind, Prune, VoronoiGraph};

use crate::graph::{build, space};

/// A corridor 9 cells wide with a niche 5 wide of the given depth in its middle.
fn corridor_with_niche(depth: usize) -> Vec<String> {
    (0..9 + depth)
        .map(|row| {
            let wall = if row < 9 { '.' } else { '#' };
            (0..81)
                .map(|col| if (38..43).contains(&col) { '.' } else { wall })
                .collect()
        })
        .collect()
}

fn ends_and_junctions(graph: &VoronoiGraph) -> (usize, usize) {
    let count = |kind| graph.nodes.iter().filter(|n| n.kind == kind).count();
    (count(NodeKind::End), count(NodeKind::Junction))
}

#[test]
fn a_shallow_niche_has_no_branch_and_a_deep_one_has() {
    for (depth, branches) in [(0, 0), (1, 0), (2, 0), (25, 1)] {
        let rows = corridor_with_niche(depth);
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let graph = build(&rows, 0.2);
        assert_eq!(
            ends_and_junctions(&graph),
            (2 + branches, branches),
            "depth {depth}"
        );
    }
}

#[test]
fn a_lone_corridor_keeps_its_arc() {
    let rows = corridor_with_niche(0);
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    let graph = build(&rows, 0.2);
    assert_eq!((graph.nodes.len(), graph.arcs.len()), (2, 1));
    assert!(graph.total_length() > 6.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if crate::long() { 10_000 } else { 500 }))]

    /// By the definition: what is left reaches beyond the disc of its junction, what is gone was a tree
    /// that hung on the rest, and nothing else changed.
    #[test]
    fn pruning_takes_covered_branches_and_nothing_else(
        free in crate::hostile::maps(),
        radius in 0.0..3.0,
    ) {
        let rows: Vec<String> = (0..free.height())
            .map(|y| (0..free.width()).map(|x| if free.get(x, y) { '.' } else { '#' }).collect())
            .collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let space = space(&rows);
        let field = ClearanceField::new(&space);
        let graph = |prune| {
            let params = GraphParams { radius: radius * 0.1, prune };
            VoronoiGraph::build(&space, &params).expect("a graph")
        };
        let (all, kept) = (graph(Prune::Nothing), graph(Prune::Covered));
        prop_assert_eq!(all.components(), kept.components());
        // bridges may be led otherwise, but close no cycle that was not there
        let bridged = |g: &VoronoiGraph| g.nodes.iter().any(|n| n.kind == NodeKind::Bridge);
        if bridged(&all) || bridged(&kept) {
            return Ok(());
        }
        prop_assert_eq!(all.cycles(), kept.cycles());
        prop_assert!(kept.total_length() <= all.total_length() + 1e-9);
        for arc in &kept.arcs {
            let [a, b] = [&kept.nodes[arc.from], &kept.nodes[arc.to]];
            let parent = match (a.kind, b.kind) {
                (NodeKind::Junction, NodeKind::End) => a,
                (NodeKind::End, NodeKind::Junction) => b,
                _ => continue,
            };
            let reach = arc
                .polyline
                .iter()
                .map(|p| p.distance(parent.point))
                .fold(0.0, f64::max);
            // a cluster's node may be up to two links from the junction pixel that was judged
            let slack = 0.1 * 2.0 * 2.0_f64.sqrt();
            prop_assert!(reach > field.at(parent.cell) * 0.1 - 2.0 * slack - 1e-9);
        }
    }
}
