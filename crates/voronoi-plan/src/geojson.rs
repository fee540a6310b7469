//! Nav2 route graphs as GeoJSON: read (also what others drew) and written.
//!
//! The format is what `nav2_route`'s `GeoJsonGraphFileLoader` reads: a FeatureCollection whose Point
//! features are nodes (`properties.id`) and whose LineString or MultiLineString features are directed
//! edges (`properties.id`, `startid`, `endid`; optional `cost`, `overridable`, `metadata`, `operations`).
//! Coordinates are metres in the map frame, whatever the file's `crs` says.
//!
//! What Nav2 does not say but its source shows (`nav2_route` at a3a9704):
//! * It ignores the coordinates of edges and drives straight from node to node. Ours carry the arc's
//!   polyline there; follow that, or check the chords too ([`RouteGraph::chords`]).
//! * Its saver writes edges without coordinates; one of its own sample files nests a LineString's
//!   coordinates like a MultiLineString's. Both are read here.
//! * It refuses a file with no node or no edge. Such a file is read here (there is nothing wrong in it to
//!   find), and an empty roadmap is written like any other.
//! * Ids are 32 bit and shared by nodes and edges (its list of blocked ids does not tell them apart). The
//!   graphs written here never use an id twice; a node and an edge of the same id are let pass on reading.
//! * In `metadata` it takes scalars, arrays of scalars and objects, so what a Voronoi graph adds rides in
//!   a property of its own, `voronoi_plan`, which Nav2 skips.

mod read;
mod roadmap;
mod write;

use std::borrow::Cow;
use std::collections::HashMap;

use occgrid::Point2;
use thiserror::Error;

use crate::check::EdgeLine;

/// The key of what a Voronoi graph adds to the collection, to nodes and to edges.
pub(crate) const MEMBER: &str = "voronoi_plan";

/// A place of a route graph: a Point feature.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RouteNode {
    /// Unique among the nodes.
    pub id: u32,
    /// In the node's frame [m].
    pub point: Point2,
    /// The frame's name; Nav2 takes `map` where there is none.
    pub frame: Option<Box<str>>,
    /// A JSON object, as text.
    pub metadata: Option<Box<str>>,
    /// A JSON object or array, as text.
    pub operations: Option<Box<str>>,
    /// The property `voronoi_plan`, as JSON text.
    pub voronoi: Option<Box<str>>,
}

/// A directed edge of a route graph: a LineString or MultiLineString feature.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RouteEdge {
    /// Unique among the edges.
    pub id: u32,
    /// Id of the node where it starts.
    pub start: u32,
    /// Id of the node where it ends.
    pub end: u32,
    /// What it costs to take it, not negative.
    pub cost: Option<f64>,
    /// Whether Nav2's scorers may replace the cost.
    pub overridable: Option<bool>,
    /// The drawn line in the map frame, the parts of a MultiLineString one after the other.
    pub polyline: Option<Vec<Point2>>,
    /// The clearance that it claims to have [m].
    pub clearance: Option<f64>,
    /// A JSON object, as text.
    pub metadata: Option<Box<str>>,
    /// A JSON object or array, as text.
    pub operations: Option<Box<str>>,
    /// The property `voronoi_plan`, as JSON text.
    pub voronoi: Option<Box<str>>,
}

/// A route graph as Nav2 has it. Edges name their nodes by id.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RouteGraph {
    /// In the file's order.
    pub nodes: Vec<RouteNode>,
    /// In the file's order.
    pub edges: Vec<RouteEdge>,
    /// The collection's member `voronoi_plan`, as JSON text.
    pub voronoi: Option<Box<str>>,
}

/// How large a route graph may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadLimits {
    /// Length of the file [bytes]. The text is held while it is read.
    pub bytes: u64,
    /// Nodes.
    pub nodes: usize,
    /// Directed edges.
    pub edges: usize,
}

impl Default for ReadLimits {
    /// 512 MiB, 10^6 nodes, 4 x 10^6 edges.
    fn default() -> Self {
        Self {
            bytes: 512 << 20,
            nodes: 1_000_000,
            edges: 4_000_000,
        }
    }
}

/// Why a route graph was refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RouteGraphError {
    /// Not JSON, or not of the expected structure.
    #[error("{}{message}", place(*.feature))]
    Syntax {
        /// The feature that was being read, 0-based.
        feature: Option<usize>,
        /// What is wrong, with line and column.
        message: String,
    },
    /// The collection as a whole lacks something.
    #[error("{key}: expected {expected}, found {found}")]
    Collection {
        /// The key.
        key: &'static str,
        /// What should be there.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// A feature lacks something, or has what cannot be.
    #[error("feature {feature}: {key}: expected {expected}, found {found}")]
    Feature {
        /// The feature, 0-based in the file's order.
        feature: usize,
        /// The key.
        key: &'static str,
        /// What should be there.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// More than the limits allow.
    #[error("{what}: expected at most {limit}, found more")]
    TooLarge {
        /// Of what there is too much.
        what: &'static str,
        /// How much may be.
        limit: u64,
    },
    /// A node or edge cannot be written, or is no part of a Voronoi graph.
    #[error("{what} {id}: {key}: expected {expected}, found {found}")]
    Element {
        /// `node` or `edge`.
        what: &'static str,
        /// Its id.
        id: u32,
        /// The key.
        key: &'static str,
        /// What should be there.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// The file cannot be read or written.
    #[error("{message}")]
    Io {
        /// The system's message.
        message: String,
    },
}

impl From<std::io::Error> for RouteGraphError {
    fn from(error: std::io::Error) -> Self {
        Self::Io {
            message: error.to_string(),
        }
    }
}

fn place(feature: Option<usize>) -> String {
    feature.map_or_else(String::new, |index| format!("feature {index}: "))
}

impl RouteGraph {
    /// The edges as lines to check: from the start node along what is drawn to the end node, straight
    /// where nothing is drawn. A drawing that does not begin or end at its nodes is joined to them, so
    /// neither a moved node nor a moved line escapes. Edges to missing nodes have no point.
    pub fn lines(&self) -> impl Iterator<Item = EdgeLine<'_>> {
        let index = NodeIndex::new(&self.nodes);
        self.edges.iter().map(move |edge| {
            let ends = [edge.start, edge.end].map(|id| index.get(id).map(|i| self.nodes[i].point));
            let [Some(start), Some(end)] = ends else {
                return edge.line(Cow::Borrowed(&[]));
            };
            let drawn = edge.polyline.as_deref().unwrap_or_default();
            if drawn.len() > 1 && drawn.first() == Some(&start) && drawn.last() == Some(&end) {
                return edge.line(Cow::Borrowed(drawn));
            }
            let mut points = Vec::with_capacity(drawn.len() + 2);
            points.push(start);
            points.extend_from_slice(drawn);
            points.push(end);
            edge.line(Cow::Owned(points))
        })
    }

    /// The edges as Nav2's route server drives them: straight from node to node, whatever is drawn. No
    /// clearance is claimed for these.
    pub fn chords(&self) -> impl Iterator<Item = EdgeLine<'_>> {
        let index = NodeIndex::new(&self.nodes);
        self.edges.iter().map(move |edge| {
            let ends = [edge.start, edge.end].map(|id| index.get(id).map(|i| self.nodes[i].point));
            EdgeLine {
                id: edge.id,
                points: ends.into_iter().flatten().collect(),
                claim: None,
            }
        })
    }

    /// The first node that is given in another frame than `frame`: it cannot be compared with a map
    /// there. Nodes that name no frame are in `map`.
    #[must_use]
    pub fn node_outside_frame(&self, frame: &str) -> Option<&RouteNode> {
        self.nodes
            .iter()
            .find(|node| node.frame.as_deref().unwrap_or("map") != frame)
    }
}

impl RouteEdge {
    const fn line<'a>(&self, points: Cow<'a, [Point2]>) -> EdgeLine<'a> {
        EdgeLine {
            id: self.id,
            points,
            claim: self.clearance,
        }
    }
}

/// From a node's id to its place in the list: a table where the ids are dense, else a hash map.
pub(crate) enum NodeIndex {
    Dense(Vec<u32>),
    Sparse(HashMap<u32, u32>),
}

impl NodeIndex {
    const NONE: u32 = u32::MAX;

    /// Of two nodes with one id the first counts; see [`Self::get`].
    pub(crate) fn new(nodes: &[RouteNode]) -> Self {
        let above = nodes.iter().map(|node| node.id as usize + 1).max();
        let above = above.unwrap_or(0);
        let numbered = nodes.iter().zip(0_u32..);
        if above <= 8 * nodes.len() + 1024 {
            let mut table = vec![Self::NONE; above];
            for (node, index) in numbered {
                let entry = &mut table[node.id as usize];
                *entry = index.min(*entry);
            }
            return Self::Dense(table);
        }
        let mut map = HashMap::with_capacity(nodes.len());
        for (node, index) in numbered {
            map.entry(node.id).or_insert(index);
        }
        Self::Sparse(map)
    }

    pub(crate) fn get(&self, id: u32) -> Option<usize> {
        let index = match self {
            Self::Dense(table) => table.get(id as usize).copied(),
            Self::Sparse(map) => map.get(&id).copied(),
        };
        index.filter(|&i| i != Self::NONE).map(|i| i as usize)
    }
}
