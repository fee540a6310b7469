//! The draft of a roadmap: a graph on cells, and the operations that keep its topology.

use occgrid::Cell;

use crate::NodeKind;
use crate::lattice::Lattice;

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
        touching.sort_by_cached_key(|&n| {
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
