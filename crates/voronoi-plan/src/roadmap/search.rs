//! A* from any point of an arc to any other (Hart, Nilsson and Raphael, 1968).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use occgrid::GridPoint;

use super::{Roadmap, Spot};
use crate::landmarks::{Distances, lower_bound};
use crate::square::squared_distance;

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
