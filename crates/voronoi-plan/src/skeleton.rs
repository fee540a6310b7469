//! From a thinned image to nodes and pixel paths.
//!
//! The pixels are joined so that the topology comes out exact for *any* image, thin or not: a vertical
//! pair always; a horizontal pair unless both pixels below it are set; a diagonal pair only if neither
//! pixel between them is set. Every full 2x2 block so lacks its top link, and the graph has as many
//! components as the image has 8-connected ones and as many independent cycles as it has holes
//! (4-connected): V - E of the graph is V - E + F of the image's cell complex, whose faces are those blocks.

use morpho::BitImage;
use occgrid::Cell;

use crate::NodeKind;
use crate::lattice::{Lattice, STEPS};

/// A node, before it has coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TraceNode {
    pub(crate) cell: Cell,
    pub(crate) kind: NodeKind,
}

/// An arc as cells, each an 8-neighbour of the one before, from node to node, both included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TraceArc {
    pub(crate) ends: [usize; 2],
    pub(crate) path: Vec<Cell>,
}

/// A graph on cells.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Trace {
    pub(crate) nodes: Vec<TraceNode>,
    pub(crate) arcs: Vec<TraceArc>,
}

/// For each set of neighbours (bit `d` for `STEPS[d]`, whose opposite is `STEPS[d ^ 4]`), those to which a
/// pixel is joined.
const LINKS: [u8; 256] = {
    let mut table = [0; 256];
    let mut around = 0;
    while around < 256 {
        table[around] = links(around as u8);
        around += 1;
    }
    table
};

const fn links(around: u8) -> u8 {
    const fn has(around: u8, d: u8) -> bool {
        around >> (d % 8) & 1 == 1
    }
    let mut result = around & 0b0100_0100;
    if has(around, 0) && !(has(around, 2) && has(around, 1)) {
        result |= 1;
    }
    if has(around, 4) && !(has(around, 2) && has(around, 3)) {
        result |= 1 << 4;
    }
    let mut d = 1;
    while d < 8 {
        if has(around, d) && !has(around, d - 1) && !has(around, d + 1) {
            result |= 1 << d;
        }
        d += 2;
    }
    result
}

/// The set pixels of an image, numbered in raster order, with their links.
struct Pixels<'a> {
    image: &'a BitImage,
    /// Number of the first pixel of each word.
    first: Vec<u32>,
    cells: Vec<Cell>,
    links: Vec<u8>,
}

impl<'a> Pixels<'a> {
    fn new(image: &'a BitImage) -> Self {
        let count = image.count_ones();
        let mut pixels = Self {
            image,
            first: Vec::with_capacity(image.words().len()),
            cells: Vec::with_capacity(count),
            links: Vec::with_capacity(count),
        };
        let blank = vec![0; image.stride()];
        for y in 0..image.height() {
            let above = if y > 0 { image.row(y - 1) } else { &blank };
            let below = if y + 1 < image.height() {
                image.row(y + 1)
            } else {
                &blank
            };
            pixels.add_row(y as u32, [above, image.row(y), below]);
        }
        pixels
    }

    fn add_row(&mut self, row: u32, rows: [&[u64]; 3]) {
        for (k, &word) in rows[1].iter().enumerate() {
            self.first.push(self.cells.len() as u32);
            if word == 0 {
                continue;
            }
            let [above, here, below] = rows.map(|r| {
                let west = r[k] << 1 | if k > 0 { r[k - 1] >> 63 } else { 0 };
                let east = r[k] >> 1 | r.get(k + 1).map_or(0, |next| next << 63);
                [west, r[k], east]
            });
            let around = [
                here[2], below[2], below[1], below[0], here[0], above[0], above[1], above[2],
            ];
            let mut rest = word;
            while rest != 0 {
                let bit = rest.trailing_zeros();
                rest &= rest - 1;
                let set = (0..8).fold(0, |set, d| set | ((around[d] >> bit & 1) as u8) << d);
                self.cells.push(Cell::new(k as u32 * 64 + bit, row));
                self.links.push(LINKS[usize::from(set)]);
            }
        }
    }

    fn degree(&self, pixel: usize) -> u32 {
        self.links[pixel].count_ones()
    }

    /// The number of the neighbour in a direction, which must be set.
    fn neighbour(&self, pixel: usize, d: u32) -> usize {
        if d == 0 {
            return pixel + 1;
        }
        if d == 4 {
            return pixel - 1;
        }
        let cell = self.cells[pixel];
        let (dx, dy) = STEPS[d as usize];
        let x = cell.col.wrapping_add_signed(dx) as usize;
        let y = cell.row.wrapping_add_signed(dy) as usize;
        let k = y * self.image.stride() + x / 64;
        let before = self.image.words()[k] & ((1 << (x % 64)) - 1);
        self.first[k] as usize + before.count_ones() as usize
    }
}

/// Traces an image. Linear in its words and set pixels.
pub(crate) fn trace(image: &BitImage) -> Trace {
    let pixels = Pixels::new(image);
    let mut trace = Trace::default();
    let mut node_of = vec![u32::MAX; pixels.cells.len()];
    for (pixel, &cell) in pixels.cells.iter().enumerate() {
        let kind = match pixels.degree(pixel) {
            0 => NodeKind::Isolated,
            1 => NodeKind::End,
            2 => continue,
            _ => NodeKind::Junction,
        };
        node_of[pixel] = trace.nodes.len() as u32;
        trace.nodes.push(TraceNode { cell, kind });
    }
    let mut left = pixels.links.clone();
    for pixel in 0..pixels.cells.len() {
        if node_of[pixel] != u32::MAX {
            while left[pixel] != 0 {
                follow(&pixels, pixel, &mut left, &node_of, &mut trace);
            }
        }
    }
    for pixel in 0..pixels.cells.len() {
        if left[pixel] != 0 && node_of[pixel] == u32::MAX {
            node_of[pixel] = trace.nodes.len() as u32;
            let cell = pixels.cells[pixel];
            let kind = NodeKind::Loop;
            trace.nodes.push(TraceNode { cell, kind });
            follow(&pixels, pixel, &mut left, &node_of, &mut trace);
        }
    }
    trace
}

/// Walks from a node along its first link not yet taken to the next node.
fn follow(pixels: &Pixels<'_>, start: usize, left: &mut [u8], node_of: &[u32], trace: &mut Trace) {
    let mut path = vec![pixels.cells[start]];
    let mut at = start;
    loop {
        let d = left[at].trailing_zeros();
        left[at] &= !(1 << d);
        at = pixels.neighbour(at, d);
        left[at] &= !(1 << (d ^ 4));
        path.push(pixels.cells[at]);
        if node_of[at] != u32::MAX {
            break;
        }
    }
    path.shrink_to_fit();
    trace.arcs.push(TraceArc {
        ends: [node_of[start] as usize, node_of[at] as usize],
        path,
    });
}

/// The arcs at each node, ascending, a loop twice: `arcs[start[n]..start[n + 1]]`.
#[derive(Debug)]
pub(crate) struct Incidence {
    start: Vec<u32>,
    arcs: Vec<u32>,
}

impl Incidence {
    pub(crate) fn new(trace: &Trace) -> Self {
        let mut start = vec![0_u32; trace.nodes.len() + 1];
        for end in trace.arcs.iter().flat_map(|arc| arc.ends) {
            start[end + 1] += 1;
        }
        for n in 0..trace.nodes.len() {
            start[n + 1] += start[n];
        }
        let mut next = start.clone();
        let mut arcs = vec![0; 2 * trace.arcs.len()];
        for (index, arc) in trace.arcs.iter().enumerate() {
            for end in arc.ends {
                arcs[next[end] as usize] = index as u32;
                next[end] += 1;
            }
        }
        Self { start, arcs }
    }

    pub(crate) fn at(&self, node: usize) -> &[u32] {
        &self.arcs[self.start[node] as usize..self.start[node + 1] as usize]
    }
}

impl Trace {
    /// Joins arcs at nodes where exactly two ends meet, drops nodes that nothing needs, and names
    /// every node by its degree. Bridge nodes stay.
    pub(crate) fn merge_chains(self) -> Self {
        let incidence = Incidence::new(&self);
        let through = |n: usize| {
            self.nodes[n].kind != NodeKind::Bridge && matches!(incidence.at(n), [a, b] if a != b)
        };
        let mut chains = Chains {
            taken: vec![false; self.arcs.len()],
            node_of: vec![u32::MAX; self.nodes.len()],
            merged: Self::default(),
        };
        let passed: Vec<bool> = (0..self.nodes.len()).map(through).collect();
        let mut paths: Vec<_> = self.arcs;
        for n in (0..self.nodes.len()).filter(|&n| !passed[n]) {
            chains.keep(n, self.nodes[n], incidence.at(n).len());
        }
        for round in [false, true] {
            for n in (0..self.nodes.len()).filter(|&n| passed[n] == round) {
                for &arc in incidence.at(n) {
                    if !chains.taken[arc as usize] {
                        if round {
                            chains.keep(n, self.nodes[n], 2);
                        }
                        chains.follow(n, arc as usize, &incidence, &mut paths);
                    }
                }
            }
        }
        chains.merged
    }
}

struct Chains {
    taken: Vec<bool>,
    node_of: Vec<u32>,
    merged: Trace,
}

impl Chains {
    fn keep(&mut self, old: usize, node: TraceNode, degree: usize) {
        self.node_of[old] = self.merged.nodes.len() as u32;
        let kind = match (node.kind, degree) {
            (NodeKind::Bridge, _) => NodeKind::Bridge,
            (_, 0) => NodeKind::Isolated,
            (_, 1) => NodeKind::End,
            (_, 2) => NodeKind::Loop,
            _ => NodeKind::Junction,
        };
        self.merged.nodes.push(TraceNode { kind, ..node });
    }

    fn follow(&mut self, from: usize, first: usize, incidence: &Incidence, arcs: &mut [TraceArc]) {
        let mut path: Vec<Cell> = Vec::new();
        let (mut node, mut arc) = (from, first);
        loop {
            self.taken[arc] = true;
            let mut piece = std::mem::take(&mut arcs[arc].path);
            let [a, b] = arcs[arc].ends;
            if a != node {
                piece.reverse();
            }
            node = if a == node { b } else { a };
            if path.is_empty() {
                path = piece;
            } else {
                path.extend_from_slice(&piece[1..]);
            }
            if self.node_of[node] != u32::MAX {
                break;
            }
            let at = incidence.at(node);
            arc = if at[0] as usize == arc { at[1] } else { at[0] } as usize;
        }
        self.merged.arcs.push(TraceArc {
            ends: [self.node_of[from] as usize, self.node_of[node] as usize],
            path,
        });
    }
}

/// How many links from the cluster's node a junction pixel may be to be merged into it. Real clusters
/// span one or two; the bound keeps combs of junctions from growing quadratically.
const CLUSTER_REACH: usize = 2;

impl Trace {
    /// Makes one node of junctions whose pixels touch: the pixel of greatest `clearance`, first in
    /// raster order of equals. Arcs of the others are led on to it through the cluster's pixels.
    pub(crate) fn merge_clusters(self, clearance: impl Fn(Cell) -> u32) -> Self {
        let is_inner = |arc: &TraceArc| {
            arc.path.len() == 2
                && arc.ends[0] != arc.ends[1]
                && arc
                    .ends
                    .iter()
                    .all(|&n| self.nodes[n].kind == NodeKind::Junction)
        };
        let mut touching: Vec<usize> = self
            .arcs
            .iter()
            .filter(|arc| is_inner(arc))
            .flat_map(|arc| arc.ends)
            .collect();
        touching.sort_unstable();
        touching.dedup();
        if touching.is_empty() {
            return self;
        }
        touching.sort_by_key(|&n| {
            let cell = self.nodes[n].cell;
            (std::cmp::Reverse(clearance(cell)), cell.row, cell.col)
        });
        let incidence = Incidence::new(&self);
        // the way from a merged junction to its cluster's node, both included
        let mut way: Vec<Vec<Cell>> = vec![Vec::new(); self.nodes.len()];
        let mut into: Vec<usize> = (0..self.nodes.len()).collect();
        let mut inner = vec![false; self.arcs.len()];
        for &center in &touching {
            if !way[center].is_empty() {
                continue;
            }
            way[center].push(self.nodes[center].cell);
            let mut front = vec![center];
            for _ in 0..CLUSTER_REACH {
                let mut next = Vec::new();
                for &n in &front {
                    for &arc in incidence.at(n) {
                        let [a, b] = self.arcs[arc as usize].ends;
                        let other = if a == n { b } else { a };
                        if is_inner(&self.arcs[arc as usize]) && way[other].is_empty() {
                            inner[arc as usize] = true;
                            into[other] = center;
                            way[other] = vec![self.nodes[other].cell];
                            let rest = way[n].clone();
                            way[other].extend(rest);
                            next.push(other);
                        }
                    }
                }
                front = next;
            }
        }
        self.contract(&into, &inner, &way)
    }

    fn contract(self, into: &[usize], inner: &[bool], way: &[Vec<Cell>]) -> Self {
        let mut merged = Self::default();
        let mut index = vec![usize::MAX; self.nodes.len()];
        for (n, &node) in self.nodes.iter().enumerate() {
            if into[n] == n {
                index[n] = merged.nodes.len();
                merged.nodes.push(node);
            }
        }
        for (arc, _) in self
            .arcs
            .into_iter()
            .zip(inner)
            .filter(|&(_, &inner)| !inner)
        {
            let [a, b] = arc.ends;
            let mut path = arc.path;
            if way[b].len() > 1 {
                path.extend_from_slice(&way[b][1..]);
            }
            if way[a].len() > 1 {
                path.reverse();
                path.extend_from_slice(&way[a][1..]);
                path.reverse();
            }
            merged.arcs.push(TraceArc {
                ends: [index[into[a]], index[into[b]]],
                path,
            });
        }
        merged
    }
}

impl Trace {
    /// Leads diagonal links that are not admissible round by a cell beside them.
    pub(crate) fn keep_to(&mut self, lattice: &Lattice<'_>) {
        for arc in &mut self.arcs {
            let way = |k: usize| lattice.way(arc.path[k - 1], arc.path[k])?;
            if (1..arc.path.len()).all(|k| way(k).is_none()) {
                continue;
            }
            let mut path = vec![arc.path[0]];
            for k in 1..arc.path.len() {
                path.extend(way(k));
                path.push(arc.path[k]);
            }
            arc.path = path;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use morpho::{Components, Connectivity, holes};

    fn image(rows: &[&str]) -> BitImage {
        BitImage::from_fn(rows[0].len(), rows.len(), |x, y| {
            rows[y].as_bytes()[x] == b'#'
        })
    }

    /// Nodes as (column, row, kind), and per arc its ends and number of cells.
    type Shape = (Vec<(u32, u32, NodeKind)>, Vec<([usize; 2], usize)>);

    fn shape(trace: &Trace) -> Shape {
        let nodes = trace.nodes.iter();
        let arcs = trace.arcs.iter();
        (
            nodes.map(|n| (n.cell.col, n.cell.row, n.kind)).collect(),
            arcs.map(|a| (a.ends, a.path.len())).collect(),
        )
    }

    #[test]
    fn a_plus_has_one_junction_and_four_ends() {
        use NodeKind::{End, Junction};
        let plus = ["..#..", "..#..", "#####", "..#..", "..#.."];
        let (nodes, arcs) = shape(&trace(&image(&plus)));
        assert_eq!(
            nodes,
            [
                (2, 0, End),
                (0, 2, End),
                (2, 2, Junction),
                (4, 2, End),
                (2, 4, End)
            ]
        );
        assert_eq!(arcs, [([0, 2], 3), ([1, 2], 3), ([2, 3], 3), ([2, 4], 3)]);
    }

    #[test]
    fn a_loop_without_a_junction_gets_a_node() {
        let (nodes, arcs) = shape(&trace(&image(&[".#.", "#.#", ".#."])));
        assert_eq!(nodes, [(1, 0, NodeKind::Loop)]);
        assert_eq!(arcs, [([0, 0], 5)]);
    }

    #[test]
    fn a_lone_pixel_is_isolated_and_a_block_is_a_chain() {
        let (nodes, arcs) = shape(&trace(&image(&["#..", "...", "..#"])));
        assert_eq!(
            nodes,
            [(0, 0, NodeKind::Isolated), (2, 2, NodeKind::Isolated)]
        );
        assert!(arcs.is_empty());
        let (nodes, arcs) = shape(&trace(&image(&["##", "##"])));
        assert_eq!(nodes, [(0, 0, NodeKind::End), (1, 0, NodeKind::End)]);
        assert_eq!(arcs, [([0, 1], 4)]);
    }

    #[test]
    fn parallel_arcs_and_self_loops_stay() {
        // a theta, and a ring with a tail
        let theta = [".###.", "#...#", "#####", "#...#", ".###."];
        let traced = trace(&image(&theta));
        assert_eq!(traced.nodes.len(), 2);
        assert_eq!(traced.arcs.len(), 3);
        let tail = ["...##.", "###..#", "...##."];
        let (nodes, arcs) = shape(&trace(&image(&tail)));
        assert_eq!(nodes, [(0, 1, NodeKind::End), (2, 1, NodeKind::Junction)]);
        assert_eq!(
            arcs.iter().filter(|(ends, _)| ends[0] == ends[1]).count(),
            1
        );
        assert_eq!(arcs.len(), 2);
    }

    #[test]
    fn touching_junctions_become_the_one_of_greatest_clearance() {
        let rows = ["..#....", "..#....", "#######", "...#...", "...#..."];
        let traced = trace(&image(&rows));
        let junctions = |t: &Trace| {
            let all = t.nodes.iter().filter(|n| n.kind == NodeKind::Junction);
            all.map(|n| n.cell).collect::<Vec<_>>()
        };
        assert_eq!(junctions(&traced), [Cell::new(2, 2), Cell::new(3, 2)]);
        let merged = traced.merge_clusters(|cell| cell.col);
        assert_eq!(junctions(&merged), [Cell::new(3, 2)]);
        assert_eq!((merged.nodes.len(), merged.arcs.len()), (5, 4));
        check(&merged, &image(&rows), false);
    }

    /// A repeatable image of the given density in 1/8.
    fn noise(width: usize, height: usize, seed: u64, density: u64) -> BitImage {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        BitImage::from_fn(width, height, |_, _| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state >> 20 & 7 < density
        })
    }

    /// Paths run over set pixels from node to node, and components and cycles are those of the image.
    fn check(trace: &Trace, image: &BitImage, every_pixel: bool) {
        let mut parts = petgraph::unionfind::UnionFind::<usize>::new(trace.nodes.len());
        let mut joined = 0;
        let mut seen = BitImage::new(image.width(), image.height());
        for node in &trace.nodes {
            seen.set(node.cell.col as usize, node.cell.row as usize, true);
        }
        for arc in &trace.arcs {
            joined += usize::from(parts.union(arc.ends[0], arc.ends[1]));
            assert_eq!(arc.path[0], trace.nodes[arc.ends[0]].cell);
            assert_eq!(arc.path[arc.path.len() - 1], trace.nodes[arc.ends[1]].cell);
            for pair in arc.path.windows(2) {
                let step = pair[0]
                    .col
                    .abs_diff(pair[1].col)
                    .max(pair[0].row.abs_diff(pair[1].row));
                assert_eq!(step, 1);
            }
            for cell in &arc.path {
                assert!(image.get(cell.col as usize, cell.row as usize));
                seen.set(cell.col as usize, cell.row as usize, true);
            }
        }
        let components = trace.nodes.len() - joined;
        let eight = Connectivity::Eight;
        assert_eq!(
            components,
            Components::label(image, eight).count(),
            "{image:?}"
        );
        let cycles = trace.arcs.len() - joined;
        assert_eq!(cycles, holes(image, eight), "{image:?}");
        assert!(!every_pixel || seen == *image);
    }

    #[test]
    fn components_and_holes_of_any_image_are_those_of_its_graph() {
        let cases = if std::env::var_os("MOBOT_LONG").is_some() {
            20_000
        } else {
            1_500
        };
        for seed in 0..cases {
            let width = [0, 1, 2, 3, 5, 9, 63, 64, 65, 66, 129][seed as usize % 11];
            let height = [1, 2, 3, 7, 20][seed as usize / 11 % 5];
            let raw = noise(width, height, seed, 1 + seed / 55 % 7);
            for image in [morpho::thin::homotopic(&raw), raw] {
                let traced = trace(&image);
                check(&traced, &image, true);
                check(&traced.clone().merge_chains(), &image, true);
                let clearance = |cell: Cell| cell.col.wrapping_mul(2_654_435_761) >> 28;
                check(&traced.merge_clusters(clearance), &image, false);
            }
        }
    }
}
