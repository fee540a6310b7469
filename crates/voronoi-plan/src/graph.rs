//! The roadmap: nodes, and arcs that carry their polyline and a certified clearance.
//!
//! Clearance is the Euclidean distance from a centre line to the nearest point of any cell that is not
//! free; cells are squares, unknown cells and everything outside the map are not free.

use occgrid::{Cell, MapFrame, Point2};
use petgraph::unionfind::UnionFind;

/// What a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum NodeKind {
    /// Three or more branches meet.
    Junction,
    /// A dead end.
    End,
    /// A place on a loop that has no junction.
    Loop,
    /// A point with no arc at all: a region that thins to one pixel.
    Isolated,
    /// Where a bridge was tied in.
    Bridge,
    /// Where an arc was cut so that its pieces are straight.
    Bend,
}

/// A node of the roadmap.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Node {
    /// The cell whose centre is the node.
    pub cell: Cell,
    /// The node in the map frame.
    pub point: Point2,
    /// Certified lower bound of the clearance at the node [m].
    pub clearance: f64,
    /// What it is.
    pub kind: NodeKind,
}

/// An arc of the roadmap: undirected, a polyline between two nodes.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Arc {
    /// Index of the node where the polyline starts.
    pub from: usize,
    /// Index of the node where it ends (equal to `from` for a loop).
    pub to: usize,
    /// The centre line in the map frame, from node to node, both included.
    pub polyline: Vec<Point2>,
    /// Length of the polyline [m].
    pub length: f64,
    /// The certificate: no point of the polyline is nearer to a cell that is not free [m]. 0 where the
    /// polyline touches or crosses one.
    pub clearance: f64,
    /// Distance from each point of the polyline to the nearest cell that is not free [m]: half the width.
    pub width_profile: Vec<f32>,
    /// Where on the polyline the clearance is least.
    pub bottleneck: Point2,
    /// The nearest point of a not-free cell to the bottleneck.
    pub nearest_obstacle: Point2,
}

/// A roadmap in a map frame.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct VoronoiGraph {
    /// The frame of the map from which it was made.
    pub frame: MapFrame,
    /// The robot's radius for which it was made [m].
    pub radius: f64,
    /// Nodes, in a fixed order (row, then column).
    pub nodes: Vec<Node>,
    /// Arcs, in a fixed order.
    pub arcs: Vec<Arc>,
}

impl VoronoiGraph {
    /// For each node the number of its connected component, from 0 in the order of the components'
    /// first nodes.
    #[must_use]
    pub fn component_of_nodes(&self) -> Vec<usize> {
        let mut parts = UnionFind::<usize>::new(self.nodes.len());
        for arc in &self.arcs {
            parts.union(arc.from, arc.to);
        }
        let mut number = vec![usize::MAX; self.nodes.len()];
        let mut count = 0;
        (0..self.nodes.len())
            .map(|node| {
                let root = parts.find_mut(node);
                if number[root] == usize::MAX {
                    number[root] = count;
                    count += 1;
                }
                number[root]
            })
            .collect()
    }

    /// How many connected components there are.
    #[must_use]
    pub fn components(&self) -> usize {
        self.component_of_nodes()
            .into_iter()
            .max()
            .map_or(0, |last| last + 1)
    }

    /// How many independent cycles there are: arcs - nodes + components.
    #[must_use]
    pub fn cycles(&self) -> usize {
        self.arcs.len() + self.components() - self.nodes.len()
    }

    /// The least certified clearance of an arc or node [m]; `None` for the empty graph.
    #[must_use]
    pub fn min_clearance(&self) -> Option<f64> {
        let arcs = self.arcs.iter().map(|arc| arc.clearance);
        let nodes = self.nodes.iter().map(|node| node.clearance);
        arcs.chain(nodes).reduce(f64::min)
    }

    /// How many arcs touch or cross a cell that is not free: always 0 in a graph made by
    /// [`VoronoiGraph::build`].
    #[must_use]
    pub fn crossings(&self) -> usize {
        self.arcs.iter().filter(|arc| arc.clearance <= 0.0).count()
    }

    /// Length of all arcs [m].
    #[must_use]
    pub fn total_length(&self) -> f64 {
        self.arcs.iter().map(|arc| arc.length).sum()
    }
}
