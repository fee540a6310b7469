//! Bridges: what turns on less than half a cell.
//!
//! Thinning needs a set whose every pair of 8-neighbours is an admissible link. The few cells of the
//! lattice that had to be left out of that set may still join parts of it, or be parts of their own. A
//! search through the lattice from each cluster of such cells ties the parts together, so that the
//! roadmap has exactly one component for each component of the lattice.

use std::collections::{HashMap, VecDeque};

use morpho::{BitImage, Components, Connectivity};
use occgrid::Cell;
use petgraph::unionfind::UnionFind;

use crate::NodeKind;
use crate::draft::{Incidence, Trace, TraceArc, TraceNode};
use crate::lattice::Lattice;

/// Ties together the components of a roadmap that the cells left out of `core` join in the lattice,
/// and gives each component of the lattice that holds no cell of `core` a node.
///
/// The roadmap has one component in each 8-connected component of `core`.
pub(crate) fn bridge(
    trace: Trace,
    core: &BitImage,
    left_out: &BitImage,
    lattice: &Lattice<'_>,
) -> Trace {
    if left_out.count_ones() == 0 {
        return trace;
    }
    let parts = Components::label(core, Connectivity::Eight);
    let mut bridges = Bridges {
        lattice,
        joined: UnionFind::new(parts.count() + 1),
        parts,
        on_graph: BitImage::new(core.width(), core.height()),
        node_at: trace.nodes.iter().map(|n| n.cell).zip(0..).collect(),
        trace,
    };
    bridges.mark_graph();
    let mut todo = left_out.clone();
    for cell in Lattice::cells_of(left_out) {
        if get(&todo, cell) {
            let (cluster, shores) = bridges.cluster(cell, &mut todo);
            bridges.join(&cluster, &shores);
        }
    }
    bridges.split_at_ties()
}

struct Bridges<'a> {
    lattice: &'a Lattice<'a>,
    parts: Components,
    /// Which labels of `parts` the roadmap joins by now.
    joined: UnionFind<u32>,
    /// The cells that arcs and nodes run through.
    on_graph: BitImage,
    /// For looking up only: its order never matters.
    node_at: HashMap<Cell, usize>,
    trace: Trace,
}

impl Bridges<'_> {
    fn mark_graph(&mut self) {
        for node in &self.trace.nodes {
            set(&mut self.on_graph, node.cell, true);
        }
        for cell in self.trace.arcs.iter().flat_map(|arc| &arc.path) {
            set(&mut self.on_graph, *cell, true);
        }
    }

    /// The label of a cell's part; 0 for a cell outside `core`.
    fn part(&self, cell: Cell) -> u32 {
        self.parts.label_at(cell.col as usize, cell.row as usize)
    }

    /// The cells left out that the lattice joins to `first` without another cell, taken off `todo`, and
    /// the labels of the parts that they border on, ascending.
    fn cluster(&self, first: Cell, todo: &mut BitImage) -> (Vec<Cell>, Vec<u32>) {
        set(todo, first, false);
        let mut cells = vec![first];
        let mut shores = Vec::new();
        let mut next = 0;
        while let Some(&cell) = cells.get(next) {
            next += 1;
            for other in self.lattice.neighbours(cell) {
                if self.lattice.links(cell, other) {
                    match self.part(other) {
                        0 if get(todo, other) => {
                            set(todo, other, false);
                            cells.push(other);
                        }
                        0 => {}
                        part => shores.push(part),
                    }
                }
            }
        }
        shores.sort_unstable();
        shores.dedup();
        (cells, shores)
    }

    /// Joins the parts on a cluster's shores by arcs from its widest cell, unless they are joined.
    fn join(&mut self, cluster: &[Cell], shores: &[u32]) {
        let mut apart: Vec<u32> = Vec::new();
        for &part in shores {
            if apart.iter().all(|&other| !self.joined.equiv(part, other)) {
                apart.push(part);
            }
        }
        if apart.len() == 1 {
            return;
        }
        let widest = cluster
            .iter()
            .copied()
            .max_by_key(|&cell| {
                let order = std::cmp::Reverse((cell.row, cell.col));
                (self.lattice.squared_doubled(cell), order)
            })
            .unwrap_or(cluster[0]);
        if apart.is_empty() {
            let kind = NodeKind::Isolated;
            self.trace.nodes.push(TraceNode { cell: widest, kind });
            set(&mut self.on_graph, widest, true);
            return;
        }
        let start = self.tie(widest);
        for path in self.ways(widest, &apart) {
            let end = self.tie(path[path.len() - 1]);
            for &cell in &path {
                set(&mut self.on_graph, cell, true);
            }
            let ends = [start, end];
            self.trace.arcs.push(TraceArc { ends, path });
        }
        for pair in apart.windows(2) {
            self.joined.union(pair[0], pair[1]);
        }
    }

    /// The node at a cell, made if there is none.
    fn tie(&mut self, cell: Cell) -> usize {
        *self.node_at.entry(cell).or_insert_with(|| {
            let kind = NodeKind::Bridge;
            self.trace.nodes.push(TraceNode { cell, kind });
            self.trace.nodes.len() - 1
        })
    }

    /// For each of the wanted classes of joined parts, a way of fewest links from `start` to the
    /// roadmap in it.
    fn ways(&mut self, start: Cell, wanted: &[u32]) -> Vec<Vec<Cell>> {
        let mut wanted = wanted.to_vec();
        let mut before = HashMap::from([(start, start)]);
        let mut queue = VecDeque::from([start]);
        let mut ways = Vec::new();
        while let Some(cell) = queue.pop_front() {
            let part = self.part(cell);
            if part != 0 && get(&self.on_graph, cell) {
                let found = wanted.iter().position(|&w| self.joined.equiv(w, part));
                if let Some(found) = found {
                    wanted.swap_remove(found);
                    let back = std::iter::successors(Some(cell), |at| {
                        before.get(at).copied().filter(|prev| prev != at)
                    });
                    let mut path: Vec<Cell> = back.collect();
                    path.reverse();
                    ways.push(path);
                    if wanted.is_empty() {
                        break;
                    }
                }
            }
            for other in self.lattice.neighbours(cell) {
                if !before.contains_key(&other) && self.lattice.links(cell, other) {
                    before.insert(other, cell);
                    queue.push_back(other);
                }
            }
        }
        ways
    }

    /// Splits the arcs in whose middle a bridge was tied in, one for each tie.
    fn split_at_ties(mut self) -> Trace {
        let mut open = BitImage::new(self.on_graph.width(), self.on_graph.height());
        for node in &self.trace.nodes {
            if node.kind == NodeKind::Bridge {
                set(&mut open, node.cell, true);
            }
        }
        for arc in std::mem::take(&mut self.trace.arcs) {
            let (mut start, mut node) = (0, arc.ends[0]);
            for k in 1..arc.path.len() - 1 {
                if get(&open, arc.path[k]) {
                    set(&mut open, arc.path[k], false);
                    let tie = self.node_at[&arc.path[k]];
                    self.trace.arcs.push(TraceArc {
                        ends: [node, tie],
                        path: arc.path[start..=k].to_vec(),
                    });
                    (start, node) = (k, tie);
                }
            }
            self.trace.arcs.push(TraceArc {
                ends: [node, arc.ends[1]],
                path: arc.path[start..].to_vec(),
            });
        }
        self.trace.rename_nodes();
        self.trace
    }
}

impl Trace {
    /// Names the nodes by their degrees again, now that bridges end in some.
    fn rename_nodes(&mut self) {
        let incidence = Incidence::new(self);
        for (n, node) in self.nodes.iter_mut().enumerate() {
            node.kind = match (node.kind, incidence.at(n).len()) {
                (NodeKind::Bridge, _) | (NodeKind::End, 2) => NodeKind::Bridge,
                (_, 0) => NodeKind::Isolated,
                (_, 1) => NodeKind::End,
                (_, 2) => NodeKind::Loop,
                _ => NodeKind::Junction,
            };
        }
    }
}

fn get(image: &BitImage, cell: Cell) -> bool {
    image.get(cell.col as usize, cell.row as usize)
}

fn set(image: &mut BitImage, cell: Cell, value: bool) {
    image.set(cell.col as usize, cell.row as usize, value);
}
