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
use crate::draft::{Trace, TraceArc, TraceNode};
use crate::lattice::STEPS;
use crate::samples::Ranked;

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
    ranked: &'a Ranked<'a>,
    cells: Vec<Cell>,
    links: Vec<u8>,
}

impl<'a> Pixels<'a> {
    fn new(ranked: &'a Ranked<'a>) -> Self {
        let image = ranked.image();
        let mut pixels = Self {
            ranked,
            cells: Vec::with_capacity(ranked.count()),
            links: Vec::with_capacity(ranked.count()),
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
        let col = cell.col.wrapping_add_signed(dx);
        let row = cell.row.wrapping_add_signed(dy);
        self.ranked.rank(Cell::new(col, row)).unwrap_or(pixel)
    }
}

/// Traces an image. Linear in its words and set pixels.
pub(crate) fn trace(image: &BitImage) -> Trace {
    trace_ranked(&Ranked::new(image))
}

/// As [`trace`], with the pixels numbered already.
pub(crate) fn trace_ranked(ranked: &Ranked<'_>) -> Trace {
    let pixels = Pixels::new(ranked);
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
