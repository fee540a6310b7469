//! The same roadmap for programs that drive straight from node to node, as Nav2's route server does: it
//! reads an edge's ends and ignores what is drawn between them.

use occgrid::{GridPoint, MapFrame};

use crate::certify::round_down;
use crate::clearance::claim;
use crate::{Arc, ClearanceField, FreeSpace, Node, NodeKind, VoronoiGraph};

impl VoronoiGraph {
    /// This graph with every arc cut into straight ones that keep the radius: nodes of the kind
    /// [`NodeKind::Bend`] are added at the cuts, as few as a greedy walk along each arc needs. Every
    /// straight arc carries its own certificate. An arc that did not keep the radius is cut at every
    /// point of its polyline.
    ///
    /// Linear in the cells of the map, plus a segment test for each doubling and halving of a cut.
    #[must_use]
    pub fn straightened(&self, space: &FreeSpace) -> Self {
        let field = ClearanceField::new(space);
        let mut straight = Self {
            arcs: Vec::with_capacity(self.arcs.len()),
            ..self.clone()
        };
        for arc in &self.arcs {
            straight.cut(arc, &field);
        }
        straight
    }

    /// Adds the straight pieces of an arc and the nodes between them.
    fn cut(&mut self, arc: &Arc, field: &ClearanceField) {
        let min = self.radius / self.frame.resolution();
        let frame = self.frame;
        let points: Vec<GridPoint> = arc
            .polyline
            .iter()
            .map(|&p| frame.grid_from_map(p))
            .collect();
        let last = points.len() - 1;
        let (mut from, mut at) = (arc.from, 0);
        while at < last {
            let mut next = farthest(at, last, |to| {
                field.segment_is_clear(points[at], points[to], min)
            });
            if arc.from == arc.to && at == 0 && next == last {
                // a loop needs a point away from its node
                next = (last / 2).max(1);
                next = farthest(at, next, |to| {
                    field.segment_is_clear(points[at], points[to], min)
                });
            }
            let to = if next == last {
                arc.to
            } else {
                let kind = NodeKind::Bend;
                self.nodes
                    .push(node(&frame, field, self.radius, points[next], kind));
                self.nodes.len() - 1
            };
            let (a, b) = (points[at], points[next]);
            let piece = chord(&frame, field, self.radius, a, b);
            self.arcs.push(Arc { from, to, ..piece });
            (from, at) = (to, next);
        }
    }
}

/// A point after `at`, as far as doubling and halving find one up to `last` to which the way is clear;
/// the next one at least.
fn farthest(at: usize, last: usize, clear: impl Fn(usize) -> bool) -> usize {
    let mut good = at + 1;
    let mut step = 2;
    let mut bad = last + 1;
    while good < last {
        let to = (at + step).min(last);
        if !clear(to) {
            bad = to;
            break;
        }
        good = to;
        step *= 2;
    }
    while bad - good > 1 && bad <= last {
        let middle = good.midpoint(bad);
        if clear(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

/// A node with its exact clearance.
pub(crate) fn node(
    frame: &MapFrame,
    field: &ClearanceField,
    radius: f64,
    at: GridPoint,
    kind: NodeKind,
) -> Node {
    Node {
        cell: occgrid::Cell::new(at.col as u32, at.row as u32),
        point: frame.map_from_grid(at),
        clearance: claim(field.of_point(at) * frame.resolution(), radius),
        kind,
    }
}

/// A straight arc with its exact clearance; whose ends it joins is for the caller to fill in.
pub(crate) fn chord(
    frame: &MapFrame,
    field: &ClearanceField,
    radius: f64,
    a: GridPoint,
    b: GridPoint,
) -> Arc {
    let narrowest = field.of_segment(a, b);
    let polyline = vec![frame.map_from_grid(a), frame.map_from_grid(b)];
    let width = |at| round_down(field.of_point(at) * frame.resolution());
    Arc {
        from: 0,
        to: 0,
        length: polyline[0].distance(polyline[1]),
        polyline,
        clearance: claim(narrowest.clearance * frame.resolution(), radius),
        width_profile: [a, b].map(width).to_vec(),
        bottleneck: frame.map_from_grid(narrowest.at),
        nearest_obstacle: frame.map_from_grid(narrowest.obstacle),
    }
}
