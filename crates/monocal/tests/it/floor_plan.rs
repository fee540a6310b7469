//! Floor plans derived from maps: real ones with known doors, drawn ones with known walls, hostile ones.

use std::collections::BTreeSet;
use std::path::PathBuf;

use monocal::{DeriveParams, Doorway, FloorPlan};
use occgrid::{Cell, LoadOptions, MapFrame, OccupancyMap, Point2, Pose2, load_map};

fn testdata(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../testdata")
        .join(name)
}

/// A map of `side` x `side` cells, occupied where `occupied` says so of a cell's centre.
fn drawn(side: u32, resolution: f64, occupied: impl Fn(Point2) -> bool) -> OccupancyMap {
    let frame = MapFrame::new(side, side, resolution, Pose2::default()).expect("a frame");
    let cells = (0..side * side).map(|i| Cell::new(i % side, i / side));
    let values = cells.map(|cell| 100 * i8::from(occupied(frame.center_of(cell))));
    OccupancyMap::new(frame, values.collect(), 25, 65)
}

/// The doors that the building's users wrote down on its map: corners in pairs, clicked by hand.
fn real_doors() -> Vec<[Point2; 2]> {
    let text =
        std::fs::read_to_string(testdata("maps/utexas_gdc/real-3/doors.yaml")).expect("doors");
    let corners = text.lines().filter_map(|line| {
        let (_, list) = line
            .trim()
            .strip_prefix("door_corner_pt_")?
            .split_once('[')?;
        let (x, y) = list.trim_end_matches(']').split_once(',')?;
        Some(Point2::new(x.trim().parse().ok()?, y.trim().parse().ok()?))
    });
    let corners: Vec<Point2> = corners.collect();
    corners
        .chunks_exact(2)
        .map(|pair| [pair[0], pair[1]])
        .collect()
}

/// How far a point is from a segment.
fn from_segment(p: Point2, [a, b]: [Point2; 2]) -> f64 {
    let length = a.distance(b);
    let t = ((p.x - a.x) * (b.x - a.x) + (p.y - a.y) * (b.y - a.y)) / (length * length);
    let t = t.clamp(0.0, 1.0);
    p.distance(Point2::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)))
}

/// Of the 35 doors that people marked on a building's map, 26 are at most 1.4 m wide as they marked them. The list leaves
/// out doors that its robots did not use, and the openings in the partitions of open offices, which a map cannot tell
/// from doors: what stands against the list is more than what is wrong.
#[test]
fn real_doors_are_the_likeliest_doorways() {
    let map = load_map(
        testdata("maps/utexas_gdc/real-3/3.yaml"),
        &LoadOptions::default(),
    );
    let map = map.expect("the map").map;
    let doors = real_doors();
    let narrow = doors.iter().filter(|[a, b]| a.distance(*b) < 1.401);
    assert_eq!((doors.len(), narrow.count()), (35, 26));
    let middle = |[a, b]: &[Point2; 2]| Point2::new(0.5 * (a.x + b.x), 0.5 * (a.y + b.y));
    let marked = |d: &Doorway| {
        let at = |door: &[Point2; 2]| {
            d.faces
                .iter()
                .any(|f| from_segment(middle(f), *door) < 0.35)
        };
        doors.iter().position(at)
    };
    for (door_max, [most, fewest]) in [(1.4, [40, 17]), (2.0, [62, 21])] {
        let params = DeriveParams {
            door_max,
            ..DeriveParams::default()
        };
        let (plan, doorways) = FloorPlan::with_doorways(&map, &params);
        let kept = doorways
            .iter()
            .filter(|d| d.confidence >= params.least_confidence);
        let kept: Vec<&Doorway> = kept.collect();
        let found: BTreeSet<usize> = kept.iter().filter_map(|d| marked(d)).collect();
        println!(
            "up to {door_max} m: {} doorways of {}, at {} marked doors",
            kept.len(),
            doorways.len(),
            found.len()
        );
        assert!(kept.len() <= most, "{}", kept.len());
        assert!(found.len() >= fewest, "{}", found.len());
        let corners = kept.iter().map(|d| 2 * d.faces.len()).sum::<usize>();
        assert_eq!(plan.door_corners.len(), corners);
        assert!(doorways.is_sorted_by(|a, b| a.confidence >= b.confidence));
    }
}

/// Between shelves in the middle of a room one may walk round: no doorway. Across a corridor's end neither.
#[test]
fn gaps_that_part_nothing_are_no_doorways() {
    let rim = |p: Point2| p.x < 0.5 || p.x > 9.5 || p.y < 0.5 || p.y > 9.5;
    let shelves = |p: Point2| {
        (4.9..5.1).contains(&p.y) && ((3.5..4.6).contains(&p.x) || (5.5..6.6).contains(&p.x))
    };
    let map = drawn(200, 0.05, |p| rim(p) || shelves(p));
    let plan = FloorPlan::from_map(&map, &DeriveParams::default());
    assert!(plan.door_corners.is_empty(), "{:?}", plan.door_corners);
    // a corridor 1.2 m wide that opens into a hall
    let blocks = |p: Point2| p.x < 5.0 && !(4.4..5.6).contains(&p.y);
    let map = drawn(200, 0.05, |p| rim(p) || blocks(p));
    let plan = FloorPlan::from_map(&map, &DeriveParams::default());
    assert!(plan.door_corners.is_empty(), "{:?}", plan.door_corners);
}

/// A wall face at any angle is placed to a fifth of a cell, its direction to 0.2 degrees.
#[test]
fn walls_are_placed_below_the_cell() {
    for degrees in [0.0_f64, 3.0, 17.0, 30.0, 45.0, 61.0, 88.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let across = |p: Point2| -sin * (p.x - 5.0) + cos * (p.y - 5.0);
        let map = drawn(200, 0.05, |p| across(p).abs() < 0.503);
        let plan = FloorPlan::from_map(&map, &DeriveParams::default());
        assert_eq!(
            plan.walls.len(),
            2,
            "one a face at {degrees} degrees: {:?}",
            plan.walls
        );
        for [a, b] in plan.walls {
            assert!(a.distance(b) > 8.0);
            let (da, db) = (across(a), across(b));
            let slope = (da - db).abs() / a.distance(b);
            assert!(
                (da.abs() - 0.503).abs().max((db.abs() - 0.503).abs()) < 0.02,
                "{da} {db}"
            );
            assert!(slope < 0.2_f64.to_radians(), "{slope}");
        }
    }
}

/// Where the map is graded, the face is where the occupancy crosses one half.
#[test]
fn graded_cells_place_walls_inside_the_cell() {
    for face in [1.01_f64, 1.02, 1.03, 1.04] {
        let frame = MapFrame::new(60, 60, 0.05, Pose2::default()).expect("a frame");
        let cells = (0..3600).map(|i| Cell::new(i % 60, i / 60));
        let values = cells.map(|cell| {
            let share = (face - frame.center_of(cell).x) / 0.05;
            (50.0 + 50.0 * share.clamp(-1.0, 1.0)) as i8
        });
        let map = OccupancyMap::new(frame, values.collect(), 49, 50);
        let plan = FloorPlan::from_map(&map, &DeriveParams::default());
        assert_eq!(plan.walls.len(), 1);
        for end in plan.walls[0] {
            assert!((end.x - face).abs() < 0.002, "{} for {face}", end.x);
        }
    }
}

/// Two rooms and a wall with one doorway: four corners, two a face; a window's width is no door.
#[test]
fn a_doorway_gives_its_corners_on_both_faces() {
    let wall = |p: Point2| {
        (4.9..5.1).contains(&p.y) && !(3.0..3.9).contains(&p.x) && !(7.0..7.3).contains(&p.x)
    };
    let rim = |p: Point2| p.x < 0.5 || p.x > 9.5 || p.y < 0.5 || p.y > 9.5;
    let map = drawn(200, 0.05, |p| wall(p) || rim(p));
    let plan = FloorPlan::from_map(&map, &DeriveParams::default());
    assert_eq!(plan.door_corners.len(), 4, "{:?}", plan.door_corners);
    for truth in [(3.0, 4.9), (3.9, 4.9), (3.0, 5.1), (3.9, 5.1)] {
        let truth = Point2::new(truth.0, truth.1);
        let nearest = plan.door_corners.iter().map(|c| c.distance(truth));
        assert!(
            nearest.fold(f64::INFINITY, f64::min) < 0.03,
            "{truth:?}: {:?}",
            plan.door_corners
        );
    }
}

/// Maps that are all boundary, or none: bounded time, no panic.
#[test]
fn hostile_maps_end() {
    let check = |p: Point2, size: f64| ((p.x / size) as i64 + (p.y / size) as i64) % 2 == 0;
    for (side, size) in [(1, 0.05), (2, 0.05), (513, 0.05), (512, 0.1), (512, 0.25)] {
        let map = drawn(side, 0.05, |p| check(p, size));
        let plan = FloorPlan::from_map(&map, &DeriveParams::default());
        assert!(
            plan.walls
                .iter()
                .flatten()
                .all(|p| p.x.is_finite() && p.y.is_finite())
        );
    }
    let noise = drawn(512, 0.05, |p| {
        ((p.x * 7919.0).sin() * 43_758.545).fract().abs() < (p.y * 91.7).sin().abs()
    });
    let _ = FloorPlan::from_map(&noise, &DeriveParams::default());
    for empty in [true, false] {
        let map = drawn(64, 0.05, |_| empty);
        assert!(
            FloorPlan::from_map(&map, &DeriveParams::default())
                .walls
                .is_empty()
        );
    }
}

#[cfg(feature = "files")]
mod files {
    use super::*;

    #[test]
    fn a_plan_survives_its_file() {
        let map = load_map(testdata("maps/nav2/depot.yaml"), &LoadOptions::default());
        let plan = FloorPlan::from_map(&map.expect("the map").map, &DeriveParams::default());
        assert!(plan.walls.len() > 10);
        assert_eq!(FloorPlan::from_geojson(&plan.to_geojson()), Ok(plan));
    }

    #[test]
    fn hand_drawn_plans_are_read() {
        let text = r#"{"type": "FeatureCollection", "name": "x", "crs": {}, "features": [
            {"type": "Feature", "properties": {"kind": "wall"}, "geometry": {"type": "LineString", "coordinates": [[0, 0], [1, 0, 5], [1, 0], [1, 2]]}},
            {"type": "Feature", "properties": {"kind": "wall", "colour": 3}, "geometry": {"type": "MultiLineString", "coordinates": [[[0, 0], [-1, 0]]]}},
            {"type": "Feature", "properties": {"kind": "label"}, "geometry": null},
            {"type": "Feature", "properties": null, "geometry": {"type": "Polygon", "coordinates": []}},
            {"type": "Feature", "properties": {"kind": "door_corner"}, "geometry": {"type": "Point", "coordinates": [0.5, 0]}}]}"#;
        let plan = FloorPlan::from_geojson(text).expect("a plan");
        assert_eq!(plan.walls.len(), 3);
        assert_eq!(plan.door_corners, [Point2::new(0.5, 0.0)]);
    }

    #[test]
    fn what_is_wrong_is_said_in_one_line() {
        let feature = |kind: &str, geometry: &str| {
            format!(
                r#"{{"type": "FeatureCollection", "features": [{{"properties": {{"kind": "{kind}"}}, "geometry": {geometry}}}]}}"#
            )
        };
        let cases = [
            (
                String::new(),
                "expected a GeoJSON FeatureCollection, found EOF",
            ),
            ("[]".into(), "expected a GeoJSON FeatureCollection, found"),
            (
                r#"{"type": "Feature", "features": []}"#.into(),
                "found type \"Feature\"",
            ),
            (
                r#"{"type": "FeatureCollection", "features": []}"#.into(),
                "found none",
            ),
            (
                feature("wall", r#"{"type": "Point", "coordinates": [0, 0]}"#),
                "feature 0: geometry: expected a LineString",
            ),
            (feature("wall", "null"), "feature 0: geometry"),
            // found by fuzzing: what is quoted may hold any character
            (
                feature(
                    "wall",
                    r#"{"type": "LineS\rin\ng", "coordinates": [[5, 0], [1, 2]]}"#,
                ),
                r"found LineS\rin\ng",
            ),
            (
                feature(
                    "wall",
                    "{\"type\": \"LineString\", \"coordinates\": [[5,\n\t\"0\"],\r [1, 2]]}",
                ),
                r#"found [[5,\n\t"0"],\r [1, 2]]"#,
            ),
            (
                feature("wall", r#"{"type": "LineString"}"#),
                "feature 0: coordinates",
            ),
            (
                feature("wall", r#"{"type": "LineString", "coordinates": [[0, 0]]}"#),
                "two points or more",
            ),
            (
                feature(
                    "wall",
                    r#"{"type": "LineString", "coordinates": [[0, 0], [1e300, 0]]}"#,
                ),
                "within 1000 km",
            ),
            (
                feature("door_corner", r#"{"type": "Point", "coordinates": [0]}"#),
                "within 1000 km",
            ),
            (
                feature(
                    "door_corner",
                    r#"{"type": "Point", "coordinates": ["a", null]}"#,
                ),
                "expected [x, y]",
            ),
        ];
        for (text, part) in cases {
            let message = FloorPlan::from_geojson(&text).expect_err(&text).to_string();
            assert!(
                message.contains(part) && !message.chars().any(char::is_control),
                "{message} for {text}"
            );
        }
        let deep = "[".repeat(100_000);
        assert!(FloorPlan::from_geojson(&deep).is_err());
    }
}
