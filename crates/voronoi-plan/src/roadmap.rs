//! The roadmap made ready for queries: adjacency in compressed rows, and A* from any point of an arc to
//! any other (Hart, Nilsson and Raphael, 1968).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use occgrid::{GridPoint, MapFrame};
use petgraph::unionfind::UnionFind;

use crate::landmarks::{Distances, Landmarks, lower_bound};
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

/// A way over the roadmap.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Way {
    /// Length, penalties not counted [cells].
    pub(crate) length: f64,
    /// Vertex ranges to walk, in order; backwards where the first exceeds the second.
    pub(crate) legs: Vec<Leg>,
}

/// A part of an arc, from one of its vertices to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Leg {
    pub(crate) track: u32,
    pub(crate) from: u32,
    pub(crate) to: u32,
}

/// Where a search is going.
struct Target {
    point: GridPoint,
    distances: Distances,
}

/// Memory that searches reuse, and the penalties of the present query.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    generation: u32,
    stamp: Vec<u32>,
    cost: Vec<f32>,
    /// Lower bound of what remains.
    ahead: Vec<f32>,
    came: Vec<u32>,
    heap: BinaryHeap<Reverse<(u64, u32)>>,
    penalty: Vec<f32>,
    penalised: Vec<u32>,
}

/// No edge: the node was seeded.
const SEED: u32 = u32::MAX;

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

    /// The shortest way between two spots under the scratch's penalties. O(E log V) in the part of the
    /// roadmap where the landmarks leave the way open.
    pub(crate) fn search(&self, from: Spot, to: Spot, scratch: &mut Scratch) -> Option<Way> {
        if self.component(from) != self.component(to) {
            return None;
        }
        let start = &self.tracks[from.arc as usize];
        let goal = &self.tracks[to.arc as usize];
        let (at, end) = (
            self.along[from.vertex as usize],
            self.along[to.vertex as usize],
        );
        let mut best = f32::INFINITY;
        let mut best_end = None;
        if from.arc == to.arc {
            best = (at - end).abs() as f32 * scratch.factor(from.arc);
        }
        let before = (goal.ends[0], end as f32);
        let after = (goal.ends[1], (goal.length - end) as f32);
        let target = Target {
            point: self.vertices[to.vertex as usize],
            distances: self.landmarks.between(before, after),
        };
        scratch.begin(self.nodes.len());
        let weight = scratch.factor(from.arc);
        for (node, cost) in [(start.ends[0], at), (start.ends[1], start.length - at)] {
            self.reach(node, cost as f32 * weight, SEED, &target, scratch);
        }
        let weight = scratch.factor(to.arc);
        while let Some(Reverse((key, node))) = scratch.heap.pop() {
            let total = f32::from_bits((key >> 32) as u32);
            if total >= best {
                break;
            }
            let n = node as usize;
            let cost = scratch.cost[n];
            if total > cost + scratch.ahead[n] {
                continue;
            }
            for (side, (end, extra)) in [before, after].into_iter().enumerate() {
                if end == node && cost + extra * weight < best {
                    best = cost + extra * weight;
                    best_end = Some((node, side));
                }
            }
            for (index, edge) in self.edges_of(node) {
                let there = cost + edge.cost * scratch.factor(edge.track);
                self.reach(edge.to, there, index, &target, scratch);
            }
        }
        best.is_finite()
            .then(|| self.way(from, to, best_end, scratch))
    }

    fn reach(&self, node: u32, cost: f32, came: u32, target: &Target, scratch: &mut Scratch) {
        let n = node as usize;
        if scratch.stamp[n] != scratch.generation {
            let straight = squared_distance(self.nodes[n], target.point).sqrt() as f32;
            let bound = lower_bound(self.landmarks.of(node), &target.distances);
            scratch.ahead[n] = straight.max(bound);
            scratch.stamp[n] = scratch.generation;
        } else if scratch.cost[n] <= cost {
            return;
        }
        scratch.cost[n] = cost;
        scratch.came[n] = came;
        // non-negative floats order as their bits do; of equals the one nearer to the goal comes first
        let ahead = scratch.ahead[n];
        let key = u64::from((cost + ahead).to_bits()) << 32 | u64::from(ahead.to_bits());
        scratch.heap.push(Reverse((key, node)));
    }

    fn way(&self, from: Spot, to: Spot, end: Option<(u32, usize)>, scratch: &Scratch) -> Way {
        let mut legs = Vec::new();
        if let Some((mut node, side)) = end {
            let goal = &self.tracks[to.arc as usize];
            legs.push(Leg {
                track: to.arc,
                from: [goal.first, goal.last][side],
                to: to.vertex,
            });
            while scratch.came[node as usize] != SEED {
                let edge = scratch.came[node as usize];
                let track = &self.tracks[self.edges[edge as usize].track as usize];
                let before = self.rows.partition_point(|&row| row <= edge) as u32 - 1;
                let forward = track.ends[0] == before && track.ends[1] == node;
                let (a, b) = (track.first, track.last);
                let (from, to) = if forward { (a, b) } else { (b, a) };
                let track = self.edges[edge as usize].track;
                legs.push(Leg { track, from, to });
                node = before;
            }
            let start = &self.tracks[from.arc as usize];
            let at = self.along[from.vertex as usize];
            let forward =
                start.ends[1] == node && (start.ends[0] != node || start.length - at < at);
            legs.push(Leg {
                track: from.arc,
                from: from.vertex,
                to: if forward { start.last } else { start.first },
            });
            legs.reverse();
        } else {
            legs.push(Leg {
                track: from.arc,
                from: from.vertex,
                to: to.vertex,
            });
        }
        let along = |vertex: u32| self.along[vertex as usize];
        let length = legs
            .iter()
            .map(|leg| (along(leg.from) - along(leg.to)).abs())
            .sum();
        Way { length, legs }
    }
}

impl Scratch {
    fn begin(&mut self, nodes: usize) {
        if self.stamp.len() != nodes || self.generation == u32::MAX {
            self.stamp = vec![0; nodes];
            self.cost = vec![0.0; nodes];
            self.ahead = vec![0.0; nodes];
            self.came = vec![SEED; nodes];
            self.generation = 0;
        }
        self.generation += 1;
        self.heap.clear();
    }

    fn factor(&self, track: u32) -> f32 {
        self.penalty.get(track as usize).copied().unwrap_or(1.0)
    }

    /// Makes the arcs of a way dearer by a factor for the searches to come.
    pub(crate) fn penalise(&mut self, way: &Way, factor: f32) {
        for leg in &way.legs {
            let track = leg.track as usize;
            if self.penalty.len() <= track {
                self.penalty.resize(track + 1, 1.0);
            }
            self.penalty[track] *= factor;
            self.penalised.push(leg.track);
        }
    }

    /// Takes all penalties back.
    pub(crate) fn forgive(&mut self) {
        for track in self.penalised.drain(..) {
            self.penalty[track as usize] = 1.0;
        }
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
