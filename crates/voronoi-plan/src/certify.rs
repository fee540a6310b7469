//! Certificates: the exact clearance of every arc, rounded down.

use occgrid::{Cell, GridPoint, MapFrame};

use crate::clearance::claim;
use crate::draft::{Trace, TraceArc};
use crate::lattice::Lattice;
use crate::nearest::nearest;
use crate::{Arc, Node, VoronoiGraph};

/// The graph of a trace whose every link is in the lattice.
pub(crate) fn certify(
    trace: Trace,
    frame: &MapFrame,
    lattice: &Lattice<'_>,
    radius: f64,
) -> VoronoiGraph {
    let certifier = Certifier {
        frame,
        lattice,
        radius,
    };
    let Trace { nodes, mut arcs } = trace;
    let mut order: Vec<usize> = (0..nodes.len()).collect();
    order.sort_by_key(|&n| (nodes[n].cell.row, nodes[n].cell.col));
    let mut rank = vec![0; nodes.len()];
    for (new, &old) in order.iter().enumerate() {
        rank[old] = new;
    }
    for arc in &mut arcs {
        arc.ends = arc.ends.map(|n| rank[n]);
        let back = arc.path.iter().rev();
        let key = |cell: &Cell| (cell.row, cell.col);
        if arc.ends[0] > arc.ends[1]
            || arc.ends[0] == arc.ends[1] && back.map(key).lt(arc.path.iter().map(key))
        {
            arc.ends.reverse();
            arc.path.reverse();
        }
    }
    arcs.sort_by(|a, b| {
        let key = |arc: &TraceArc| (arc.ends, arc.path.len());
        let cells = |arc: &TraceArc| arc.path.iter().map(|c| (c.row, c.col)).collect::<Vec<_>>();
        key(a).cmp(&key(b)).then_with(|| cells(a).cmp(&cells(b)))
    });
    VoronoiGraph {
        frame: *frame,
        radius,
        nodes: order
            .iter()
            .map(|&n| Node {
                cell: nodes[n].cell,
                point: frame.center_of(nodes[n].cell),
                clearance: certifier.claim(lattice.squared_doubled(nodes[n].cell)),
                kind: nodes[n].kind,
            })
            .collect(),
        arcs: arcs.iter().map(|arc| certifier.arc(arc)).collect(),
    }
}

struct Certifier<'a> {
    frame: &'a MapFrame,
    lattice: &'a Lattice<'a>,
    radius: f64,
}

impl Certifier<'_> {
    /// `(2 d)^2` in metres.
    fn metres(&self, squared_doubled: u32) -> f64 {
        f64::from(squared_doubled).sqrt() / 2.0 * self.frame.resolution()
    }

    /// The claim for a clearance that suffices for the radius.
    fn claim(&self, squared_doubled: u32) -> f64 {
        claim(self.metres(squared_doubled), self.radius).max(self.radius)
    }

    fn arc(&self, arc: &TraceArc) -> Arc {
        let path = &arc.path;
        let clearances: Vec<u32> = path
            .iter()
            .map(|&cell| self.lattice.squared_doubled(cell))
            .collect();
        let narrowest = self.narrowest(path, &clearances);
        let mut links = [0_u32; 2];
        for pair in path.windows(2) {
            links[usize::from(pair[0].col != pair[1].col && pair[0].row != pair[1].row)] += 1;
        }
        let [straight, diagonal] = links.map(f64::from);
        Arc {
            from: arc.ends[0],
            to: arc.ends[1],
            polyline: path.iter().map(|&c| self.frame.center_of(c)).collect(),
            length: (straight + diagonal * std::f64::consts::SQRT_2) * self.frame.resolution(),
            clearance: self.claim(narrowest.squared_doubled),
            width_profile: clearances
                .iter()
                .map(|&clearance| round_down(self.metres(clearance)))
                .collect(),
            bottleneck: self.frame.map_from_grid(narrowest.at),
            nearest_obstacle: self.frame.map_from_grid(narrowest.obstacle),
        }
    }

    /// Where a path is nearest to a not-free cell: at a cell's centre or midway to the next.
    fn narrowest(&self, path: &[Cell], clearances: &[u32]) -> Narrowest {
        let (mut least, mut cell) = (u32::MAX, path[0]);
        for (&clearance, &at) in clearances.iter().zip(path) {
            if clearance < least {
                (least, cell) = (clearance, at);
            }
        }
        for (link, ends) in path.windows(2).zip(clearances.windows(2)) {
            let ends = ends[0].min(ends[1]);
            if let Some((squared_doubled, obstacle)) = self
                .lattice
                .corner_beside(link[0], link[1], ends)
                .filter(|&(squared_doubled, _)| squared_doubled < least)
            {
                return Narrowest {
                    squared_doubled,
                    at: between(link[0], link[1]),
                    obstacle,
                };
            }
        }
        let at = between(cell, cell);
        Narrowest {
            squared_doubled: least,
            at,
            obstacle: nearest(self.lattice.free_cells(), cell).point(at),
        }
    }
}

/// The narrowest place of a path.
struct Narrowest {
    squared_doubled: u32,
    at: GridPoint,
    obstacle: GridPoint,
}

/// The grid point midway between two cells' centres.
fn between(a: Cell, b: Cell) -> GridPoint {
    GridPoint {
        col: f64::from(a.col + b.col + 1) / 2.0,
        row: f64::from(a.row + b.row + 1) / 2.0,
    }
}

/// The greatest `f32` that is not above.
pub(crate) fn round_down(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) > value {
        near.next_down()
    } else {
        near
    }
}
