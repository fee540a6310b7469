//! Route graphs as GeoJSON: Nav2's own files, hostile files, and ours there and back.

use std::path::PathBuf;

use occgrid::{Cell, MapFrame, Point2, Pose2};
use voronoi_plan::geojson::{ReadLimits, RouteEdge, RouteGraph, RouteGraphError, RouteNode};
use voronoi_plan::{Arc, Node, NodeKind, VoronoiGraph};

use crate::random::Random;

fn nav2(name: &str) -> PathBuf {
    PathBuf::from(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../testdata/maps/nav2/route"
    ))
    .join(name)
}

fn read(text: &str) -> Result<RouteGraph, RouteGraphError> {
    RouteGraph::from_geojson(text.as_bytes(), &ReadLimits::default())
}

fn collection(features: &str) -> String {
    format!(r#"{{"type":"FeatureCollection","features":[{features}]}}"#)
}

const NODE_0: &str =
    r#"{"properties":{"id":0},"geometry":{"type":"Point","coordinates":[0.5,-1]}}"#;
const NODE_1: &str =
    r#"{"properties":{"id":1},"geometry":{"type":"Point","coordinates":[1.5,2.0]}}"#;

/// Nodes 0 and 1, and an edge of the given properties and geometry.
fn with_edge(properties: &str, geometry: &str) -> String {
    collection(&format!(
        r#"{NODE_0},{NODE_1},{{"properties":{{{properties}}},"geometry":{geometry}}}"#
    ))
}

const LINE: &str = r#"{"type":"LineString","coordinates":[[0.5,-1],[1.5,2]]}"#;

#[test]
fn nav2s_own_files_are_read() {
    // counted with Python's json module
    for (name, nodes, edges) in [
        ("aws_graph.geojson", 40, 84),
        ("error_codes.geojson", 13, 1),
        ("sample_graph.geojson", 9, 24),
        ("turtlebot3_graph.geojson", 20, 65),
    ] {
        let graph = RouteGraph::load(&nav2(name), &ReadLimits::default()).expect(name);
        assert_eq!(
            (graph.nodes.len(), graph.edges.len()),
            (nodes, edges),
            "{name}"
        );
        assert_eq!(graph.node_outside_frame("map"), None, "{name}");
        // all are drawn with coordinates that join their nodes
        for line in graph.lines() {
            let edge = graph
                .edges
                .iter()
                .find(|e| e.id == line.id)
                .expect("the edge");
            assert_eq!(edge.polyline.as_deref(), Some(&*line.points), "{name}");
        }
        let again = graph.to_geojson().expect("written");
        let again = RouteGraph::from_geojson(&again, &ReadLimits::default()).expect("read back");
        assert_eq!(again, graph, "{name}");
    }
}

#[test]
fn nav2s_sample_keeps_cost_metadata_and_operations() {
    let graph = RouteGraph::load(&nav2("sample_graph.geojson"), &ReadLimits::default());
    let graph = graph.expect("the sample");
    let edge = graph.edges.iter().find(|e| e.id == 9).expect("edge 9");
    assert_eq!((edge.start, edge.end), (0, 1));
    assert_eq!((edge.cost, edge.overridable), (Some(10.0), Some(false)));
    assert!(
        edge.metadata
            .as_ref()
            .is_some_and(|m| m.contains("aisle_number"))
    );
    assert!(
        edge.operations
            .as_ref()
            .is_some_and(|o| o.contains("open_door"))
    );
    assert!(
        graph.nodes[0]
            .metadata
            .as_ref()
            .is_some_and(|m| m.contains("living_room"))
    );
    assert_eq!(graph.nodes[0].frame.as_deref(), Some("map"));
}

#[test]
fn one_clear_line_for_each_fault() {
    let edge = |more: &str| with_edge(&format!(r#""id":2,"startid":0,"endid":1{more}"#), LINE);
    let node = |properties: &str, coordinates: &str| {
        collection(&format!(
            r#"{{"properties":{properties},"geometry":{{"type":"Point","coordinates":{coordinates}}}}}"#
        ))
    };
    let line = |coordinates: &str| {
        let geometry = format!(r#"{{"type":"MultiLineString","coordinates":{coordinates}}}"#);
        with_edge(r#""id":2,"startid":0,"endid":1"#, &geometry)
    };
    let cases = [
        ("".to_owned(), "EOF while parsing a value"),
        (
            "[]".to_owned(),
            "invalid type: sequence, expected a GeoJSON FeatureCollection",
        ),
        (
            "{}".to_owned(),
            "features: expected a list of features, found nothing",
        ),
        (
            r#"{"features":7}"#.to_owned(),
            "invalid type: integer `7`, expected `features` to be a list",
        ),
        (
            r#"{"type":"Feature","features":[]}"#.to_owned(),
            "type: expected \"FeatureCollection\", found \"Feature\"",
        ),
        (
            r#"{"features":[],"features":[]}"#.to_owned(),
            "features: expected one list of features, found a second one",
        ),
        (
            collection("3"),
            "feature 0: invalid type: integer `3`, expected a feature object",
        ),
        (
            collection("{}"),
            "feature 0: geometry: expected an object, found nothing",
        ),
        (
            collection(r#"{"geometry":{}}"#),
            "feature 0: geometry.type: expected the name of a geometry, found nothing",
        ),
        (
            collection(r#"{"geometry":{"type":"Point","coordinates":[1,2]}}"#),
            "feature 0: properties: expected an object, found nothing",
        ),
        (
            node("{}", "[1,2]"),
            "feature 0: id: expected an unsigned integer below 2^32, found nothing",
        ),
        (
            node(r#"{"id":-1}"#, "[1,2]"),
            "feature 0: id: expected an unsigned integer below 2^32, found -1",
        ),
        (
            node(r#"{"id":1.5}"#, "[1,2]"),
            "feature 0: id: expected an unsigned integer below 2^32, found 1.5",
        ),
        (
            node(r#"{"id":4294967296}"#, "[1,2]"),
            "feature 0: id: expected an unsigned integer below 2^32, found 4294967296",
        ),
        (
            node(r#"{"id":"a\u001b[31m"}"#, "[1,2]"),
            "feature 0: id: expected an unsigned integer below 2^32, found \"a\\u{1b}[31m\"",
        ),
        (
            node(r#"{"id":1,"id":2}"#, "[1,2]"),
            "feature 0: `id` is there twice",
        ),
        (
            node(r#"{"id":1,"frame":null}"#, "[1,2]"),
            "feature 0: frame: expected the name of a frame, found null",
        ),
        (
            node(r#"{"id":1}"#, "[1]"),
            "feature 0: geometry.coordinates: expected [x, y], two finite numbers, found a position of one number",
        ),
        (
            node(r#"{"id":1}"#, "[]"),
            "feature 0: geometry.coordinates: expected [x, y], two finite numbers, found an empty list",
        ),
        (
            node(r#"{"id":1}"#, "[[1,2]]"),
            "feature 0: geometry.coordinates: expected [x, y], two finite numbers, found a list of positions",
        ),
        (
            node(r#"{"id":1}"#, r#"[1,"2"]"#),
            "feature 0: geometry.coordinates: expected [x, y], two finite numbers, found \"2\"",
        ),
        (
            node(r#"{"id":1}"#, "[1,null]"),
            "feature 0: geometry.coordinates: expected [x, y], two finite numbers, found null",
        ),
        (node(r#"{"id":1}"#, "[1,NaN]"), "feature 0: expected value"),
        (
            node(r#"{"id":1}"#, "[1,1e999]"),
            "feature 0: number out of range",
        ),
        (
            collection(&format!("{NODE_0},{NODE_1},{NODE_0}")),
            "feature 2: id: expected an id that no other node has, found 0",
        ),
        (
            edge(r#","cost":-0.5"#),
            "feature 2: cost: expected a number >= 0, found -0.5",
        ),
        (
            edge(r#","cost":null"#),
            "feature 2: cost: expected a number >= 0, found null",
        ),
        (
            edge(r#","clearance":"wide""#),
            "feature 2: clearance: expected a number >= 0, found \"wide\"",
        ),
        (
            edge(r#","overridable":1"#),
            "feature 2: overridable: expected true or false, found 1",
        ),
        (
            edge(r#","metadata":[1]"#),
            "feature 2: metadata: expected an object, found a list",
        ),
        (
            edge(r#","operations":"stop""#),
            "feature 2: operations: expected a list or object, found \"stop\"",
        ),
        (
            with_edge(r#""id":2,"startid":7,"endid":1"#, LINE),
            "feature 2: startid: expected the id of a node, found 7",
        ),
        (
            with_edge(r#""id":2,"startid":0,"endid":9"#, LINE),
            "feature 2: endid: expected the id of a node, found 9",
        ),
        (
            with_edge(r#""id":2,"startid":0"#, LINE),
            "feature 2: endid: expected an unsigned integer below 2^32, found nothing",
        ),
        (
            line("[1,2]"),
            "feature 2: geometry.coordinates: expected lists of positions [x, y], found one position",
        ),
        (
            line("[[[1,2],[3,4]],[5,6]]"),
            "feature 2: geometry.coordinates: expected lists of positions [x, y], found positions nested 2 to 3 deep",
        ),
        (
            line("[[1,2],{}]"),
            "feature 2: geometry.coordinates: expected lists of positions [x, y], found an object",
        ),
        (
            line("[[1,2],[[]],[1,2,[]]]"),
            "feature 2: geometry.coordinates: expected lists of positions [x, y], found a position that is not numbers",
        ),
        (format!("{} x", collection("")), "trailing characters"),
    ];
    for (text, expected) in cases {
        let error = read(&text).expect_err(&text).to_string();
        // the JSON parser's own messages end in line and column
        let (what, _place) = error.split_once(" at line ").unwrap_or((&error, ""));
        assert_eq!(what, expected, "{text}");
    }
    let twice = format!(
        "{NODE_0},{NODE_1},{0},{0}",
        r#"{"properties":{"id":5,"startid":0,"endid":1},"geometry":{"type":"LineString"}}"#
    );
    let error = read(&collection(&twice))
        .expect_err("an edge twice")
        .to_string();
    assert_eq!(
        error,
        "feature 3: id: expected an id that no other edge has, found 5"
    );
}

#[test]
fn what_nav2_takes_is_taken() {
    // edges before nodes, other geometries, keys of others, heights, a byte order mark, and no coordinates
    let text = format!(
        "\u{feff}{}",
        collection(&format!(
            r#"{{"id":"x","type":"Feature","properties":{{"id":7,"startid":1,"endid":0,"name":"aisle"}},"geometry":{{"type":"MultiLineString"}}}},
               {{"properties":{{}},"geometry":{{"type":"Polygon","coordinates":[[[[0,"a"]]]]}}}},
               {{"properties":{{"id":8,"startid":0,"endid":1}},"geometry":{{"coordinates":[[0,1,9],[2,3,9]],"bbox":[1],"type":"LineString"}}}},
               {NODE_1},{NODE_0}"#
        ))
    );
    let graph = read(&text).expect("a graph");
    assert_eq!((graph.nodes.len(), graph.edges.len()), (2, 2));
    assert_eq!(graph.edges[0].polyline, None);
    let line = graph.lines().next().expect("an edge");
    let straight = [Point2::new(1.5, 2.0), Point2::new(0.5, -1.0)];
    assert_eq!(&*line.points, straight);
    // a drawing that does not join its nodes is joined to them
    let line = graph.lines().nth(1).expect("an edge");
    let joined = [(0.5, -1.0), (0.0, 1.0), (2.0, 3.0), (1.5, 2.0)].map(|(x, y)| Point2::new(x, y));
    assert_eq!(&*line.points, joined);
    let chord = graph.chords().nth(1).expect("an edge");
    assert_eq!(&*chord.points, [joined[0], joined[3]]);
    // Nav2 refuses these two; there is nothing wrong in them
    assert_eq!(
        read(&collection("")).expect("no node"),
        RouteGraph::default()
    );
    assert_eq!(read(&collection(NODE_0)).expect("no edge").nodes.len(), 1);
    // a node and an edge of one id
    read(&with_edge(r#""id":0,"startid":0,"endid":1"#, LINE)).expect("shared id");
}

#[test]
fn limits_hold() {
    let text = with_edge(r#""id":2,"startid":0,"endid":1"#, LINE);
    let limits = |bytes, nodes, edges| {
        let limits = ReadLimits {
            bytes,
            nodes,
            edges,
        };
        RouteGraph::from_geojson(text.as_bytes(), &limits).map_err(|error| error.to_string())
    };
    assert!(limits(text.len() as u64, 2, 1).is_ok());
    for (outcome, expected) in [
        (limits(100, 2, 1), "file: expected at most 100, found more"),
        (
            limits(10_000, 1, 1),
            "nodes: expected at most 1, found more",
        ),
        (
            limits(10_000, 2, 0),
            "edges: expected at most 0, found more",
        ),
    ] {
        assert_eq!(outcome.expect_err("too large"), expected);
    }
    let endless = RouteGraph::load(
        std::path::Path::new("/dev/zero"),
        &ReadLimits {
            bytes: 1 << 20,
            ..ReadLimits::default()
        },
    );
    assert_eq!(
        endless.expect_err("endless").to_string(),
        "file: expected at most 1048576, found more"
    );
}

#[test]
fn deep_nesting_and_long_text_are_refused_at_once() {
    let deep = "[".repeat(2_000_000);
    let start = std::time::Instant::now();
    for text in [
        deep.clone(),
        collection(&deep),
        collection(&format!(r#"{{"geometry":{{"coordinates":{deep}"#)),
        collection(&format!(r#"{{"properties":{{"metadata":{deep}"#)),
        collection(&format!(r#"{{"properties":{{"id":{deep}"#)),
        collection(&format!(r#"{{"other":{deep}"#)),
        format!(r#"{{"other":{deep}"#),
    ] {
        let error = read(&text).expect_err("deep").to_string();
        assert!(error.len() < 300 && !error.contains('\n'), "{error}");
    }
    let long = "x".repeat(2_000_000);
    for text in [
        collection(&format!(r#""{long}""#)),
        collection(&format!(r#"{{"properties":"{long}"}}"#)),
        with_edge(&format!(r#""id":"{long}""#), LINE),
    ] {
        let error = read(&text).expect_err("long").to_string();
        assert!(error.len() < 300, "{} bytes", error.len());
    }
    assert!(start.elapsed().as_secs_f64() < 2.0, "{:?}", start.elapsed());
}

/// A graph such as the builder makes, with numbers that are no round decimals.
fn random_roadmap(random: &mut Random) -> VoronoiGraph {
    let origin = Pose2::new(
        random.unit() * 30.0 - 15.0,
        random.unit() - 7.0,
        random.unit(),
    );
    let resolution = [0.05, 0.1, 0.025, 1.0 / 3.0][random.below(4)];
    let frame = MapFrame::new(300, 200, resolution, origin).expect("a frame");
    let cell = |random: &mut Random| Cell::new(random.below(300) as u32, random.below(200) as u32);
    let kinds = [
        NodeKind::Junction,
        NodeKind::End,
        NodeKind::Loop,
        NodeKind::Isolated,
        NodeKind::Bridge,
    ];
    let nodes: Vec<Node> = (0..1 + random.below(30))
        .map(|_| {
            let cell = cell(random);
            Node {
                cell,
                point: frame.center_of(cell),
                clearance: random.unit() * 3.0,
                kind: kinds[random.below(5)],
            }
        })
        .collect();
    let arcs = (0..random.below(50))
        .map(|_| {
            let (from, to) = (random.below(nodes.len()), random.below(nodes.len()));
            let mut polyline = vec![nodes[from].point];
            polyline.extend((0..random.below(20)).map(|_| frame.center_of(cell(random))));
            polyline.push(nodes[to].point);
            Arc {
                from,
                to,
                length: polyline.windows(2).map(|p| p[0].distance(p[1])).sum(),
                clearance: random.unit() / 3.0,
                width_profile: polyline
                    .iter()
                    .map(|_| random.unit() as f32 / 3.0)
                    .collect(),
                bottleneck: polyline[random.below(polyline.len())],
                nearest_obstacle: Point2::new(-random.unit() * 1e-9, random.unit() * 1e9),
                polyline,
            }
        })
        .collect();
    VoronoiGraph {
        frame,
        radius: random.unit(),
        nodes,
        arcs,
    }
}

#[test]
fn a_saved_roadmap_loads_back_equal() {
    let mut random = Random::new(5);
    for round in 0..if crate::long() { 5000 } else { 300 } {
        let graph = random_roadmap(&mut random);
        let bytes = RouteGraph::from_voronoi(&graph)
            .to_geojson()
            .expect("written");
        let route = RouteGraph::from_geojson(&bytes, &ReadLimits::default()).expect("read");
        assert_eq!(
            route.to_voronoi().expect("a roadmap"),
            graph,
            "round {round}"
        );
        assert_eq!(
            route.to_geojson().expect("written"),
            bytes,
            "the same bytes again"
        );
    }
}

#[test]
fn every_arc_is_two_directed_edges_with_ids_of_their_own() {
    let mut random = Random::new(8);
    let graph = random_roadmap(&mut random);
    let route = RouteGraph::from_voronoi(&graph);
    assert_eq!(route.edges.len(), 2 * graph.arcs.len());
    let mut ids: Vec<u32> = route.nodes.iter().map(|n| n.id).collect();
    ids.extend(route.edges.iter().map(|e| e.id));
    let count = ids.len();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), count);
    for (arc, pair) in graph.arcs.iter().zip(route.edges.chunks(2)) {
        let [there, back] = pair else { unreachable!() };
        assert_eq!((there.start, there.end), (back.end, back.start));
        assert_eq!(
            (there.start as usize, there.end as usize),
            (arc.from, arc.to)
        );
        assert_eq!(there.polyline.as_ref(), Some(&arc.polyline));
        let mut reversed = arc.polyline.clone();
        reversed.reverse();
        assert_eq!(back.polyline.as_ref(), Some(&reversed));
        for edge in pair {
            assert_eq!(edge.clearance, Some(arc.clearance));
            assert_eq!(edge.cost, Some(arc.length));
        }
    }
}

#[test]
fn a_roadmap_that_was_changed_is_refused() {
    let mut random = Random::new(21);
    let graph = loop {
        let graph = random_roadmap(&mut random);
        if graph.arcs.len() > 2 {
            break graph;
        }
    };
    let good = RouteGraph::from_voronoi(&graph);
    let refused = |change: &dyn Fn(&mut RouteGraph)| {
        let mut route = good.clone();
        change(&mut route);
        route.to_voronoi().expect_err("changed").to_string()
    };
    let messages = [
        refused(&|r| r.voronoi = None),
        refused(&|r| r.nodes[0].voronoi = None),
        refused(&|r| r.nodes[0].voronoi = Some(r#"{"kind":"tree"}"#.into())),
        refused(&|r| r.nodes.truncate(0)),
        refused(&|r| r.edges[0].clearance = None),
        refused(&|r| r.edges[0].polyline = None),
        refused(&|r| r.edges[0].voronoi = Some("{}".into())),
        refused(&|r| r.edges.swap(1, 3)),
        refused(&|r| {
            let line = r.edges[0].polyline.as_mut().expect("a line");
            line[0].x += 1e-9;
        }),
        refused(&|r| {
            let line = r.edges[0].polyline.as_mut().expect("a line");
            line.insert(1, Point2::new(0.0, 0.0));
        }),
    ];
    for message in messages {
        assert!(
            message.contains(": expected ") && !message.contains('\n'),
            "{message}"
        );
    }
    // drawn by others: no roadmap, said so
    let drawn = RouteGraph {
        nodes: vec![RouteNode::default()],
        edges: vec![RouteEdge::default()],
        voronoi: None,
    };
    assert_eq!(
        drawn.to_voronoi().expect_err("drawn").to_string(),
        "voronoi_plan: expected the frame and radius of a saved roadmap, found a route graph without"
    );
}

#[test]
fn what_is_not_finite_is_not_written() {
    let node = RouteNode {
        point: Point2::new(f64::NAN, 0.0),
        ..RouteNode::default()
    };
    let graph = RouteGraph {
        nodes: vec![node],
        ..RouteGraph::default()
    };
    let error = graph.to_geojson().expect_err("NaN").to_string();
    assert_eq!(
        error,
        "node 0: coordinates: expected finite numbers, found NaN"
    );
    for (cost, clearance, polyline) in [
        (Some(f64::INFINITY), None, None),
        (None, Some(f64::NAN), None),
        (None, None, Some(vec![Point2::new(0.0, f64::INFINITY)])),
    ] {
        let edge = RouteEdge {
            cost,
            clearance,
            polyline,
            ..RouteEdge::default()
        };
        let graph = RouteGraph {
            nodes: vec![RouteNode::default()],
            edges: vec![edge],
            voronoi: None,
        };
        graph.to_geojson().expect_err("not finite");
    }
}
