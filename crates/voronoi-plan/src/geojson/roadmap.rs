//! A Voronoi graph as a route graph, and back without loss.

use occgrid::{Cell, MapFrame, Point2, Pose2};
use serde::{Deserialize, Serialize};

use super::{MEMBER, NodeIndex, RouteEdge, RouteGraph, RouteGraphError, RouteNode};
use crate::{Arc, Node, NodeKind, VoronoiGraph};

/// The version of the members below.
const VERSION: u32 = 1;

/// What the collection carries of a Voronoi graph.
#[derive(Serialize, Deserialize)]
struct GraphMember {
    version: u32,
    width: u32,
    height: u32,
    resolution: f64,
    origin: [f64; 3],
    radius: f64,
}

#[derive(Serialize, Deserialize)]
struct NodeMember {
    kind: NodeKind,
    cell: [u32; 2],
    clearance: f64,
}

/// What an edge carries: the arc as it was traced, or only that it is the way back along another edge.
#[derive(Serialize, Deserialize, Default)]
struct EdgeMember {
    #[serde(skip_serializing_if = "Option::is_none")]
    reverse_of: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    arc: Option<ArcMember>,
}

#[derive(Serialize, Deserialize)]
struct ArcMember {
    length: f64,
    bottleneck: [f64; 2],
    nearest_obstacle: [f64; 2],
    width_profile: Vec<f32>,
}

impl RouteGraph {
    /// Two directed edges an arc, the second with the polyline reversed; nodes numbered from 0, edges
    /// after them. The cost is the arc's length; `clearance` is its certificate, in the properties and
    /// (for Nav2's plugins) in `metadata`.
    ///
    /// # Panics
    /// If nodes and edges together are more than 2^32, or an arc names a node that is not there.
    #[must_use]
    pub fn from_voronoi(graph: &VoronoiGraph) -> Self {
        let number = |index: usize| u32::try_from(index).expect("fewer than 2^32 nodes and edges");
        let nodes = graph.nodes.iter().enumerate();
        let nodes = nodes.map(|(index, node)| RouteNode::from_voronoi(number(index), node));
        let mut edges = Vec::with_capacity(2 * graph.arcs.len());
        for (index, arc) in graph.arcs.iter().enumerate() {
            assert!(
                arc.from.max(arc.to) < graph.nodes.len(),
                "arc {index} joins nodes {} and {} of {}",
                arc.from,
                arc.to,
                graph.nodes.len()
            );
            let id = number(graph.nodes.len() + 2 * index);
            let forward = RouteEdge::from_voronoi(id, number(arc.from), number(arc.to), arc);
            let backward = forward.reversed(number(graph.nodes.len() + 2 * index + 1));
            edges.extend([forward, backward]);
        }
        let origin = graph.frame.origin();
        Self {
            nodes: nodes.collect(),
            edges,
            voronoi: text(&GraphMember {
                version: VERSION,
                width: graph.frame.width(),
                height: graph.frame.height(),
                resolution: graph.frame.resolution(),
                origin: [origin.x, origin.y, origin.theta],
                radius: graph.radius,
            }),
        }
    }

    /// The Voronoi graph that was written, equal in every field. Its certificates are what the file
    /// claims: [`crate::check::check`] tells whether they hold on a map.
    ///
    /// # Errors
    /// [`RouteGraphError::Collection`] where the file was not written from a Voronoi graph;
    /// [`RouteGraphError::Element`] where a node or edge has been changed so that it no longer is one.
    pub fn to_voronoi(&self) -> Result<VoronoiGraph, RouteGraphError> {
        let collection = |expected, found| RouteGraphError::Collection {
            key: MEMBER,
            expected,
            found,
        };
        let expected = "the frame and radius of a saved roadmap";
        let Some(member) = self.voronoi.as_deref() else {
            return Err(collection(expected, "a route graph without".to_owned()));
        };
        let member: GraphMember = serde_json::from_str(member)
            .map_err(|error| collection(expected, error.to_string()))?;
        if member.version != VERSION {
            return Err(collection("version 1", member.version.to_string()));
        }
        let [x, y, theta] = member.origin;
        let (width, height) = (member.width, member.height);
        let frame = MapFrame::new(width, height, member.resolution, Pose2::new(x, y, theta))
            .map_err(|error| collection("a map frame", error.to_string()))?;
        let radius = member.radius;
        if !(radius.is_finite() && radius >= 0.0) {
            return Err(collection("a radius", radius.to_string()));
        }
        let nodes: Result<Vec<Node>, _> = self.nodes.iter().map(|n| n.to_voronoi(&frame)).collect();
        let nodes = nodes?;
        let index = NodeIndex::new(&self.nodes);
        let mut arcs: Vec<Arc> = Vec::with_capacity(self.edges.len() / 2);
        let mut last: Option<&RouteEdge> = None;
        for edge in &self.edges {
            if let Some(arc) = edge.to_voronoi(last, &index, &nodes)? {
                arcs.push(arc);
                last = Some(edge);
            }
        }
        Ok(VoronoiGraph {
            frame,
            radius,
            nodes,
            arcs,
        })
    }
}

impl RouteNode {
    fn from_voronoi(id: u32, node: &Node) -> Self {
        Self {
            id,
            point: node.point,
            frame: Some("map".into()),
            voronoi: text(&NodeMember {
                kind: node.kind,
                cell: [node.cell.col, node.cell.row],
                clearance: node.clearance,
            }),
            ..Self::default()
        }
    }

    fn to_voronoi(&self, frame: &MapFrame) -> Result<Node, RouteGraphError> {
        let fault = |expected, found| RouteGraphError::Element {
            what: "node",
            id: self.id,
            key: MEMBER,
            expected,
            found,
        };
        let member: NodeMember =
            parse(&self.voronoi).map_err(|found| fault("kind, cell and clearance", found))?;
        let [col, row] = member.cell;
        if col >= frame.width() || row >= frame.height() {
            return Err(fault("a cell of the map", format!("[{col}, {row}]")));
        }
        Ok(Node {
            cell: Cell::new(col, row),
            point: self.point,
            clearance: member.clearance,
            kind: member.kind,
        })
    }
}

impl RouteEdge {
    fn from_voronoi(id: u32, start: u32, end: u32, arc: &Arc) -> Self {
        #[derive(Serialize)]
        struct Metadata {
            clearance: f64,
        }
        Self {
            id,
            start,
            end,
            cost: Some(arc.length),
            overridable: Some(true),
            polyline: Some(arc.polyline.clone()),
            clearance: Some(arc.clearance),
            metadata: text(&Metadata {
                clearance: arc.clearance,
            }),
            operations: None,
            voronoi: text(&EdgeMember {
                arc: Some(ArcMember {
                    length: arc.length,
                    bottleneck: [arc.bottleneck.x, arc.bottleneck.y],
                    nearest_obstacle: [arc.nearest_obstacle.x, arc.nearest_obstacle.y],
                    width_profile: arc.width_profile.clone(),
                }),
                ..EdgeMember::default()
            }),
        }
    }

    /// The way back.
    fn reversed(&self, id: u32) -> Self {
        let polyline = self.polyline.as_ref();
        Self {
            id,
            start: self.end,
            end: self.start,
            cost: self.cost,
            overridable: self.overridable,
            polyline: polyline.map(|line| line.iter().rev().copied().collect()),
            clearance: self.clearance,
            metadata: self.metadata.clone(),
            operations: None,
            voronoi: text(&EdgeMember {
                reverse_of: Some(self.id),
                ..EdgeMember::default()
            }),
        }
    }

    /// The arc of a forward edge; `None` for the way back of the edge before it.
    fn to_voronoi(
        &self,
        before: Option<&Self>,
        index: &NodeIndex,
        nodes: &[Node],
    ) -> Result<Option<Arc>, RouteGraphError> {
        let fault = |key, expected, found| RouteGraphError::Element {
            what: "edge",
            id: self.id,
            key,
            expected,
            found,
        };
        let member: EdgeMember =
            parse(&self.voronoi).map_err(|found| fault(MEMBER, "an arc or its reverse", found))?;
        if let Some(id) = member.reverse_of {
            let found = format!("the reverse of {id}");
            let pair = before.filter(|edge| edge.id == id && self.is_reverse(edge));
            return match pair {
                Some(_) => Ok(None),
                None => Err(fault(MEMBER, "the reverse of the edge before", found)),
            };
        }
        let Some(arc) = member.arc else {
            return Err(fault(MEMBER, "an arc or its reverse", "neither".to_owned()));
        };
        let polyline = self.polyline.clone().unwrap_or_default();
        let ends = [self.start, self.end].map(|id| index.get(id));
        let ([Some(from), Some(to)], Some(first), Some(last)) =
            (ends, polyline.first(), polyline.last())
        else {
            return Err(fault(
                "coordinates",
                "a polyline between two nodes",
                "none".to_owned(),
            ));
        };
        if *first != nodes[from].point || *last != nodes[to].point {
            let found = format!("[{}, {}] to [{}, {}]", first.x, first.y, last.x, last.y);
            return Err(fault("coordinates", "a polyline from node to node", found));
        }
        if arc.width_profile.len() != polyline.len() {
            let found = format!("{} for {}", arc.width_profile.len(), polyline.len());
            return Err(fault("width_profile", "one width a point", found));
        }
        let Some(clearance) = self.clearance else {
            return Err(fault("clearance", "a number", "nothing".to_owned()));
        };
        Ok(Some(Arc {
            from,
            to,
            polyline,
            length: arc.length,
            clearance,
            width_profile: arc.width_profile,
            bottleneck: point(arc.bottleneck),
            nearest_obstacle: point(arc.nearest_obstacle),
        }))
    }

    fn is_reverse(&self, other: &Self) -> bool {
        let [here, there] = [self, other].map(|e| e.polyline.as_deref().unwrap_or_default());
        self.start == other.end && self.end == other.start && here.iter().eq(there.iter().rev())
    }
}

const fn point([x, y]: [f64; 2]) -> Point2 {
    Point2::new(x, y)
}

/// JSON text of a member. Numbers that are not finite become null, which reading refuses.
fn text(member: &impl Serialize) -> Option<Box<str>> {
    serde_json::to_string(member).ok().map(String::into)
}

fn parse<'a, T: Deserialize<'a>>(member: &'a Option<Box<str>>) -> Result<T, String> {
    match member.as_deref() {
        Some(text) => serde_json::from_str(text).map_err(|error| error.to_string()),
        None => Err("nothing".to_owned()),
    }
}
