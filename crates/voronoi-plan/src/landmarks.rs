//! Lower bounds of roadmap distances from a few landmarks and the triangle inequality (ALT: Goldberg and
//! Harrelson, Computing the shortest path: A* search meets graph theory, 2005).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// How many landmarks there are.
const LANDMARKS: usize = 8;

/// The distance from each landmark; infinite where it does not reach.
pub(crate) type Distances = [f32; LANDMARKS];

/// What every node knows of its distance from the landmarks [cells].
#[derive(Debug, Clone, Default)]
pub(crate) struct Landmarks {
    of_node: Vec<Distances>,
}

impl Landmarks {
    /// Places landmarks in the part of the graph that holds the node `within`, one after the other, each
    /// as far as can be from those before it. `edges_of` gives a node's neighbours and the lengths of the
    /// ways there. O(E log V).
    pub(crate) fn new<I: Iterator<Item = (u32, f32)>>(
        nodes: usize,
        within: u32,
        edges_of: impl Fn(u32) -> I,
    ) -> Self {
        let mut of_node = vec![[f32::INFINITY; LANDMARKS]; nodes];
        if nodes == 0 {
            return Self { of_node };
        }
        let mut nearest = distances_from(within, nodes, &edges_of);
        for landmark in 0..LANDMARKS {
            let reached = nearest.iter().enumerate().filter(|(_, d)| d.is_finite());
            let farthest = reached.max_by(|a, b| a.1.total_cmp(b.1));
            let place = farthest.map_or(within, |(node, _)| node as u32);
            let distances = distances_from(place, nodes, &edges_of);
            for ((knows, near), distance) in of_node.iter_mut().zip(&mut nearest).zip(distances) {
                knows[landmark] = distance;
                *near = if landmark == 0 {
                    distance
                } else {
                    near.min(distance)
                };
            }
        }
        Self { of_node }
    }

    /// What a node knows.
    pub(crate) fn of(&self, node: u32) -> &Distances {
        &self.of_node[node as usize]
    }

    /// The distances of a point on the way between two nodes, that far from them.
    pub(crate) fn between(&self, (a, to_a): (u32, f32), (b, to_b): (u32, f32)) -> Distances {
        let (a, b) = (self.of(a), self.of(b));
        std::array::from_fn(|i| (a[i] + to_a).min(b[i] + to_b))
    }
}

/// A lower bound of the distance between two places of the same part, to single precision.
pub(crate) fn lower_bound(a: &Distances, b: &Distances) -> f32 {
    // where no landmark reaches, the difference is NaN, which max ignores
    let difference = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    difference.fold(0.0, f32::max)
}

/// Dijkstra's algorithm from one node.
fn distances_from<I: Iterator<Item = (u32, f32)>>(
    from: u32,
    nodes: usize,
    edges_of: &impl Fn(u32) -> I,
) -> Vec<f32> {
    let mut distances = vec![f32::INFINITY; nodes];
    distances[from as usize] = 0.0;
    // non-negative floats order as their bits do
    let mut heap = BinaryHeap::from([Reverse((0_u32, from))]);
    while let Some(Reverse((key, node))) = heap.pop() {
        let here = f32::from_bits(key);
        if here > distances[node as usize] {
            continue;
        }
        for (to, length) in edges_of(node) {
            let there = here + length;
            if there < distances[to as usize] {
                distances[to as usize] = there;
                heap.push(Reverse((there.to_bits(), to)));
            }
        }
    }
    distances
}
