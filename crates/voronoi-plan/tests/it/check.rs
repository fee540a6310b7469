//! The verifier against the definition, computed the slow way, and against planted faults.

use std::borrow::Cow;

use crate::random::Random;
use occgrid::{Cell, CellState, GridPoint, MapFrame, OccupancyMap, Point2, Pose2};
use proptest::prelude::*;
use voronoi_plan::check::{CheckParams, ClearanceProbe, EdgeLine, UnknownIs, check, tolerance};

const FREE: i8 = 0;
const UNKNOWN: i8 = -1;
const OCCUPIED: i8 = 100;

fn map_of(frame: MapFrame, values: Vec<i8>) -> OccupancyMap {
    OccupancyMap::new(frame, values, 25, 65)
}

fn plain_frame(width: u32, height: u32) -> MapFrame {
    MapFrame::new(width, height, 1.0, Pose2::default()).expect("a frame")
}

/// A map of 1 m cells from a picture: `.` free, `#` occupied, `?` unknown.
fn map_from(rows: &[&str]) -> OccupancyMap {
    let values = rows
        .iter()
        .flat_map(|row| row.bytes())
        .map(|byte| match byte {
            b'.' => FREE,
            b'#' => OCCUPIED,
            _ => UNKNOWN,
        })
        .collect();
    map_of(plain_frame(rows[0].len() as u32, rows.len() as u32), values)
}

/// Grid coordinates (x right, y down) as a point of the map frame.
fn grid(map: &OccupancyMap, x: f64, y: f64) -> Point2 {
    map.frame().map_from_grid(GridPoint { col: x, row: y })
}

type P = (f64, f64);

/// Distance of two segments by definition of the minimum: 0 if they properly cross, else from an end.
fn segments_apart(a: P, b: P, c: P, d: P) -> f64 {
    let cross = |o: P, p: P, q: P| (p.0 - o.0) * (q.1 - o.1) - (p.1 - o.1) * (q.0 - o.0);
    let (s1, s2) = (cross(a, b, c), cross(a, b, d));
    let (s3, s4) = (cross(c, d, a), cross(c, d, b));
    if s1 * s2 < 0.0 && s3 * s4 < 0.0 {
        return 0.0;
    }
    let to_segment = |p: P, q: P, r: P| {
        let (dx, dy) = (r.0 - q.0, r.1 - q.1);
        let n = dx * dx + dy * dy;
        let t = if n == 0.0 {
            0.0
        } else {
            (((p.0 - q.0) * dx + (p.1 - q.1) * dy) / n).clamp(0.0, 1.0)
        };
        (p.0 - q.0 - t * dx).hypot(p.1 - q.1 - t * dy)
    };
    to_segment(a, c, d)
        .min(to_segment(b, c, d))
        .min(to_segment(c, a, b))
        .min(to_segment(d, a, b))
}

/// Clearance [cells] of a line given in grid coordinates: every not-free cell, every side of it.
fn slow_clearance(map: &OccupancyMap, line: &[P], unknown: UnknownIs) -> f64 {
    let (width, height) = (map.frame().width(), map.frame().height());
    let mut least = f64::INFINITY;
    for &(x, y) in line {
        let margin = x
            .min(y)
            .min(f64::from(width) - x)
            .min(f64::from(height) - y);
        least = least.min(margin.max(0.0));
    }
    let pairs: Vec<(P, P)> = if line.len() == 1 {
        vec![(line[0], line[0])]
    } else {
        line.windows(2).map(|pair| (pair[0], pair[1])).collect()
    };
    for row in 0..height {
        for col in 0..width {
            match map.state(Cell { col, row }) {
                CellState::Free => continue,
                CellState::Unknown if unknown == UnknownIs::Free => continue,
                _ => {}
            }
            let (x, y) = (f64::from(col), f64::from(row));
            let ring = [(x, y), (x + 1.0, y), (x + 1.0, y + 1.0), (x, y + 1.0)];
            for &(a, b) in &pairs {
                if (x..=x + 1.0).contains(&a.0) && (y..=y + 1.0).contains(&a.1) {
                    least = 0.0;
                }
                for side in 0..4 {
                    least = least.min(segments_apart(a, b, ring[side], ring[(side + 1) % 4]));
                }
            }
        }
    }
    least
}

fn line<'a>(id: u32, points: Vec<Point2>, claim: Option<f64>) -> EdgeLine<'a> {
    EdgeLine {
        id,
        points: Cow::Owned(points),
        claim,
    }
}

fn at_radius(radius: f64) -> CheckParams {
    CheckParams {
        radius,
        unknown: UnknownIs::Occupied,
    }
}

/// A random map: mostly free, sizes around the block sizes of 8 and 64.
fn random_map(random: &mut Random) -> OccupancyMap {
    const SIDES: [u32; 14] = [1, 2, 3, 7, 8, 9, 15, 16, 17, 31, 63, 64, 65, 129];
    let width = SIDES[random.below(14)];
    let height = SIDES[random.below(14)].min(4096 / width).max(1);
    let resolution = [0.05, 0.1, 1.0, 0.37][random.below(4)];
    let yaw = [0.0, 0.3, -2.0, std::f64::consts::FRAC_PI_2][random.below(4)];
    let origin = Pose2::new(
        random.unit() * 40.0 - 20.0,
        random.unit() * 40.0 - 20.0,
        yaw,
    );
    let frame = MapFrame::new(width, height, resolution, origin).expect("a frame");
    let density = [0, 5, 50, 300, 1000][random.below(5)];
    let values = (0..frame.cell_count())
        .map(|_| match random.below(1000) {
            n if n < density => [OCCUPIED, UNKNOWN, 65, 26][random.below(4)],
            _ => [FREE, 25, 7][random.below(3)],
        })
        .collect();
    map_of(frame, values)
}

/// A random line in grid coordinates: anywhere, on half cells, along borders, through corners, a point.
fn random_line(random: &mut Random, width: f64, height: f64) -> Vec<P> {
    let count = 1 + random.below(4);
    let snap = [0.0, 1.0, 2.0][random.below(3)];
    let mut points: Vec<P> = (0..count)
        .map(|_| {
            let p = (random.unit() * width, random.unit() * height);
            if snap > 0.0 {
                ((p.0 * snap).round() / snap, (p.1 * snap).round() / snap)
            } else {
                p
            }
        })
        .collect();
    match random.below(6) {
        0 => points[count - 1].0 = points[0].0,
        1 => points[count - 1].1 = points[0].1,
        2 => {
            let n = points[count - 1].0 - points[0].0;
            points[count - 1].1 = points[0].1 + n;
        }
        3 => points[count - 1] = points[0],
        _ => {}
    }
    points
}

#[test]
fn equals_the_slow_definition_on_random_maps() {
    let mut random = Random::new(11);
    let rounds = if crate::long() { 30_000 } else { 1_500 };
    let mut zero = 0;
    for round in 0..rounds {
        let map = random_map(&mut random);
        let unknown = [UnknownIs::Occupied, UnknownIs::Free][random.below(2)];
        let probe = ClearanceProbe::new(&map, unknown);
        let frame = *map.frame();
        let (width, height) = (f64::from(frame.width()), f64::from(frame.height()));
        let mut lines = Vec::new();
        let mut truths = Vec::new();
        for id in 0..6 {
            let cells = random_line(&mut random, width, height);
            let points: Vec<Point2> = cells.iter().map(|p| grid(&map, p.0, p.1)).collect();
            let truth = slow_clearance(&map, &cells, unknown) * frame.resolution();
            let found = probe.clearance(&points);
            assert!(
                (found.clearance - truth).abs() <= tolerance(&frame),
                "round {round}: {found:?}, truth {truth}, {cells:?} on {frame:?}"
            );
            let there = frame.grid_from_map(found.at);
            let there = slow_clearance(&map, &[(there.col, there.row)], unknown);
            assert!(
                (there * frame.resolution() - truth).abs() <= 2.0 * tolerance(&frame),
                "round {round}: {there} at {found:?}, truth {truth}"
            );
            zero += usize::from(truth == 0.0);
            truths.push(truth);
            lines.push(line(id, points, None));
        }
        // the same through `check`, where most edges are only bounded
        let radius = random.unit() * 3.0 * frame.resolution();
        let least = truths.iter().copied().fold(f64::INFINITY, f64::min);
        let report = check(lines.clone(), &map, &CheckParams { radius, unknown });
        assert_eq!(report.edges, 6);
        let found = report.min_clearance.expect("six edges");
        assert!(
            (found - least).abs() <= tolerance(&frame),
            "{found} {least}"
        );
        let worst = report.worst_edge.expect("six edges") as usize;
        assert!((truths[worst] - least).abs() <= tolerance(&frame));
        let clear = |t: f64| t >= radius && t > 2.0 * tolerance(&frame);
        let expected = truths.iter().filter(|&&t| !clear(t)).count();
        assert_eq!(report.violations.len(), expected, "{truths:?} {radius}");
        for pair in report.violations.windows(2) {
            assert!(pair[0].clearance <= pair[1].clearance, "worst first");
        }
        for violation in &report.violations {
            let truth = truths[violation.edge as usize];
            assert!((violation.clearance - truth).abs() <= tolerance(&frame));
        }
    }
    // the battery must hold both kinds
    assert!(
        zero > rounds && zero < 5 * rounds,
        "{zero} of {}",
        6 * rounds
    );
}

#[test]
fn along_a_cell_border_touches() {
    let map = map_from(&["........", "........", "...#....", "........", "........"]);
    let probe = ClearanceProbe::new(&map, UnknownIs::Occupied);
    let clearance = |a: P, b: P| {
        probe
            .clearance(&[grid(&map, a.0, a.1), grid(&map, b.0, b.1)])
            .clearance
    };
    for (a, b, expected) in [
        ((1.0, 2.0), (7.0, 2.0), 0.0),            // along its top side
        ((3.0, 1.0), (3.0, 4.0), 0.0),            // along its left side
        ((1.5, 2.5), (2.9, 1.1), 0.5_f64.sqrt()), // diagonal, half a cell's diagonal off the corner
        ((1.0, 4.0), (3.0, 2.0), 0.0),            // ends on its corner
        ((2.0, 3.0), (4.0, 1.0), 0.0),            // diagonal through its corner (3, 2)
        ((2.0, 2.5), (2.0, 2.5), 1.0),            // a point
        ((1.0, 1.0), (7.0, 1.0), 1.0),
        ((5.0, 4.0), (7.0, 4.0), 1.0), // the outside is as near as the cell
        ((2.0, 1.0), (2.0, 1.0), 1.0), // outside 1 away, corner sqrt 2
        ((3.5, 2.5), (3.5, 2.5), 0.0), // inside
    ] {
        let found = clearance(a, b);
        assert!((found - expected).abs() < 1e-12, "{a:?} {b:?}: {found}");
    }
}

#[test]
fn unknown_is_an_obstacle_unless_relaxed_and_the_outside_always_is() {
    let map = map_from(&[
        ".........",
        "....?....",
        ".........",
        ".........",
        ".........",
    ]);
    let edge = || line(7, vec![grid(&map, 1.5, 1.5), grid(&map, 7.5, 1.5)], None);
    let strict = check([edge()], &map, &at_radius(0.4));
    assert_eq!(strict.violations.len(), 1);
    assert_eq!(strict.violations[0].edge, 7);
    let at = map.frame().cell_at(strict.violations[0].at);
    assert_eq!(at, Some(Cell::new(4, 1)), "names a point in the cell");
    let relaxed = CheckParams {
        radius: 0.4,
        unknown: UnknownIs::Free,
    };
    let report = check([edge()], &map, &relaxed);
    assert!(report.is_clean());
    assert!((report.min_clearance.expect("an edge") - 1.5).abs() < 1e-12);
    let out = line(8, vec![grid(&map, 1.5, 1.5), grid(&map, 9.5, 1.5)], None);
    let report = check([out], &map, &relaxed);
    assert_eq!(
        (report.violations.len(), report.min_clearance),
        (1, Some(0.0))
    );
}

#[test]
fn a_claim_above_the_truth_is_found_and_one_at_the_truth_is_not() {
    let map = map_from(&["..........."; 11]);
    let points = vec![grid(&map, 4.5, 5.5), grid(&map, 6.5, 5.5)];
    let truth = 4.5;
    let honest = line(0, points.clone(), Some(truth));
    let boast = line(1, points.clone(), Some(truth + 1e-6));
    let worse = line(2, points.clone(), Some(truth + 1.0));
    let no_number = line(3, points, Some(f64::NAN));
    let report = check([honest, boast, worse, no_number], &map, &at_radius(1.0));
    assert!(report.violations.is_empty());
    let mut edges: Vec<u32> = report.overclaims.iter().map(|o| o.edge).collect();
    assert_eq!(edges.pop().map(|_| edges.len()), Some(2));
    edges.sort_unstable();
    assert!(!edges.contains(&0));
}

#[test]
fn what_is_no_line_has_no_clearance() {
    let map = map_from(&["....."; 5]);
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let mid = grid(&map, 2.5, 2.5);
    let faults = [
        vec![],
        vec![Point2::new(nan, 2.0), mid],
        vec![mid, Point2::new(2.0, inf)],
        vec![Point2::new(1e308, -1e308)],
        vec![mid, Point2::new(-inf, nan), mid],
    ];
    for points in faults {
        let report = check([line(5, points.clone(), None)], &map, &at_radius(0.1));
        assert_eq!(report.violations.len(), 1, "{points:?}");
        let Some(violation) = report.violations.first() else {
            unreachable!()
        };
        assert!(violation.clearance <= 0.0);
        assert!(violation.at.x.is_finite() && violation.at.y.is_finite());
    }
    let nothing = check([], &map, &at_radius(0.1));
    assert_eq!(
        (nothing.edges, nothing.min_clearance, nothing.worst_edge),
        (0, None, None)
    );
}

#[test]
fn touching_is_a_violation_even_at_radius_zero() {
    let map = map_from(&["...", ".#.", "..."]);
    let touch = line(0, vec![grid(&map, 0.5, 1.0), grid(&map, 2.5, 1.0)], None);
    let near = line(1, vec![grid(&map, 0.5, 0.9), grid(&map, 2.5, 0.9)], None);
    let report = check([touch, near], &map, &at_radius(0.0));
    assert_eq!(report.violations.len(), 1);
    assert_eq!(report.worst_edge, Some(0));
}

#[test]
fn large_empty_halls_cost_little() {
    let side = 4096;
    let map = map_of(plain_frame(side, side), vec![FREE; (side * side) as usize]);
    let mut random = Random::new(3);
    let edges: Vec<EdgeLine<'_>> = (0..200_000)
        .map(|id| {
            let (x, y) = (
                1500.0 + 1000.0 * random.unit(),
                1500.0 + 1000.0 * random.unit(),
            );
            line(
                id,
                vec![grid(&map, x, y), grid(&map, x + 5.0, y + 3.0)],
                Some(1.0),
            )
        })
        .collect();
    let start = std::time::Instant::now();
    let report = check(edges, &map, &at_radius(0.3));
    assert!(report.is_clean());
    assert!(report.min_clearance.expect("edges") >= 1495.0);
    // a search of the hall itself would take hours
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
}

proptest! {
    /// The clearance of a line never rises when it is made longer, nor when a cell becomes occupied.
    #[test]
    fn more_line_or_more_obstacle_never_clears(
        seed in 0_u64..1_000_000,
        extra in (0.0_f64..1.0, 0.0_f64..1.0),
    ) {
        let mut random = Random::new(seed);
        let map = random_map(&mut random);
        let (width, height) = (f64::from(map.frame().width()), f64::from(map.frame().height()));
        let cells = random_line(&mut random, width, height);
        let mut points: Vec<Point2> = cells.iter().map(|p| grid(&map, p.0, p.1)).collect();
        let slack = tolerance(map.frame());
        let probe = ClearanceProbe::new(&map, UnknownIs::Occupied);
        let before = probe.clearance(&points).clearance;
        let mut values = map.values().to_vec();
        let hit = random.below(values.len());
        values[hit] = OCCUPIED;
        let fuller = map_of(*map.frame(), values);
        let blocked = ClearanceProbe::new(&fuller, UnknownIs::Occupied);
        prop_assert!(blocked.clearance(&points).clearance <= before + slack);
        points.push(grid(&map, extra.0 * width, extra.1 * height));
        prop_assert!(probe.clearance(&points).clearance <= before + slack);
    }
}
