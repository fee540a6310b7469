//! From map to graph and from graph to route, on real maps. Every graph passes the independent checker
//! before it is timed.

use criterion::{Criterion, criterion_group, criterion_main};
use mobot_benches::BuildingMap;
use voronoi_plan::check::{CheckParams, UnknownIs, check};
use voronoi_plan::geojson::RouteGraph;
use voronoi_plan::{ClearanceField, FreeSpace, GraphParams, Planner, VoronoiGraph};

/// Radius of the robot [m].
const RADIUS: f64 = 0.25;

fn graphs_and_routes(c: &mut Criterion) {
    let mut group = c.benchmark_group("plan");
    group.sample_size(20);
    for map in [
        BuildingMap::small(),
        BuildingMap::medium(),
        BuildingMap::large(),
    ] {
        let occupancy = map.occupancy();
        let space = FreeSpace::from_map(&occupancy);
        let params = GraphParams {
            radius: RADIUS,
            ..GraphParams::default()
        };
        let graph = VoronoiGraph::build(&space, &params).expect("a graph");
        let route_graph = RouteGraph::from_voronoi(&graph);
        let rules = CheckParams {
            radius: RADIUS,
            unknown: UnknownIs::Occupied,
        };
        assert!(
            check(route_graph.lines(), &occupancy, &rules).is_clean(),
            "{}",
            map.name
        );
        group.bench_function(format!("map_to_graph/{}", map.name), |b| {
            b.iter(|| VoronoiGraph::build(&space, &params));
        });
        let nodes: Vec<_> = graph.nodes.iter().map(|node| node.point).collect();
        let planner = Planner::new(&space, &graph, ClearanceField::new(&space));
        let mut turn = 0;
        group.bench_function(format!("route/{}", map.name), |b| {
            b.iter(|| {
                turn += 1;
                let from = nodes[turn * 7919 % nodes.len()];
                let to = nodes[turn * 104_729 % nodes.len()];
                planner.plan(from, to)
            });
        });
    }
}

criterion_group!(benches, graphs_and_routes);
criterion_main!(benches);
