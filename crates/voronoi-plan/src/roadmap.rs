//! The roadmap made ready for queries: adjacency in compressed rows, and every vertex a way in.

mod search;

use occgrid::{GridPoint, MapFrame};
use petgraph::unionfind::UnionFind;

pub(crate) use self::search::{Leg, Scratch, Way};
use crate::landmarks::Landmarks;
use crate::square::squared_distance;
use crate::{ClearanceField, VoronoiGraph};

/// A vertex of an arc: where queries enter and leave the roadmap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Spot {
    /// Index of the prepared arc.
    pub(crate) arc: u32,
    /// Index of the vertex in all vertices.
    pub(crate) vertex: u32,
}

/// An arc whose vertices are a range of the roadmap's.
#[derive(Debug, Clone)]
struct Track {
    /// Index in the graph; `None` for the stand-in arc of a node that has none.
    id: Option<u32>,
    ends: [u32; 2],
    first: u32,
    last: u32,
    length: f64,
}

/// One direction of an arc, at its starting node.
#[derive(Debug, Clone, Copy)]
struct Edge {
    to: u32,
    track: u32,
    cost: f32,
}

/// The arcs that keep the radius, ready for search. All lengths in cells.
#[derive(Debug, Clone)]
pub(crate) struct Roadmap {
    nodes: Vec<GridPoint>,
    component: Vec<u32>,
    rows: Vec<u32>,
    edges: Vec<Edge>,
    tracks: Vec<Track>,
    vertices: Vec<GridPoint>,
    /// Length from the start of its arc to each vertex.
    along: Vec<f64>,
    landmarks: Landmarks,
}

impl Roadmap {
    /// The arcs of a graph that keep `min` cells of clearance all along, by the field itself.
    pub(crate) fn new(
        graph: &VoronoiGraph,
        frame: &MapFrame,
        field: &ClearanceField,
        min: f64,
    ) -> Self {
        let nodes: Vec<GridPoint> = graph
            .nodes
            .iter()
            .map(|n| frame.grid_from_map(n.point))
            .collect();
        let mut road = Self {
            component: vec![0; nodes.len()],
            rows: Vec::new(),
            edges: Vec::new(),
            tracks: Vec::new(),
            vertices: Vec::new(),
            along: Vec::new(),
            landmarks: Landmarks::default(),
            nodes,
        };
        let mut has_arc = vec![false; road.nodes.len()];
        for (id, arc) in graph.arcs.iter().enumerate() {
            if arc.from < road.nodes.len() && arc.to < road.nodes.len() {
                let line = arc
                    .polyline
                    .iter()
                    .map(|&p| snapped(frame.grid_from_map(p)));
                if road.add(
                    Some(id as u32),
                    [arc.from as u32, arc.to as u32],
                    line,
                    field,
                    min,
                ) {
                    has_arc[arc.from] = true;
                    has_arc[arc.to] = true;
                }
            }
        }
        for (node, has_arc) in has_arc.into_iter().enumerate() {
            if !has_arc {
                let point = snapped(road.nodes[node]);
                road.add(None, [node as u32; 2], std::iter::once(point), field, min);
            }
        }
        road.connect();
        let edges_of = |node: u32| road.edges_of(node).map(|(_, edge)| (edge.to, edge.cost));
        road.landmarks = Landmarks::new(road.nodes.len(), road.in_largest_part(), edges_of);
        road
    }

    fn add(
        &mut self,
        id: Option<u32>,
        ends: [u32; 2],
        line: impl Iterator<Item = GridPoint>,
        field: &ClearanceField,
        min: f64,
    ) -> bool {
        let first = self.vertices.len();
        let mut length = 0.0;
        let mut clear = true;
        for point in line {
            let before = match self.vertices.len() {
                n if n == first => point,
                n => self.vertices[n - 1],
            };
            clear &= field.segment_is_clear(before, point, min);
            length += squared_distance(before, point).sqrt();
            self.vertices.push(point);
            self.along.push(length);
        }
        if !clear || self.vertices.len() == first {
            self.vertices.truncate(first);
            self.along.truncate(first);
            return false;
        }
        self.tracks.push(Track {
            id,
            ends,
            first: first as u32,
            last: self.vertices.len() as u32 - 1,
            length,
        });
        true
    }

    fn connect(&mut self) {
        let mut parts = UnionFind::<u32>::new(self.nodes.len());
        let mut degree = vec![0_u32; self.nodes.len() + 1];
        for track in self.tracks.iter().filter(|track| track.id.is_some()) {
            let [a, b] = track.ends;
            parts.union(a, b);
            degree[a as usize + 1] += 1;
            degree[b as usize + 1] += 1;
        }
        for i in 1..degree.len() {
            degree[i] += degree[i - 1];
        }
        self.rows = degree;
        let mut next = self.rows.clone();
        let none = Edge {
            to: 0,
            track: 0,
            cost: 0.0,
        };
        self.edges = vec![none; next.last().map_or(0, |&n| n as usize)];
        for (i, track) in self.tracks.iter().enumerate() {
            if track.id.is_none() {
                continue;
            }
            let [a, b] = track.ends;
            for (from, to) in [(a, b), (b, a)] {
                self.edges[next[from as usize] as usize] = Edge {
                    to,
                    track: i as u32,
                    cost: track.length as f32,
                };
                next[from as usize] += 1;
            }
        }
        self.component = parts.into_labeling();
    }

    /// Every vertex, with its arc: where the roadmap can be entered.
    pub(crate) fn spots(&self) -> impl Iterator<Item = (Spot, GridPoint)> + '_ {
        self.tracks
            .iter()
            .enumerate()
            .flat_map(move |(arc, track)| {
                (track.first..=track.last).map(move |vertex| {
                    let spot = Spot {
                        arc: arc as u32,
                        vertex,
                    };
                    (spot, self.vertices[vertex as usize])
                })
            })
    }

    /// A node of the component that has the most.
    fn in_largest_part(&self) -> u32 {
        let mut size = vec![0_u32; self.nodes.len()];
        for &part in &self.component {
            size[part as usize] += 1;
        }
        let largest = (0..size.len()).max_by_key(|&part| size[part]);
        largest.unwrap_or(0) as u32
    }

    /// The edges at a node, with their indices.
    fn edges_of(&self, node: u32) -> impl Iterator<Item = (u32, &Edge)> + '_ {
        let (first, after) = (self.rows[node as usize], self.rows[node as usize + 1]);
        (first..after).zip(&self.edges[first as usize..after as usize])
    }

    /// How many nodes there are; components are numbered below it.
    pub(crate) fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// The component of the roadmap to which a spot belongs.
    pub(crate) fn component(&self, spot: Spot) -> u32 {
        self.component[self.tracks[spot.arc as usize].ends[0] as usize]
    }

    /// The vertices of a leg, in order.
    pub(crate) fn points(&self, leg: Leg) -> impl Iterator<Item = GridPoint> + '_ {
        let steps = leg.from.abs_diff(leg.to);
        (0..=steps).map(move |i| {
            let vertex = if leg.from <= leg.to {
                leg.from + i
            } else {
                leg.from - i
            };
            self.vertices[vertex as usize]
        })
    }

    /// The graph's arc that a leg follows.
    pub(crate) fn arc_of(&self, leg: Leg) -> Option<usize> {
        self.tracks[leg.track as usize].id.map(|id| id as usize)
    }

    /// A spot at a node, if the node is on the roadmap.
    pub(crate) fn spot_at_node(&self, node: usize) -> Option<Spot> {
        let start = *self.rows.get(node)?;
        if start < *self.rows.get(node + 1)? {
            let arc = self.edges[start as usize].track;
            let track = &self.tracks[arc as usize];
            let vertex = if track.ends[0] as usize == node {
                track.first
            } else {
                track.last
            };
            return Some(Spot { arc, vertex });
        }
        let lone = self
            .tracks
            .iter()
            .position(|t| t.id.is_none() && t.ends[0] as usize == node)?;
        Some(Spot {
            arc: lone as u32,
            vertex: self.tracks[lone].first,
        })
    }
}

/// A point on a cell's centre to within rounding, exactly on it.
fn snapped(p: GridPoint) -> GridPoint {
    let snap = |v: f64| {
        let center = v.floor() + 0.5;
        if (v - center).abs() < 1e-6 { center } else { v }
    };
    GridPoint {
        col: snap(p.col),
        row: snap(p.row),
    }
}
