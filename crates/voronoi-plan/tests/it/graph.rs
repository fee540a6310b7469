//! Roadmaps of small maps, drawn by hand.

use std::borrow::Cow;

use morpho::BitImage;
use occgrid::{Cell, LoadOptions, MapFrame, Pose2, load_map};
use voronoi_plan::check::{CheckParams, EdgeLine, UnknownIs, check};
use voronoi_plan::{
    BuildError, ClearanceField, FreeSpace, GraphParams, Lattice, NodeKind, Prune, VoronoiGraph,
};

/// A free space of cells of 0.1 m from a picture: `.` free.
pub(crate) fn space(rows: &[&str]) -> FreeSpace {
    let (width, height) = (rows[0].len(), rows.len());
    let cells = BitImage::from_fn(width, height, |x, y| rows[y].as_bytes()[x] == b'.');
    let frame = MapFrame::new(width as u32, height as u32, 0.1, Pose2::default()).expect("a frame");
    FreeSpace::new(frame, cells)
}

fn params(radius: f64, prune: Prune) -> GraphParams {
    GraphParams { radius, prune }
}

pub(crate) fn build(rows: &[&str], radius: f64) -> VoronoiGraph {
    VoronoiGraph::build(&space(rows), &params(radius, Prune::Covered)).expect("a graph")
}

#[test]
fn a_ring_corridor_is_one_loop() {
    let rows = [
        ".........",
        ".........",
        ".........",
        "...###...",
        "...###...",
        "...###...",
        ".........",
        ".........",
        ".........",
    ];
    let graph = build(&rows, 0.1);
    assert_eq!((graph.nodes.len(), graph.arcs.len()), (1, 1), "{graph:?}");
    assert_eq!(graph.nodes[0].kind, NodeKind::Loop);
    assert_eq!((graph.components(), graph.cycles()), (1, 1));
    // the loop cuts its corners: halfway it is a cell's diagonal from the corner of the block
    assert!((graph.arcs[0].clearance - 0.1 * 2.0_f64.sqrt()).abs() < 1e-8);
}

#[test]
fn a_corridor_one_cell_wide_passes_a_robot_that_fits() {
    let rows = [
        "########################",
        "#......................#",
        "########################",
    ];
    let graph = build(&rows, 0.05);
    assert_eq!((graph.nodes.len(), graph.arcs.len()), (2, 1), "{graph:?}");
    assert!((graph.arcs[0].clearance - 0.05).abs() < 1e-12);
    assert!(graph.arcs[0].length > 1.2);
    assert!(build(&rows, 0.0501).nodes.is_empty());
}

#[test]
fn nothing_free_gives_an_empty_graph() {
    let graph = build(&["###", "###"], 0.0);
    assert_eq!((graph.nodes.len(), graph.arcs.len()), (0, 0));
    assert_eq!(graph.min_clearance(), None);
    assert_eq!((graph.components(), graph.cycles()), (0, 0));
}

#[test]
fn a_radius_that_is_no_length_is_refused() {
    for radius in [-0.1, f64::NAN, f64::INFINITY] {
        let result = VoronoiGraph::build(&space(&["."]), &params(radius, Prune::Covered));
        assert!(matches!(result, Err(BuildError::Radius { .. })), "{radius}");
    }
}

/// Every committed map, judged by the verifier, which shares no code with the builder, and by a search
/// of the lattice.
#[test]
fn real_maps_keep_their_radius_and_their_components() {
    let maps = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/maps");
    let mut seen = 0;
    for file in [
        "aws/small-house/map.yaml",
        "aws/warehouse-005/map.yaml",
        "cob_environments/ipa-apartment/map.yaml",
        "f1tenth/levine.yaml",
        "f1tenth_simulator/columbia.yaml",
        "mit-racecar/basement_fixed.map.yaml",
        "nav2/depot.yaml",
        "nav2/TenByTen/TenByTen.yaml",
        "nav2/testmap/testmap.yaml",
        "nav2/route/tb3_sandbox.yaml",
        "turtlebot_apps/willow-2010-02-18-0.10.yaml",
        "tuw/cave/map.yaml",
        "utexas_gdc/intel.yaml",
        "utexas_gdc/real-3/3.yaml",
    ] {
        let path = format!("{maps}/{file}");
        let map = load_map(&path, &LoadOptions::default()).expect(file).map;
        let space = FreeSpace::from_map(&map);
        let field = ClearanceField::new(&space);
        for radius in [0.0, 0.05, 0.175, 0.3] {
            let graph =
                VoronoiGraph::build(&space, &params(radius, Prune::Covered)).expect("a graph");
            assert_eq!(graph.crossings(), 0, "{file} {radius}");
            let edges = graph.arcs.iter().zip(0..).map(|(arc, id)| EdgeLine {
                id,
                points: Cow::Borrowed(&arc.polyline),
                claim: Some(arc.clearance),
            });
            let unknown = UnknownIs::Occupied;
            let report = check(edges, &map, &CheckParams { radius, unknown });
            assert!(report.is_clean(), "{file} {radius}: {report:?}");
            let lattice = Lattice::new(space.cells(), &field, radius / space.frame().resolution());
            assert_eq!(
                graph.components(),
                components_of(&lattice, &space),
                "{file} {radius}"
            );
            seen += graph.arcs.len();
        }
    }
    assert!(seen > 3_000, "{seen} arcs");
}

/// The components of the lattice, by flooding.
fn components_of(lattice: &Lattice<'_>, space: &FreeSpace) -> usize {
    let (width, height) = (space.frame().width(), space.frame().height());
    let mut seen = vec![false; space.frame().cell_count()];
    let mut count = 0;
    for row in 0..height {
        for col in 0..width {
            let start = Cell::new(col, row);
            if seen[space.frame().index(start)] || !lattice.has(start) {
                continue;
            }
            count += 1;
            seen[space.frame().index(start)] = true;
            let mut stack = vec![start];
            while let Some(cell) = stack.pop() {
                for next_row in cell.row.saturating_sub(1)..(cell.row + 2).min(height) {
                    for next_col in cell.col.saturating_sub(1)..(cell.col + 2).min(width) {
                        let next = Cell::new(next_col, next_row);
                        let index = space.frame().index(next);
                        if !seen[index] && lattice.links(cell, next) {
                            seen[index] = true;
                            stack.push(next);
                        }
                    }
                }
            }
        }
    }
    count
}
