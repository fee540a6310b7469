//! Straightened graphs: what Nav2 drives keeps the radius.

use std::path::Path;

use occgrid::{LoadOptions, load_map};
use voronoi_plan::check::{CheckParams, UnknownIs, check};
use voronoi_plan::geojson::RouteGraph;
use voronoi_plan::{FreeSpace, GraphParams, VoronoiGraph};

#[test]
fn straight_from_node_to_node_keeps_the_radius_on_real_maps() {
    let maps = [
        ("utexas_gdc/intel.yaml", 0.15),
        ("turtlebot_apps/willow-2010-02-18-0.10.yaml", 0.25),
        ("f1tenth/levine.yaml", 0.3),
        ("mit-racecar/basement_fixed.map.yaml", 0.2),
    ];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/maps");
    for (name, radius) in maps {
        let map = load_map(folder.join(name), &LoadOptions::default())
            .unwrap()
            .map;
        let space = FreeSpace::from_map(&map);
        let params = GraphParams {
            radius,
            ..GraphParams::default()
        };
        let graph = VoronoiGraph::build(&space, &params).unwrap();
        let straight = graph.straightened(&space);
        let rules = CheckParams {
            radius,
            unknown: UnknownIs::Occupied,
        };
        let drawn = RouteGraph::from_voronoi(&graph);
        let cut = RouteGraph::from_voronoi(&straight);
        let short = check(drawn.chords(), &map, &rules).violations.len();
        assert!(short > 0, "{name}: nothing to mend");
        let report = check(cut.chords(), &map, &rules);
        assert!(
            report.is_clean(),
            "{name}: {:?} {:?}",
            report.violations,
            report.overclaims
        );
        assert_eq!(straight.components(), graph.components(), "{name}");
        assert_eq!(straight.cycles(), graph.cycles(), "{name}");
        assert!(
            straight.arcs.len() < graph.arcs.iter().map(|a| a.polyline.len()).sum::<usize>() / 4
        );
        assert!(
            straight.total_length() <= graph.total_length() + 1e-6,
            "{name}"
        );
    }
}
