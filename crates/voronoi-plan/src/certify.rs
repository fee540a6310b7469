//! Certificates: the exact clearance of every arc, rounded down.

use occgrid::{Cell, GridPoint, MapFrame, Point2};

use crate::clearance::claim;
use crate::draft::{Trace, TraceArc};
use crate::lattice::Lattice;
use crate::{Arc, ClearanceField, Node, VoronoiGraph};

/// The graph of a trace whose every link is in the lattice.
pub(crate) fn certify(
    trace: Trace,
    frame: &MapFrame,
    field: &ClearanceField,
    lattice: &Lattice<'_>,
    radius: f64,
) -> VoronoiGraph {
    let certifier = Certifier {
        frame,
        field,
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
    field: &'a ClearanceField,
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
        let (least, at) = self.bottleneck(path);
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
            clearance: self.claim(least),
            width_profile: path
                .iter()
                .map(|&c| round_down(self.metres(self.lattice.squared_doubled(c))))
                .collect(),
            bottleneck: self.frame.map_from_grid(at),
            nearest_obstacle: self.obstacle(at),
        }
    }

    fn obstacle(&self, at: GridPoint) -> Point2 {
        self.frame
            .map_from_grid(self.field.of_segment(at, at).obstacle)
    }

    /// The least `(2 d)^2` of a path, and where it is: at a cell's centre or midway to the next.
    fn bottleneck(&self, path: &[Cell]) -> (u32, GridPoint) {
        let mut least = u32::MAX;
        let mut narrowest = path[0];
        for &cell in path {
            let here = self.lattice.squared_doubled(cell);
            if here < least {
                (least, narrowest) = (here, cell);
            }
        }
        let corner = path.windows(2).find_map(|link| {
            let here = self.lattice.link_squared_doubled(link[0], link[1]);
            (here < least).then_some((here, between(link[0], link[1])))
        });
        corner.unwrap_or((least, between(narrowest, narrowest)))
    }
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
