//! Roadmaps of small maps, drawn by hand.

use morpho::BitImage;
use occgrid::{MapFrame, Pose2};
use voronoi_plan::{BuildError, FreeSpace, GraphParams, NodeKind, Prune, VoronoiGraph};

/// A free space of cells of 0.1 m from a picture: `.` free.
pub(crate) fn space(rows: &[&str]) -> FreeSpace {
    let (width, height) = (rows[0].len(), rows.len());
    let cells = BitImage::from_fn(width, height, |x, y| rows[y].as_bytes()[x] == b'.');
    let frame = MapFrame::new(width as u32, height as u32, 0.1, Pose2::default()).expect("a frame");
    FreeSpace::new(frame, cells)
}

fn params(radius: f64, prune: Prune) -> GraphParams {
    let mut params = GraphParams::default();
    params.radius = radius;
    params.prune = prune;
    params
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
