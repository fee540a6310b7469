//! The paper's graph keeps the paper's faults, and says so.

use morpho::CleanerParams;
use occgrid::{MapFrame, OccupancyMap, Pose2};
use voronoi_plan::{FreeSpace, GraphParams, PaperGraph, VoronoiGraph};

/// 0.25 m cells from a picture: `.` free, `?` unknown.
fn map_from(rows: &[String]) -> OccupancyMap {
    let frame = MapFrame::new(
        rows[0].len() as u32,
        rows.len() as u32,
        0.25,
        Pose2::default(),
    )
    .expect("a frame");
    let values = rows
        .iter()
        .flat_map(|row| row.bytes())
        .map(|byte| match byte {
            b'.' => 0,
            b'?' => -1,
            _ => 100,
        })
        .collect();
    OccupancyMap::new(frame, values, 25, 65)
}

/// Two corridors joined by a bend round a block, each with a side branch, so that there are nodes on
/// both sides of the block.
fn bend() -> OccupancyMap {
    let mut rows = vec![vec![b'#'; 90]; 90];
    let mut carve = |x0: usize, x1: usize, y0: usize, y1: usize| {
        for row in &mut rows[y0..y1] {
            row[x0..x1].fill(b'.');
        }
    };
    carve(6, 84, 6, 15); // top corridor
    carve(75, 84, 6, 84); // right corridor
    carve(30, 39, 6, 40); // branch of the top one
    carve(40, 84, 60, 69); // branch of the right one
    let rows: Vec<String> = rows
        .into_iter()
        .map(|row| String::from_utf8(row).expect("ascii"))
        .collect();
    map_from(&rows)
}

#[test]
fn a_chord_cuts_the_corner_of_the_bend_and_is_counted() {
    let map = bend();
    let paper = PaperGraph::build(&map, 0.375, &CleanerParams::default()).expect("a graph");
    assert_eq!(paper.graph.nodes.len(), 2, "{:?}", paper.graph.nodes);
    assert_eq!(paper.graph.arcs.len(), 1);
    assert_eq!(paper.graph.crossings(), 1);
    assert!(paper.graph.arcs[0].clearance.abs() < 1e-12);
    let params = GraphParams::default();
    let ours = VoronoiGraph::build(&FreeSpace::from_map(&map), &params).expect("a graph");
    assert_eq!(ours.crossings(), 0);
    assert!(ours.min_clearance().is_some_and(|c| c >= 0.375));
}

#[test]
fn closing_swallows_a_post_and_the_arc_goes_through_it() {
    // a corridor of five cells, with a branch up at each end and one post in its middle
    let mut rows = vec![vec![b'#'; 120]; 48];
    for row in &mut rows[24..33] {
        row[6..114].fill(b'.');
    }
    for row in &mut rows[6..33] {
        row[30..39].fill(b'.');
        row[84..93].fill(b'.');
    }
    rows[28][60] = b'#';
    let rows: Vec<String> = rows
        .into_iter()
        .map(|row| String::from_utf8(row).expect("ascii"))
        .collect();
    let map = map_from(&rows);
    let params = CleanerParams {
        opening_side: 1,
        ..CleanerParams::default()
    };
    let paper = PaperGraph::build(&map, 0.375, &params).expect("a graph");
    assert_eq!(paper.graph.nodes.len(), 2, "{:?}", paper.graph.nodes);
    assert_eq!(paper.graph.crossings(), 1, "{:?}", paper.graph.arcs);
    // the post stands at cell (60, 28): its square is where the arc is cut
    let at = map.frame().grid_from_map(paper.graph.arcs[0].bottleneck);
    assert!((60.0..=61.0).contains(&at.col) && (28.0..=29.0).contains(&at.row));
}

#[test]
fn the_unknown_is_no_clear_cell() {
    let rows = vec!["?".repeat(30); 30];
    let paper = PaperGraph::build(&map_from(&rows), 0.1, &CleanerParams::default()).expect("fine");
    assert_eq!(paper.cleaned.stages.binary.count_ones(), 0);
    assert!(paper.graph.nodes.is_empty() && paper.graph.arcs.is_empty());
}
