//! Roadmaps of hostile maps, judged by the definitions computed the slow way: no code is shared with
//! the crate, and every distance is taken square by square.

use std::collections::VecDeque;

use morpho::BitImage;
use occgrid::{GridPoint, MapFrame, Pose2};
use proptest::prelude::*;
use voronoi_plan::{FreeSpace, GraphParams, NodeKind, Prune, VoronoiGraph};

type P = (f64, f64);

const TIE: f64 = 1e-9;

fn to_segment(p: P, a: P, b: P) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let n = dx * dx + dy * dy;
    let t = if n > 0.0 {
        (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / n).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p.0 - a.0 - t * dx).hypot(p.1 - a.1 - t * dy)
}

fn to_square(p: P, x: f64, y: f64) -> f64 {
    let dx = (x - p.0).max(p.0 - x - 1.0).max(0.0);
    let dy = (y - p.1).max(p.1 - y - 1.0).max(0.0);
    dx.hypot(dy)
}

/// Whether the segment enters the open square (slabs).
fn enters(a: P, b: P, x: f64, y: f64) -> bool {
    let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
    for (from, to, low) in [(a.0, b.0, x), (a.1, b.1, y)] {
        let d = to - from;
        if d.abs() < 1e-12 {
            if from <= low + 1e-9 || from >= low + 1.0 - 1e-9 {
                return false;
            }
        } else {
            let (u, v) = ((low - from) / d, (low + 1.0 - from) / d);
            t0 = t0.max(u.min(v));
            t1 = t1.min(u.max(v));
        }
    }
    t0 + 1e-9 < t1
}

/// A map drawn large enough for its border: not-free squares are those of the map and a rim around it.
pub(crate) struct Naive {
    free: BitImage,
}

impl Naive {
    pub(crate) fn new(free: &BitImage) -> Self {
        Self { free: free.clone() }
    }

    fn blocked(&self, x: i64, y: i64) -> bool {
        x < 0 || y < 0 || !self.free.get(x as usize, y as usize)
    }

    /// Distance from a segment to the nearest not-free square [cells].
    pub(crate) fn clearance(&self, a: P, b: P) -> f64 {
        let mut best = f64::INFINITY;
        // the nearest square is never farther than the border
        for y in -1..=self.free.height() as i64 {
            for x in -1..=self.free.width() as i64 {
                if !self.blocked(x, y) {
                    continue;
                }
                let (fx, fy) = (x as f64, y as f64);
                if enters(a, b, fx, fy) {
                    return 0.0;
                }
                best = best.min(to_square(a, fx, fy)).min(to_square(b, fx, fy));
                for corner in [
                    (fx, fy),
                    (fx + 1.0, fy),
                    (fx, fy + 1.0),
                    (fx + 1.0, fy + 1.0),
                ] {
                    best = best.min(to_segment(corner, a, b));
                }
            }
        }
        best
    }
}

fn center(x: usize, y: usize) -> P {
    (x as f64 + 0.5, y as f64 + 0.5)
}

/// The component of each cell where a robot of this radius [cells] may stand; `usize::MAX` elsewhere.
fn lattice_components(naive: &Naive, radius: f64) -> (Vec<usize>, usize) {
    let (width, height) = (naive.free.width(), naive.free.height());
    let stands: Vec<bool> = (0..width * height)
        .map(|i| {
            let c = center(i % width, i / width);
            naive.free.get(i % width, i / width) && naive.clearance(c, c) >= radius - TIE
        })
        .collect();
    let mut of = vec![usize::MAX; width * height];
    let mut count = 0;
    for start in 0..width * height {
        if !stands[start] || of[start] != usize::MAX {
            continue;
        }
        of[start] = count;
        let mut queue = VecDeque::from([start]);
        while let Some(i) = queue.pop_front() {
            let (x, y) = (i % width, i / width);
            for ny in y.saturating_sub(1)..(y + 2).min(height) {
                for nx in x.saturating_sub(1)..(x + 2).min(width) {
                    let n = ny * width + nx;
                    if stands[n] && of[n] == usize::MAX {
                        let c = naive.clearance(center(x, y), center(nx, ny));
                        if c > TIE && c >= radius - TIE {
                            of[n] = count;
                            queue.push_back(n);
                        }
                    }
                }
            }
        }
        count += 1;
    }
    (of, count)
}

/// The holes of the cells where the robot may stand, if every link between them keeps the radius
/// because all of them have half a squared cell to spare: the roadmap has a cycle for each.
fn holes_without_spare_cells(naive: &Naive, component: &[usize], radius: f64) -> Option<usize> {
    let (width, height) = (naive.free.width() + 2, naive.free.height() + 2);
    let stands = |x: usize, y: usize| {
        (1..width - 1).contains(&x)
            && (1..height - 1).contains(&y)
            && component[(y - 1) * (width - 2) + x - 1] != usize::MAX
    };
    let spare = (radius * radius + 0.5).sqrt();
    let mut outside = vec![false; width * height];
    let mut backgrounds = 0;
    for start in 0..width * height {
        let (x, y) = (start % width, start / width);
        if stands(x, y) {
            let c = center(x - 1, y - 1);
            if naive.clearance(c, c) < spare {
                return None;
            }
        } else if !outside[start] {
            backgrounds += 1;
            outside[start] = true;
            let mut queue = VecDeque::from([(x, y)]);
            while let Some((x, y)) = queue.pop_front() {
                let beside = [
                    (x.wrapping_sub(1), y),
                    (x + 1, y),
                    (x, y.wrapping_sub(1)),
                    (x, y + 1),
                ];
                for (nx, ny) in beside {
                    if nx < width && ny < height && !stands(nx, ny) && !outside[ny * width + nx] {
                        outside[ny * width + nx] = true;
                        queue.push_back((nx, ny));
                    }
                }
            }
        }
    }
    Some(backgrounds - 1)
}

/// Everything that must hold for a roadmap of these free cells at a radius [cells].
fn judge(free: &BitImage, radius_cells: f64, resolution: f64) -> Result<(), TestCaseError> {
    let frame = MapFrame::new(
        free.width() as u32,
        free.height() as u32,
        resolution,
        Pose2::new(-3.0, 7.5, 0.4),
    )
    .expect("a frame");
    let space = FreeSpace::new(frame, free.clone());
    let naive = Naive::new(free);
    let radius = radius_cells * resolution;
    let (component, count) = lattice_components(&naive, radius_cells);
    let cycles = holes_without_spare_cells(&naive, &component, radius_cells);
    for prune in [Prune::Nothing, Prune::Covered] {
        let params = GraphParams { radius, prune };
        let graph = VoronoiGraph::build(&space, &params).expect("a graph");
        judge_arcs(&graph, &naive, radius)?;
        judge_connections(&graph, &component, count)?;
        if let Some(cycles) = cycles {
            prop_assert_eq!(graph.cycles(), cycles, "cycles are the holes");
        }
    }
    Ok(())
}

fn judge_arcs(graph: &VoronoiGraph, naive: &Naive, radius: f64) -> Result<(), TestCaseError> {
    let frame = &graph.frame;
    let grid = |p| {
        let GridPoint { col, row } = frame.grid_from_map(p);
        (col, row)
    };
    prop_assert_eq!(graph.crossings(), 0);
    for arc in &graph.arcs {
        prop_assert!(arc.polyline.len() >= 2);
        prop_assert_eq!(arc.polyline.len(), arc.width_profile.len());
        let mut truth = f64::INFINITY;
        let mut length = 0.0;
        for pair in arc.polyline.windows(2) {
            let (a, b) = (grid(pair[0]), grid(pair[1]));
            let step = (a.0 - b.0).abs().max((a.1 - b.1).abs());
            prop_assert!((step - 1.0).abs() < 1e-6, "step {step}");
            truth = truth.min(naive.clearance(a, b) * frame.resolution());
            length += pair[0].distance(pair[1]);
        }
        // 2e-11: the rounding of the test's own coordinates
        prop_assert!(
            arc.clearance <= truth + 2e-11,
            "claims {} of {truth}",
            arc.clearance
        );
        prop_assert!(
            arc.clearance > truth - 2e-9,
            "claims {} of {truth}",
            arc.clearance
        );
        prop_assert!(arc.clearance >= radius && arc.clearance > 0.0);
        prop_assert!((arc.length - length).abs() < 1e-9);
        prop_assert_eq!(arc.polyline[0], graph.nodes[arc.from].point);
        prop_assert_eq!(
            arc.polyline[arc.polyline.len() - 1],
            graph.nodes[arc.to].point
        );
        let narrow = arc.bottleneck.distance(arc.nearest_obstacle);
        prop_assert!(
            (narrow - truth).abs() < 1e-9,
            "bottleneck {narrow} of {truth}"
        );
        let on_line = arc
            .polyline
            .windows(2)
            .map(|s| to_segment(grid(arc.bottleneck), grid(s[0]), grid(s[1])))
            .fold(f64::INFINITY, f64::min);
        prop_assert!(on_line < 1e-9);
        for (&width, &point) in arc.width_profile.iter().zip(&arc.polyline) {
            let exact = naive.clearance(grid(point), grid(point)) * frame.resolution();
            prop_assert!((f64::from(width) - exact).abs() < 1e-6 * exact.max(1.0));
        }
    }
    for node in &graph.nodes {
        let exact = naive.clearance(grid(node.point), grid(node.point)) * frame.resolution();
        prop_assert!(node.clearance <= exact + 2e-11 && node.clearance >= radius);
        prop_assert_eq!(frame.cell_at(node.point), Some(node.cell));
    }
    Ok(())
}

fn judge_connections(
    graph: &VoronoiGraph,
    component: &[usize],
    count: usize,
) -> Result<(), TestCaseError> {
    let of_node = graph.component_of_nodes();
    let mut of_lattice = vec![usize::MAX; graph.components()];
    let mut degree = vec![0; graph.nodes.len()];
    for arc in &graph.arcs {
        degree[arc.from] += 1;
        degree[arc.to] += 1;
    }
    for (n, node) in graph.nodes.iter().enumerate() {
        let at = component[graph.frame.index(node.cell)];
        prop_assert_ne!(at, usize::MAX, "a node outside the lattice");
        let known = &mut of_lattice[of_node[n]];
        prop_assert!(
            *known == usize::MAX || *known == at,
            "arcs join what the lattice does not"
        );
        *known = at;
        let named = match node.kind {
            NodeKind::Isolated => degree[n] == 0,
            NodeKind::End => degree[n] == 1,
            NodeKind::Loop => degree[n] == 2,
            NodeKind::Junction => degree[n] >= 3,
            _ => true,
        };
        prop_assert!(named, "{:?} of degree {}", node.kind, degree[n]);
    }
    prop_assert_eq!(graph.components(), count, "components of the lattice");
    of_lattice.sort_unstable();
    of_lattice.dedup();
    prop_assert_eq!(of_lattice.len(), count);
    for pair in graph.nodes.windows(2) {
        let key = |n: &voronoi_plan::Node| (n.cell.row, n.cell.col);
        prop_assert!(key(&pair[0]) < key(&pair[1]), "nodes out of order or twice");
    }
    Ok(())
}

/// Pictures that have broken planners: noise of every density, pillars and doors of one cell, diagonal
/// gaps and walls, rooms, staircases.
pub(crate) fn maps() -> impl Strategy<Value = BitImage> {
    (1_usize..40, 1_usize..40, 0..6, any::<u64>()).prop_map(|(width, height, kind, seed)| {
        let mut state = seed | 1;
        let mut random = move |n: u64| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) % n
        };
        let density = [5, 20, 100, 300, 500, 700][random(6) as usize];
        let (slope, gap) = (1 + random(3) as usize, 1 + random(9) as usize);
        let (dx, dy) = (2 + random(9) as usize, 2 + random(9) as usize);
        BitImage::from_fn(width, height, |x, y| match kind {
            0 => random(1000) >= density,
            // walls with doors and specks
            1 => !((x % dx == 0 || y % dy == 0) && random(1000) >= density) && random(1000) >= 10,
            // pillars on a grid
            2 => !(x % dx == 0 && y % dy == 0),
            // diagonal walls with gaps
            3 => (slope * x + y) % (gap + 3) != 0 || random(100) < 8,
            // checkers of blocks, some of which are missing
            4 => (x / gap + y / gap) % 2 == 0 || random(1000) < density,
            // staircases along an anti-diagonal corridor
            _ => (x + slope * y).abs_diff(width) < gap + 1 || random(1000) < 30,
        })
    })
}

fn radii() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        Just(0.5),
        Just(1.0),
        Just(1.5),
        Just(2.5),
        Just(0.5_f64.sqrt()),
        Just(2.0_f64.sqrt()),
        Just(4.5_f64.sqrt()),
        Just(2.5_f64.sqrt()),
        0.0..4.0,
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if crate::long() { 10_000 } else { 500 }))]

    #[test]
    fn every_claim_holds_and_every_passage_is_there(
        free in maps(),
        radius in radii(),
        resolution in prop_oneof![Just(0.05), Just(1.0), Just(0.037)],
    ) {
        judge(&free, radius, resolution)?;
    }
}

#[test]
fn the_plainest_maps() {
    for (width, height) in [(1, 1), (1, 9), (9, 1), (2, 2), (13, 13), (64, 3), (65, 7)] {
        for radius in [0.0, 0.5, 0.6, 1.0, 2.0, 1e9] {
            for free in [true, false] {
                let map = BitImage::from_fn(width, height, |_, _| free);
                judge(&map, radius, 0.05).expect("holds");
            }
        }
    }
}
