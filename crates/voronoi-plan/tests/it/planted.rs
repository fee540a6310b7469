//! Builder and verifier against each other on real maps, and faults planted for the verifier to find.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::PathBuf;

use occgrid::{Cell, CellState, GridPoint, LoadOptions, OccupancyMap, Point2, load_map};
use voronoi_plan::check::{CheckParams, ClearanceProbe, EdgeLine, UnknownIs, check, tolerance};
use voronoi_plan::geojson::{ReadLimits, RouteGraph};
use voronoi_plan::{FreeSpace, GraphParams, VoronoiGraph};

use crate::random::Random;

/// Small enough for every run.
const MAPS: [&str; 5] = [
    "nav2/route/tb3_sandbox.yaml",
    "nav2/depot.yaml",
    "cob_environments/ipa-apartment/map.yaml",
    "utexas_gdc/intel.yaml",
    "nav2/testmap/testmap.yaml",
];

/// For the long form.
const MORE_MAPS: [&str; 8] = [
    "aws/small-house/map.yaml",
    "aws/warehouse-005/map.yaml",
    "f1tenth_simulator/columbia.yaml",
    "f1tenth/levine.yaml",
    "turtlebot_apps/willow-2010-02-18-0.10.yaml",
    "tuw/cave/map.yaml",
    "mit-racecar/basement_fixed.map.yaml",
    "utexas_gdc/real-3/3.yaml",
];

fn testdata(path: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata")).join(path)
}

fn real_map(name: &str) -> OccupancyMap {
    load_map(testdata("maps").join(name), &LoadOptions::default())
        .expect(name)
        .map
}

fn names() -> Vec<&'static str> {
    let mut names = MAPS.to_vec();
    if crate::long() {
        names.extend(MORE_MAPS);
    }
    names
}

/// Every map with the roadmaps for two robots.
fn roadmaps() -> impl Iterator<Item = (String, OccupancyMap, VoronoiGraph)> {
    names().into_iter().flat_map(|name| {
        let map = real_map(name);
        [0.15, 0.3].map(|radius| {
            let params = GraphParams {
                radius,
                ..GraphParams::default()
            };
            let graph = VoronoiGraph::build(&FreeSpace::from_map(&map), &params).expect(name);
            (format!("{name} at {radius}"), map.clone(), graph)
        })
    })
}

fn params(radius: f64) -> CheckParams {
    CheckParams {
        radius,
        unknown: UnknownIs::Occupied,
    }
}

#[test]
fn roadmaps_keep_their_promises() {
    for (name, map, graph) in roadmaps() {
        let route = RouteGraph::from_voronoi(&graph);
        let report = check(route.lines(), &map, &params(graph.radius));
        assert_eq!(report.edges, 2 * graph.arcs.len(), "{name}");
        assert!(
            report.violations.is_empty(),
            "{name}: {:?}",
            report.violations.first()
        );
        assert!(
            report.overclaims.is_empty(),
            "{name}: {:?}",
            report.overclaims.first()
        );

        let probe = ClearanceProbe::new(&map, UnknownIs::Occupied);
        let slack = tolerance(map.frame());
        let half_a_cell = map.frame().resolution() / 2.0;
        let mut loose = 0;
        for arc in &graph.arcs {
            let truth = probe.clearance(&arc.polyline).clearance;
            loose += usize::from(truth - arc.clearance > half_a_cell);
            let there = probe.clearance(&[arc.bottleneck]).clearance;
            assert!(
                (there - truth).abs() <= half_a_cell,
                "{name}: {there} {truth}"
            );
            assert_eq!(arc.width_profile.len(), arc.polyline.len());
            for (point, &width) in arc.polyline.iter().zip(&arc.width_profile) {
                let truth = probe.clearance(&[*point]).clearance;
                let width = f64::from(width);
                assert!(
                    width <= truth * (1.0 + 1e-6) + slack,
                    "{name}: {width} {truth}"
                );
            }
        }
        assert!(
            100 * loose <= graph.arcs.len(),
            "{name}: {loose} loose certificates"
        );
        let nodes = graph.nodes.iter().zip(0_u32..).map(|(node, id)| EdgeLine {
            id,
            points: Cow::Owned(vec![node.point]),
            claim: Some(node.clearance),
        });
        assert!(
            check(nodes, &map, &params(graph.radius)).is_clean(),
            "{name}: nodes"
        );

        let bytes = route.to_geojson().expect("written");
        let loaded = RouteGraph::from_geojson(&bytes, &ReadLimits::default()).expect("read");
        assert_eq!(loaded.to_voronoi().expect("a roadmap"), graph, "{name}");
    }
}

/// A point inside a random cell that is not free, at least a twentieth of a cell off its border, or one
/// outside the map.
fn forbidden_point(map: &OccupancyMap, random: &mut Random) -> Point2 {
    let frame = map.frame();
    let (width, height) = (frame.width() as usize, frame.height() as usize);
    let mut inside = || 0.05 + 0.9 * random.unit();
    let (dx, dy) = (inside(), inside());
    if random.below(20) == 0 {
        let (col, row) = (width as f64 + dx, random.below(height) as f64 + dy);
        return frame.map_from_grid(GridPoint { col, row });
    }
    loop {
        let cell = Cell::new(random.below(width) as u32, random.below(height) as u32);
        if map.state(cell) != CellState::Free {
            let (col, row) = (f64::from(cell.col) + dx, f64::from(cell.row) + dy);
            return frame.map_from_grid(GridPoint { col, row });
        }
    }
}

/// Moves an edge into an obstacle: one of its points, a new point, or all of it.
fn plant(line: &mut Vec<Point2>, at: Point2, random: &mut Random) {
    let chosen = random.below(line.len());
    match random.below(3) {
        0 => line[chosen] = at,
        1 => line.insert(chosen, at),
        _ => {
            let (dx, dy) = (at.x - line[chosen].x, at.y - line[chosen].y);
            for point in line.iter_mut() {
                *point = Point2::new(point.x + dx, point.y + dy);
            }
        }
    }
}

#[test]
fn a_thousand_planted_faults_are_found_and_nothing_else() {
    let mut random = Random::new(1000);
    let roadmaps: Vec<_> = roadmaps()
        .filter(|(_, _, graph)| !graph.arcs.is_empty())
        .collect();
    let mut planted = 0;
    while planted < 1000 {
        for (name, map, graph) in &roadmaps {
            let mut route = RouteGraph::from_voronoi(graph);
            let count = (route.edges.len() / 2).clamp(1, 60);
            let mut moved = BTreeSet::new();
            while moved.len() < count {
                let edge = random.below(route.edges.len());
                let edge = &mut route.edges[edge];
                if moved.insert(edge.id) {
                    let at = forbidden_point(map, &mut random);
                    let line = edge.polyline.as_mut().expect("arcs carry polylines");
                    plant(line, at, &mut random);
                }
            }
            planted += moved.len();
            let report = check(route.lines(), map, &params(graph.radius));
            let found: BTreeSet<u32> = report.violations.iter().map(|v| v.edge).collect();
            assert_eq!(found, moved, "{name}");
            for violation in &report.violations {
                assert!(violation.clearance <= 0.0, "{name}: {violation:?}");
                // the named place is in the obstacle: not free, or outside
                let cell = map.frame().cell_at(violation.at);
                let free = cell.is_some_and(|cell| map.state(cell) == CellState::Free);
                assert!(!free, "{name}: {violation:?}");
            }
            let boasts: BTreeSet<u32> = report.overclaims.iter().map(|o| o.edge).collect();
            assert_eq!(boasts, moved, "{name}: every moved edge claims too much");
        }
    }
    assert!(planted >= 1000);
}

#[test]
fn nav2s_hand_drawn_graph_has_the_clearances_that_numpy_finds() {
    let map = real_map("nav2/route/tb3_sandbox.yaml");
    let path = testdata("maps/nav2/route/turtlebot3_graph.geojson");
    let graph = RouteGraph::load(&path, &ReadLimits::default()).expect("Nav2's graph");
    let golden =
        std::fs::read_to_string(testdata("golden/tb3_route_clearance.csv")).expect("golden");
    let golden: Vec<(u32, f64)> = golden
        .lines()
        .skip(1)
        .map(|line| {
            let (id, clearance) = line.split_once(',').expect("two columns");
            (
                id.parse().expect("an id"),
                clearance.parse().expect("a clearance"),
            )
        })
        .collect();
    let probe = ClearanceProbe::new(&map, UnknownIs::Occupied);
    assert_eq!((graph.edges.len(), golden.len()), (65, 65));
    for line in graph.lines() {
        let (_, truth) = golden
            .iter()
            .find(|(id, _)| *id == line.id)
            .expect("the edge");
        let found = probe.clearance(&line.points).clearance;
        assert!(
            (found - truth).abs() < 1e-9,
            "edge {}: {found}, {truth}",
            line.id
        );
    }
    for radius in [0.2, 0.25, 0.26, 0.3, 0.4] {
        let expected = golden.iter().filter(|(_, c)| *c < radius - 1e-9).count();
        let report = check(graph.lines(), &map, &params(radius));
        assert_eq!(report.violations.len(), expected, "at {radius}");
    }
    // a robot of Nav2's usual 0.22 m passes everywhere; at 0.26 m four edges are too near
    let report = check(graph.lines(), &map, &params(0.26));
    assert_eq!(report.violations.len(), 4);
    assert!((report.min_clearance.expect("edges") - 0.25).abs() < 1e-9);
}
