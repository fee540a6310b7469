//! What the planner answers, on drawn maps and on small random ones.

use morpho::BitImage;
use occgrid::{Cell, MapFrame, Point2, Pose2};
use voronoi_plan::{
    ClearanceField, FreeSpace, GraphParams, Plan, PlanStatus, Planner, VoronoiGraph,
};

use crate::clearance::to_square;
use crate::random::Random;

/// Metres a cell; 1 keeps the drawings readable.
const RESOLUTION: f64 = 1.0;

fn space_of(cells: BitImage, origin: Pose2) -> FreeSpace {
    let (width, height) = (cells.width() as u32, cells.height() as u32);
    FreeSpace::new(
        MapFrame::new(width, height, RESOLUTION, origin).expect("a frame"),
        cells,
    )
}

fn drawn(rows: &[&str]) -> FreeSpace {
    let cells = BitImage::from_fn(rows[0].len(), rows.len(), |x, y| {
        rows[y].as_bytes()[x] == b'.'
    });
    space_of(cells, Pose2::new(2.0, -1.0, 0.0))
}

fn graph_of(space: &FreeSpace, radius: f64) -> VoronoiGraph {
    let params = GraphParams {
        radius,
        ..GraphParams::default()
    };
    VoronoiGraph::build(space, &params).expect("a radius")
}

fn planner(space: &FreeSpace, radius: f64) -> Planner {
    Planner::new(space, &graph_of(space, radius), ClearanceField::new(space))
}

fn center(space: &FreeSpace, col: u32, row: u32) -> Point2 {
    space.frame().center_of(Cell::new(col, row))
}

const TWO_ROOMS: [&str; 9] = [
    "..........#..........",
    "..........#..........",
    "..........#..........",
    "..........#..........",
    ".....................",
    "..........#..........",
    "..........#..........",
    "..........#..........",
    "..........#..........",
];

#[test]
fn a_straight_line_where_it_is_clear() {
    let space = drawn(&TWO_ROOMS);
    let (from, to) = (center(&space, 2, 4), center(&space, 18, 4));
    let Plan::Ok(route) = planner(&space, 0.5).plan(from, to) else {
        panic!("no route");
    };
    assert_eq!(route.points, [from, to]);
    assert!((route.length - 16.0).abs() < 1e-9);
    assert!((route.clearance - 0.5).abs() < 1e-8);
    assert!(route.arcs.is_empty());
}

#[test]
fn a_route_starts_and_ends_exactly_where_asked() {
    let space = drawn(&TWO_ROOMS);
    let frame = space.frame();
    let from = Point2::new(frame.origin().x + 1.3, frame.origin().y + 1.7);
    let to = Point2::new(frame.origin().x + 19.1, frame.origin().y + 7.2);
    let Plan::Ok(route) = planner(&space, 0.45).plan(from, to) else {
        panic!("no route");
    };
    assert_eq!((route.points[0], *route.points.last().unwrap()), (from, to));
    let length: f64 = route.points.windows(2).map(|p| p[0].distance(p[1])).sum();
    assert!((route.length - length).abs() < 1e-9);
    assert!(route.clearance >= 0.45);
    assert!(route.length < 1.1 * from.distance(to));
    let same = planner(&space, 0.45).plan(from, from);
    assert!(same.route().unwrap().length.abs() < 1e-12);
}

#[test]
fn a_door_too_narrow_is_named_with_its_width() {
    let space = drawn(&TWO_ROOMS);
    let (from, to) = (center(&space, 3, 3), center(&space, 17, 5));
    for (a, b) in [(from, to), (to, from)] {
        let Plan::NoRoute { bottleneck: door } = planner(&space, 0.75).plan(a, b) else {
            panic!("expected no route");
        };
        assert!((door.width - 1.0).abs() < 1e-9, "{door:?}");
        assert!((door.needed - 1.5).abs() < 1e-9);
        assert!(
            door.place.distance(center(&space, 10, 4)) <= 1.0,
            "{door:?}"
        );
    }
}

#[test]
fn a_wall_without_a_door_is_a_bottleneck_of_no_width() {
    let mut rows = TWO_ROOMS;
    rows[4] = "..........#..........";
    let space = drawn(&rows);
    let plan = planner(&space, 0.5).plan(center(&space, 3, 3), center(&space, 17, 5));
    let Plan::NoRoute { bottleneck } = &plan else {
        panic!("expected no route");
    };
    assert!(bottleneck.width.abs() < 1e-12);
    let wall = center(&space, 10, 0).x;
    assert!((bottleneck.place.x - wall).abs() < 1e-9, "{bottleneck:?}");
    assert_eq!(plan.status().to_string(), "no_route");
}

#[test]
fn ends_where_the_robot_does_not_fit() {
    let space = drawn(&TWO_ROOMS);
    let planner = planner(&space, 1.0);
    let (good, near_wall) = (center(&space, 3, 3), center(&space, 9, 2));
    let Plan::StartBlocked { clearance } = planner.plan(near_wall, good) else {
        panic!("fits");
    };
    assert!((clearance - 0.5).abs() < 1e-8);
    assert_eq!(
        planner.plan(good, near_wall).status(),
        PlanStatus::GoalBlocked
    );
    assert_eq!(
        planner.plan(center(&space, 10, 0), good).status(),
        PlanStatus::StartBlocked
    );
    for bad in [
        Point2::new(-40.0, 0.0),
        Point2::new(f64::NAN, 3.0),
        Point2::new(1e300, 0.0),
    ] {
        assert_eq!(planner.plan(bad, good), Plan::Outside);
        assert_eq!(planner.plan(good, bad), Plan::Outside);
    }
}

/// A graph whose arcs lie, or that has none, changes neither the answer nor the certificate.
#[test]
fn a_wrong_graph_is_not_believed() {
    let space = drawn(&TWO_ROOMS);
    let (from, to) = (center(&space, 2, 1), center(&space, 18, 1));
    let honest = graph_of(&space, 0.5);
    let mut shifted = honest.clone();
    for arc in &mut shifted.arcs {
        for point in &mut arc.polyline {
            point.y += 3.0;
        }
    }
    let mut dangling = honest.clone();
    for arc in &mut dangling.arcs {
        arc.to = 1_000_000;
    }
    let mut empty = honest.clone();
    empty.arcs.clear();
    empty.nodes.clear();
    for graph in [honest, shifted, dangling, empty] {
        let planner = Planner::new(&space, &graph, ClearanceField::new(&space));
        let plan = planner.plan(from, to);
        assert!(plan.route().is_some_and(|r| r.clearance >= 0.5), "{plan:?}");
    }
}

#[test]
fn arcs_of_the_roadmap_between_nodes() {
    let space = drawn(&TWO_ROOMS);
    let graph = graph_of(&space, 0.5);
    let planner = planner(&space, 0.5);
    for from in 0..graph.nodes.len() {
        for to in 0..graph.nodes.len() {
            let way = planner.search(from, to).unwrap();
            let mut at = from;
            let mut length = 0.0;
            for arc in way.arcs.iter().map(|&arc| &graph.arcs[arc]) {
                at = if arc.from == at { arc.to } else { arc.from };
                length += arc.length;
            }
            assert_eq!(at, to);
            assert!((length - way.length).abs() < 1e-9);
        }
    }
    assert_eq!(planner.search(0, 1_000_000), None);
}

/// The exact clearance of the link between two cells, by all squares and the border.
fn link_clearance(cells: &BitImage, a: Cell, b: Cell) -> f64 {
    let [p, q] = [a, b].map(|c| [f64::from(c.col) + 0.5, f64::from(c.row) + 0.5]);
    let mut least = f64::INFINITY;
    for end in [p, q] {
        least = least.min(end[0]).min(end[1]);
        least = least
            .min(cells.width() as f64 - end[0])
            .min(cells.height() as f64 - end[1]);
    }
    for row in 0..cells.height() {
        for col in 0..cells.width() {
            if !cells.get(col, row) {
                least = least.min(to_square(p, q, col, row));
            }
        }
    }
    least
}

/// The greatest clearance of a way over links from `a` to `b`, by relaxation until nothing changes.
fn widest(cells: &BitImage, links: &[(usize, usize, f64)], a: usize, b: usize) -> f64 {
    let mut best = vec![0.0_f64; cells.width() * cells.height()];
    best[a] = f64::INFINITY;
    loop {
        let mut changed = false;
        for &(p, q, clearance) in links {
            for (p, q) in [(p, q), (q, p)] {
                let through = best[p].min(clearance);
                if through > best[q] {
                    best[q] = through;
                    changed = true;
                }
            }
        }
        if !changed {
            return best[b];
        }
    }
}

#[test]
fn small_random_maps_by_definition() {
    let maps = if crate::long() { 3000 } else { 60 };
    let mut random = Random::new(7);
    let (mut routes, mut none) = (0, 0);
    for _ in 0..maps {
        let (w, h) = (2 + random.below(14), 2 + random.below(14));
        let blocked = [0.03, 0.1, 0.25, 0.4][random.below(4)];
        let cells = BitImage::from_fn(w, h, |_, _| random.unit() >= blocked);
        let mut links = Vec::new();
        for row in 0..h {
            for col in 0..w {
                let a = Cell::new(col as u32, row as u32);
                for (dc, dr) in [(1_i32, 0_u32), (0, 1), (1, 1), (-1, 1)] {
                    let Some(c) = a.col.checked_add_signed(dc) else {
                        continue;
                    };
                    let b = Cell::new(c, a.row + dr);
                    if (b.col as usize) < w && (b.row as usize) < h {
                        let index = |c: Cell| c.row as usize * w + c.col as usize;
                        links.push((index(a), index(b), link_clearance(&cells, a, b)));
                    }
                }
            }
        }
        let space = space_of(cells.clone(), Pose2::new(0.3, -7.0, random.unit() * 6.0));
        let radius = [0.3, 0.5, 0.7, 1.0, 1.5][random.below(5)];
        let planner = planner(&space, radius);
        for _ in 0..12 {
            let [a, b] = [0; 2].map(|_| Cell::new(random.below(w) as u32, random.below(h) as u32));
            let index = |c: Cell| c.row as usize * w + c.col as usize;
            let ends = [a, b].map(|c| link_clearance(&cells, c, c));
            if a == b || ends[0] < radius || ends[1] < radius {
                continue;
            }
            let expected = widest(&cells, &links, index(a), index(b));
            let plan = planner.plan(space.frame().center_of(a), space.frame().center_of(b));
            let context = format!("{a:?} {b:?} {radius} {plan:?} {expected}\n{cells:?}");
            match plan {
                // a straight line may squeeze through where links do not
                Plan::Ok(route) => {
                    routes += 1;
                    let straight = route.points.len() == 2;
                    assert!(expected >= radius - 1e-9 || straight, "{context}");
                }
                Plan::NoRoute { bottleneck } => {
                    none += 1;
                    assert!(expected < radius - 1e-9, "{context}");
                    let width = bottleneck.width;
                    assert!((width - 2.0 * expected).abs() < 1e-6, "{context}");
                }
                _ => panic!("{context}"),
            }
        }
    }
    assert!(routes > maps && none > maps / 4, "{routes} {none}");
}
