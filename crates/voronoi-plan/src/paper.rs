//! The paper's own graph, literally, so that its faults can be measured.
//!
//! Source: W. Choi, C. Ryu, H. Kim, Navigation of a Mobile Robot using Mono-Vision and Mono-Audition,
//! IEEE Int. Conf. on Systems, Man, and Cybernetics 1999, section 2.2 and Fig. 5. Its authors admit arcs
//! through obstacles (Fig. 13). Here each arc carries its exact clearance to the map as it was before
//! any cleaning: 0 where it touches or crosses what is not free.

use morpho::{BitImage, CleanError, Cleaned, Cleaner, CleanerParams};
use occgrid::{GridPoint, MapFrame, OccupancyMap};

use crate::draft::Trace;
use crate::pack::pack;
use crate::skeleton::trace;
use crate::straight::{chord, node};
use crate::{Arc, ClearanceField, FreeSpace, NodeKind, VoronoiGraph};

/// The paper's graph and how it came about.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct PaperGraph {
    /// Straight arcs; [`VoronoiGraph::crossings`] counts those that touch or cross an obstacle.
    pub graph: VoronoiGraph,
    /// Every stage from the threshold to the thinned cells, and what each changed.
    pub cleaned: Cleaned,
}

impl PaperGraph {
    /// Fig. 5: threshold at 0.5, opening, seed fill, closing, cell growing, thinning; then a node at each
    /// thinned cell with three branches or more and a straight arc between nodes whose connecting path
    /// along thinned cells, which are free, meets no other node. Dead ends are no nodes and loops back
    /// to a node no arcs. The base of the paper is one grown cell wide: set
    /// [`cell_side`](CleanerParams::cell_side) to its width over the map's resolution.
    ///
    /// `radius` [m] is only noted in the graph: the paper's arcs keep no clearance.
    ///
    /// # Errors
    /// As [`Cleaner::clean`].
    pub fn build(
        map: &OccupancyMap,
        radius: f64,
        params: &CleanerParams,
    ) -> Result<Self, CleanError> {
        let frame = map.frame();
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        // §2.2 i): occupancy below 0.5 is clear, exactly 0.5 is not
        let clear = pack(map.values(), width, height, |value| {
            (0..50).contains(&value)
        });
        let cleaned = Cleaner::new(params.clone()).clean(clear)?;
        let field = ClearanceField::new(&FreeSpace::from_map(map));
        let chords = Chords {
            frame,
            field: &field,
            radius,
            cell_side: params.cell_side as f64,
        };
        let graph = chords.graph(&cleaned.stages.skeleton);
        Ok(Self { graph, cleaned })
    }
}

struct Chords<'a> {
    frame: &'a MapFrame,
    field: &'a ClearanceField,
    radius: f64,
    cell_side: f64,
}

impl Chords<'_> {
    fn graph(&self, skeleton: &BitImage) -> VoronoiGraph {
        let Trace { nodes, arcs } = trace(skeleton);
        let mut index = vec![usize::MAX; nodes.len()];
        let mut centers = Vec::new();
        for (n, node) in nodes.iter().enumerate() {
            if node.kind == NodeKind::Junction {
                index[n] = centers.len();
                centers.push(GridPoint {
                    col: (f64::from(node.cell.col) + 0.5) * self.cell_side,
                    row: (f64::from(node.cell.row) + 0.5) * self.cell_side,
                });
            }
        }
        let mut pairs: Vec<(usize, usize)> = arcs
            .iter()
            .map(|arc| arc.ends.map(|n| index[n]))
            .filter(|[a, b]| a != b && *a != usize::MAX && *b != usize::MAX)
            .map(|[a, b]| (a.min(b), a.max(b)))
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        VoronoiGraph {
            frame: *self.frame,
            radius: self.radius,
            nodes: centers
                .iter()
                .map(|&at| node(self.frame, self.field, self.radius, at, NodeKind::Junction))
                .collect(),
            arcs: pairs
                .into_iter()
                .map(|(from, to)| Arc {
                    from,
                    to,
                    ..chord(
                        self.frame,
                        self.field,
                        self.radius,
                        centers[from],
                        centers[to],
                    )
                })
                .collect(),
        }
    }
}
