//! Routes on real maps against a search of the grid: found whenever there is one, never nearer to an
//! obstacle than the radius, and short. Distances, searches and clearances here are the test's own.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::path::Path;

use morpho::BitImage;
use occgrid::{Cell, LoadOptions, MapFrame, Point2, Pose2, load_map};
use voronoi_plan::{ClearanceField, FreeSpace, GraphParams, Plan, Planner, Route, VoronoiGraph};

use crate::clearance::to_square;
use crate::random::Random;

const TIE: f64 = 1e-9;

const NEIGHBOURS: [(i64, i64); 8] = [
    (1, 0),
    (1, 1),
    (0, 1),
    (-1, 1),
    (-1, 0),
    (-1, -1),
    (0, -1),
    (1, -1),
];

/// The grid as the test sees it: distances up to `reach`, from the squares on the rim of what is not free.
struct Grid<'a> {
    cells: &'a BitImage,
    radius: f64,
    reach: i64,
    distance: Vec<f64>,
    links: HashMap<(usize, usize), bool>,
}

impl<'a> Grid<'a> {
    fn new(cells: &'a BitImage, radius: f64) -> Self {
        let reach = radius.ceil() as i64 + 2;
        let mut grid = Self {
            cells,
            radius,
            reach,
            distance: vec![f64::INFINITY; cells.width() * cells.height()],
            links: HashMap::new(),
        };
        let (w, h) = grid.size();
        for y in -1..=h {
            for x in -1..=w {
                let rim = NEIGHBOURS.iter().any(|(dx, dy)| grid.free(x + dx, y + dy));
                if !grid.free(x, y) && rim {
                    grid.stamp(x, y);
                }
            }
        }
        for y in 0..h {
            for x in 0..w {
                if !grid.free(x, y) {
                    grid.distance[(y * w + x) as usize] = 0.0;
                }
            }
        }
        grid
    }

    fn size(&self) -> (i64, i64) {
        (self.cells.width() as i64, self.cells.height() as i64)
    }

    fn free(&self, x: i64, y: i64) -> bool {
        x >= 0 && y >= 0 && self.cells.get(x as usize, y as usize)
    }

    /// Distances of the centres around one square.
    fn stamp(&mut self, x: i64, y: i64) {
        let (w, h) = self.size();
        for v in (y - self.reach).max(0)..=(y + self.reach).min(h - 1) {
            for u in (x - self.reach).max(0)..=(x + self.reach).min(w - 1) {
                let gap = |d: i64| (d.abs() as f64 - 0.5).max(0.0);
                let distance = gap(u - x).hypot(gap(v - y));
                let at = &mut self.distance[(v * w + u) as usize];
                *at = at.min(distance);
            }
        }
    }

    /// Number of the 8-connected component of each cell at distance `min` or more; 0 elsewhere.
    fn components(&self, min: f64) -> Vec<u32> {
        let (w, h) = self.size();
        let inside = |i: usize| self.distance[i] > 0.0 && self.distance[i] >= min - TIE;
        let mut label = vec![0; self.distance.len()];
        let mut count = 0;
        for seed in 0..label.len() {
            if label[seed] != 0 || !inside(seed) {
                continue;
            }
            count += 1;
            label[seed] = count;
            let mut queue = vec![seed];
            while let Some(at) = queue.pop() {
                let (x, y) = (at as i64 % w, at as i64 / w);
                for (u, v) in NEIGHBOURS.map(|(dx, dy)| (x + dx, y + dy)) {
                    let next = (v * w + u) as usize;
                    if u >= 0 && v >= 0 && u < w && v < h && label[next] == 0 && inside(next) {
                        label[next] = count;
                        queue.push(next);
                    }
                }
            }
        }
        label
    }

    /// The least clearance of a segment, up to the reach.
    fn clearance(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        let (w, h) = self.size();
        let mut least = self.reach as f64;
        for p in [a, b] {
            for d in [p[0], p[1], w as f64 - p[0], h as f64 - p[1]] {
                least = least.min(d.max(0.0));
            }
        }
        let pieces = ((a[0] - b[0]).hypot(a[1] - b[1]) / 4.0).ceil().max(1.0);
        for piece in 0..pieces as usize {
            let at = |i: usize| {
                let t = i as f64 / pieces;
                [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
            };
            let (p, q) = (at(piece), at(piece + 1));
            let low = |i: usize| p[i].min(q[i]) as i64 - self.reach;
            let high = |i: usize| p[i].max(q[i]) as i64 + self.reach;
            for y in low(1).max(0)..=high(1).min(h - 1) {
                for x in low(0).max(0)..=high(0).min(w - 1) {
                    if !self.free(x, y) {
                        least = least.min(to_square(p, q, x as usize, y as usize));
                    }
                }
            }
        }
        least
    }

    /// Whether a diagonal step between cells that keep the radius keeps it too.
    fn diagonal_is_clear(&mut self, a: usize, b: usize) -> bool {
        if self.distance[a].min(self.distance[b]) > self.radius + 0.75 {
            return true;
        }
        let key = (a.min(b), a.max(b));
        if let Some(&clear) = self.links.get(&key) {
            return clear;
        }
        let w = self.cells.width();
        let center = |i: usize| [(i % w) as f64 + 0.5, (i / w) as f64 + 0.5];
        let clear = self.clearance(center(a), center(b)) >= self.radius - TIE;
        self.links.insert(key, clear);
        clear
    }

    /// Length of the shortest 8-connected way that keeps the radius [cells].
    fn shortest(&mut self, from: usize, to: usize) -> Option<f64> {
        let (w, h) = self.size();
        let octile = |i: usize| {
            let (dx, dy) = (
                (i as i64 % w - to as i64 % w).abs() as f64,
                (i as i64 / w - to as i64 / w).abs() as f64,
            );
            dx.max(dy) + (std::f64::consts::SQRT_2 - 1.0) * dx.min(dy)
        };
        let mut cost = vec![f64::INFINITY; self.distance.len()];
        cost[from] = 0.0;
        let mut heap = BinaryHeap::from([(Reverse(octile(from).to_bits()), from)]);
        while let Some((Reverse(key), at)) = heap.pop() {
            if at == to {
                return Some(cost[to]);
            }
            if f64::from_bits(key) > cost[at] + octile(at) {
                continue;
            }
            let (x, y) = (at as i64 % w, at as i64 / w);
            for (dx, dy) in NEIGHBOURS {
                let (u, v) = (x + dx, y + dy);
                if u < 0 || v < 0 || u >= w || v >= h {
                    continue;
                }
                let next = (v * w + u) as usize;
                let there = cost[at] + (dx as f64).hypot(dy as f64);
                let stands = self.distance[next] > 0.0 && self.distance[next] >= self.radius - TIE;
                if stands
                    && there < cost[next]
                    && (dx == 0 || dy == 0 || self.diagonal_is_clear(at, next))
                {
                    cost[next] = there;
                    heap.push((Reverse((there + octile(next)).to_bits()), next));
                }
            }
        }
        None
    }
}

/// What a map's queries came to.
#[derive(Debug, Default)]
struct Tally {
    routes: usize,
    none: usize,
    within_half_a_cell: usize,
    ratios: Vec<f64>,
}

/// Random queries on a map; panics where an answer is wrong or a certificate false.
fn judge(space: &FreeSpace, radius: f64, queries: usize, seed: u64) -> Option<Tally> {
    let frame = *space.frame();
    let field = ClearanceField::new(space);
    let params = GraphParams {
        radius,
        ..GraphParams::default()
    };
    let graph = VoronoiGraph::build(space, &params).expect("a radius");
    let planner = Planner::new(space, &graph, field);
    let in_cells = radius / frame.resolution();
    let mut grid = Grid::new(space.cells(), in_cells);
    let here = grid.components(in_cells);
    let (wider, narrower) = (
        grid.components(in_cells - 0.5),
        grid.components(in_cells + 0.5),
    );
    let places: Vec<usize> = (0..here.len()).filter(|&i| here[i] != 0).collect();
    if places.len() < 2 {
        return None;
    }
    let mut random = Random::new(seed);
    let mut tally = Tally::default();
    for _ in 0..queries {
        let [a, b] = [0; 2].map(|_| places[random.below(places.len())]);
        let cell = |i: usize| Cell::new(i as u32 % frame.width(), i as u32 / frame.width());
        let (from, to) = (frame.center_of(cell(a)), frame.center_of(cell(b)));
        let joined = here[a] == here[b];
        let plan = planner.plan(from, to);
        let found = match &plan {
            Plan::Ok(route) => {
                check(&grid, &frame, route, radius, (from, to));
                true
            }
            Plan::NoRoute { .. } => false,
            other => panic!("{other:?} for ends where the robot fits"),
        };
        if found != joined {
            let sure = narrower[a] != 0 && narrower[a] == narrower[b];
            let never = wider[a] != wider[b];
            assert!(!sure && !never, "{from:?} {to:?}: {plan:?}, grid {joined}");
            tally.within_half_a_cell += 1;
        }
        match plan {
            Plan::Ok(route) => {
                tally.routes += 1;
                let shortest = grid.shortest(a, b).filter(|&s| s > 0.0);
                tally
                    .ratios
                    .extend(shortest.map(|s| route.length / frame.resolution() / s));
            }
            _ => tally.none += 1,
        }
    }
    Some(tally)
}

/// The route's certificate, by the test's own distances.
fn check(grid: &Grid<'_>, frame: &MapFrame, route: &Route, radius: f64, ends: (Point2, Point2)) {
    assert_eq!(
        (route.points[0], route.points[route.points.len() - 1]),
        ends
    );
    let mut least = f64::INFINITY;
    for pair in route.points.windows(2) {
        let [a, b] = [pair[0], pair[1]].map(|p| {
            let p = frame.grid_from_map(p);
            [p.col, p.row]
        });
        least = least.min(grid.clearance(a, b));
    }
    let least = least * frame.resolution();
    assert!(
        least >= radius - 1e-9,
        "{least} below the radius: {route:?}"
    );
    assert!(route.clearance >= radius, "claims {}", route.clearance);
    let seen = grid.reach as f64 * frame.resolution();
    assert!(
        least >= seen || route.clearance <= least + 1e-9,
        "{least}: {route:?}"
    );
}

/// Holds a tally to the bars for length, and puts it in a line.
fn summary(name: &str, tally: &Tally) -> String {
    let n = tally.ratios.len() as f64;
    let mean = tally.ratios.iter().sum::<f64>() / n.max(1.0);
    let worst = tally.ratios.iter().copied().fold(0.0, f64::max);
    let line = format!(
        "{name}: {} routes, {} none, {} within half a cell; length mean {mean:.3} worst {worst:.3}",
        tally.routes, tally.none, tally.within_half_a_cell
    );
    assert!(mean <= 1.10 && worst <= 1.30, "{line}");
    line
}

fn map(name: &str) -> FreeSpace {
    let maps = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/maps");
    let loaded = load_map(maps.join(name), &LoadOptions::default()).expect("a map that loads");
    FreeSpace::from_map(&loaded.map)
}

#[test]
fn real_maps() {
    let short = [
        ("turtlebot_apps/willow-2010-02-18-0.10.yaml", 0.35),
        ("cob_environments/ipa-apartment/map.yaml", 0.2),
        ("aws/warehouse-005/map.yaml", 0.3),
    ];
    let all = [
        "aws/small-house/map.yaml",
        "aws/warehouse-005/map.yaml",
        "cob_environments/ipa-apartment/map.yaml",
        "f1tenth/levine.yaml",
        "f1tenth_simulator/columbia.yaml",
        "mit-racecar/basement_fixed.map.yaml",
        "nav2/depot.yaml",
        "nav2/route/tb3_sandbox.yaml",
        "tuw/cave/map.yaml",
        "turtlebot_apps/willow-2010-02-18-0.10.yaml",
        "utexas_gdc/intel.yaml",
        "utexas_gdc/real-3/3.yaml",
    ];
    if crate::long() {
        for name in all {
            let space = map(name);
            for radius in [0.15, 0.25, 0.375] {
                if let Some(tally) = judge(&space, radius, 1000, 11) {
                    println!("{}", summary(&format!("{name} {radius} m"), &tally));
                }
            }
        }
    } else {
        for (name, radius) in short {
            let tally = judge(&map(name), radius, 25, 5).unwrap();
            assert!(tally.routes > 5, "{name}: {tally:?}");
            println!("{}", summary(name, &tally));
        }
    }
}

/// Rooms with doors of random widths, pillars and specks.
fn hostile(random: &mut Random) -> BitImage {
    let (w, h) = (20 + random.below(110), 20 + random.below(110));
    let specks = [0.0, 0.005, 0.03, 0.1][random.below(4)];
    let (room, pillar) = (6 + random.below(20), random.below(4));
    let mut cells = BitImage::from_fn(w, h, |x, y| {
        let wall = x % room == 0 || y % room == 0;
        let pillars = pillar > 0 && x % room == room / 2 && y % (3 * pillar) == 0;
        !wall && !pillars && random.unit() >= specks
    });
    for _ in 0..w * h / room / 4 {
        let (x, y) = (random.below(w), random.below(h));
        for i in 0..random.below(7) {
            if random.below(2) == 0 {
                cells.set((x + i).min(w - 1), y / room * room, true);
            } else {
                cells.set(x / room * room, (y + i).min(h - 1), true);
            }
        }
    }
    cells
}

#[test]
fn hostile_random_maps() {
    let maps = if crate::long() { 2000 } else { 60 };
    let mut random = Random::new(3);
    let mut all = Tally::default();
    for seed in 0..maps {
        let cells = hostile(&mut random);
        let origin = Pose2::new(1.0, 2.0, random.unit() * 6.0);
        let (w, h) = (cells.width() as u32, cells.height() as u32);
        let space = FreeSpace::new(MapFrame::new(w, h, 0.05, origin).expect("a frame"), cells);
        let radius = 0.05 * [0.4, 0.5, 1.0, 1.3, 2.0, 2.5, 3.7][random.below(7)];
        if let Some(tally) = judge(&space, radius, 20, seed) {
            all.routes += tally.routes;
            all.none += tally.none;
            all.within_half_a_cell += tally.within_half_a_cell;
            all.ratios.extend(tally.ratios);
        }
    }
    assert!(all.routes > 100 && all.none > 100, "{all:?}");
    println!("{}", summary("hostile random maps", &all));
}

/// The same on anybody's maps: `MOBOT_MAPS=a.yaml:b.yaml cargo test --release -p voronoi-plan --test it -- \
/// --ignored --nocapture given_maps`.
#[test]
#[ignore = "needs MOBOT_MAPS, map files separated by colons"]
fn given_maps() {
    let given = std::env::var("MOBOT_MAPS").expect("MOBOT_MAPS: map files separated by colons");
    for name in given.split(':') {
        let loaded = load_map(Path::new(name), &LoadOptions::default()).expect("a map that loads");
        let space = FreeSpace::from_map(&loaded.map);
        for radius in [0.15, 0.25, 0.375] {
            if let Some(tally) = judge(&space, radius, 200, 11) {
                println!("{}", summary(&format!("{name} {radius} m"), &tally));
            }
        }
    }
}
