//! The independent verifier: how near do the edges of a route graph come to what is not free?
//!
//! It shares no code with the builder: it works from the map's own values, by the exact distance of
//! straight segments to cell squares (no bit image, no distance transform, no sampling), so that it can
//! judge the builder's certificates and graphs that others drew alike.
//!
//! Clearance is the Euclidean distance from an edge's centre line to the nearest point of any cell that
//! is not free, 0 where it touches or crosses one. Everything outside the map is not free.
//!
//! Distances are computed in `f64` in grid coordinates. A clearance counts as short, and a claim as
//! excessive, only where the difference is above [`tolerance`], a nanometre for maps within a few hundred
//! kilometres of their origin: rounding alone is no fault.

mod obstacle_tree;
mod segment;

use std::borrow::Cow;

use occgrid::{GridPoint, MapFrame, OccupancyMap, Point2};

use obstacle_tree::{Nearest, ObstacleTree};
use segment::{Segment, Square, Vertex};

/// What unknown cells count as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UnknownIs {
    /// Not free: a robot is kept away from them.
    #[default]
    Occupied,
    /// Free: only cells known to be occupied are obstacles.
    Free,
}

/// What to hold edges to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckParams {
    /// The least clearance that is no violation [m]. Touching or crossing is one at any radius.
    pub radius: f64,
    /// What unknown cells count as.
    pub unknown: UnknownIs,
}

/// An edge as the verifier sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeLine<'a> {
    /// Its name in the report.
    pub id: u32,
    /// Its centre line in the map frame: straight between neighbours; one point is a degenerate edge.
    pub points: Cow<'a, [Point2]>,
    /// The clearance that it claims to have [m].
    pub claim: Option<f64>,
}

/// The least clearance of a line, and where.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct LineClearance {
    /// [m]; 0 for a line that touches or crosses what is not free, leaves the map, has no point, or has
    /// a point that is not finite.
    pub clearance: f64,
    /// The point of the line where it is least; where an obstacle is crossed, a point inside it.
    pub at: Point2,
}

/// An edge that comes too near.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Violation {
    /// The edge.
    pub edge: u32,
    /// Its true clearance [m].
    pub clearance: f64,
    /// Where it is least.
    pub at: Point2,
}

/// An edge that claims more clearance than it has.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Overclaim {
    /// The edge.
    pub edge: u32,
    /// What it claims [m].
    pub claimed: f64,
    /// Its true clearance [m].
    pub clearance: f64,
    /// Where it is least.
    pub at: Point2,
}

/// What the verifier found.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Report {
    /// Edges looked at.
    pub edges: usize,
    /// Edges under the radius, the worst first, in the order given where equal.
    pub violations: Vec<Violation>,
    /// Edges whose claim is above the truth, the greatest excess first.
    pub overclaims: Vec<Overclaim>,
    /// The least clearance of all edges [m]; `None` without edges.
    pub min_clearance: Option<f64>,
    /// The first edge that has it.
    pub worst_edge: Option<u32>,
}

impl Report {
    /// Whether no edge is under the radius and no claim above the truth.
    #[must_use]
    pub const fn is_clean(&self) -> bool {
        self.violations.is_empty() && self.overclaims.is_empty()
    }
}

/// Differences of clearance up to this are rounding [m]: 1e-9 m, or more where the map's coordinates are
/// so large that `f64` does not resolve it.
#[must_use]
pub fn tolerance(frame: &MapFrame) -> f64 {
    let side = frame.resolution() * f64::from(frame.width().max(frame.height()));
    let farthest = frame.origin().x.abs().max(frame.origin().y.abs()) + side;
    1e-9_f64.max(32.0 * f64::EPSILON * farthest)
}

/// The obstacles of one map, ready to be asked for exact clearances.
///
/// Takes one bit a cell. A query takes time in proportion to the blocks of 8 x 8 cells that the line
/// passes within its own clearance, not to the map.
#[derive(Debug, Clone)]
pub struct ClearanceProbe {
    frame: MapFrame,
    obstacles: ObstacleTree,
}

impl ClearanceProbe {
    /// The obstacles of a map.
    #[must_use]
    pub fn new(map: &OccupancyMap, unknown: UnknownIs) -> Self {
        Self {
            frame: *map.frame(),
            obstacles: ObstacleTree::new(map, unknown),
        }
    }

    /// The exact clearance of a polyline of the map frame.
    #[must_use]
    pub fn clearance(&self, points: &[Point2]) -> LineClearance {
        let found = self.least_below(points, f64::INFINITY, &mut None);
        found.unwrap_or(LineClearance {
            clearance: 0.0,
            at: self.a_point_of(points),
        })
    }

    /// The exact clearance if it is below `bound` [m], else `None`. `hint` is an obstacle near by, and
    /// becomes the nearest one: neighbours mostly share it, which spares most of the search.
    fn least_below(
        &self,
        points: &[Point2],
        bound: f64,
        hint: &mut Option<Square>,
    ) -> Option<LineClearance> {
        let resolution = self.frame.resolution();
        let zero_at = |at| Some(LineClearance { clearance: 0.0, at });
        if points.is_empty() {
            return zero_at(self.a_point_of(points));
        }
        let (margin, outermost) = match self.outermost(points) {
            Ok(found) => found,
            Err(at) => return zero_at(at),
        };
        let mut best = Nearest::bounded_by(margin.min(bound / resolution));
        let mut best_segment = None;
        let mut a = self.vertex(points[0]);
        for point in points
            .get(1..)
            .filter(|rest| !rest.is_empty())
            .unwrap_or(points)
        {
            let segment = Segment {
                a,
                b: self.vertex(*point),
            };
            a = segment.b;
            let before = best.distance2;
            if let Some(cell) = *hint {
                best.offer(&segment, cell);
            }
            self.obstacles.nearest(&segment, &mut best);
            if best.distance2 < before {
                best_segment = Some(segment);
                *hint = best.cell;
            }
            if best.distance2 <= 0.0 {
                break;
            }
        }
        if let (Some(cell), Some(segment)) = (best.cell, best_segment) {
            let Vertex { x, y } = segment.nearest_point(&cell);
            return Some(LineClearance {
                clearance: best.distance2.sqrt() * resolution,
                at: self.frame.map_from_grid(GridPoint { col: x, row: y }),
            });
        }
        (margin * resolution <= bound).then_some(LineClearance {
            clearance: margin * resolution,
            at: outermost,
        })
    }

    /// The least distance to the outside of the map [cells], and where; or the first point that is not
    /// inside. The map is convex, so a line is nearest to the outside at a vertex.
    fn outermost(&self, points: &[Point2]) -> Result<(f64, Point2), Point2> {
        let mut nearest = (f64::INFINITY, self.a_point_of(points));
        for &point in points {
            let here = self.margin(self.vertex(point));
            if here.is_nan() || here <= 0.0 {
                let finite = point.x.is_finite() && point.y.is_finite();
                return Err(if finite {
                    point
                } else {
                    self.a_point_of(points)
                });
            }
            if here < nearest.0 {
                nearest = (here, point);
            }
        }
        Ok(nearest)
    }

    fn vertex(&self, point: Point2) -> Vertex {
        let GridPoint { col, row } = self.frame.grid_from_map(point);
        Vertex { x: col, y: row }
    }

    /// Distance to the outside of the map [cells], negative out there, NaN for what is no number.
    fn margin(&self, p: Vertex) -> f64 {
        let (width, height) = (
            f64::from(self.frame.width()),
            f64::from(self.frame.height()),
        );
        if p.x.is_nan() || p.y.is_nan() {
            return f64::NAN;
        }
        p.x.min(width - p.x).min(p.y.min(height - p.y))
    }

    /// The first finite point of a line, else the map's origin: a report names a place on the map.
    fn a_point_of(&self, points: &[Point2]) -> Point2 {
        points
            .iter()
            .copied()
            .find(|p| p.x.is_finite() && p.y.is_finite())
            .unwrap_or_else(|| self.frame.origin().position())
    }
}

/// Verifies edges against a map. Every clearance in the report is exact (within [`tolerance`]); edges
/// that are neither short, nor over-claimed, nor the worst so far are only bounded, which is cheap.
#[must_use]
pub fn check<'a>(
    edges: impl IntoIterator<Item = EdgeLine<'a>>,
    map: &OccupancyMap,
    params: &CheckParams,
) -> Report {
    let probe = ClearanceProbe::new(map, params.unknown);
    let slack = tolerance(map.frame());
    let mut report = Report::default();
    let (mut least, mut hint) = (f64::INFINITY, None);
    for EdgeLine { id, points, claim } in edges {
        report.edges += 1;
        // what must be known exactly: anything below one of these
        let asked = claim.map_or(0.0, |c| if c.is_nan() { f64::INFINITY } else { c });
        let bound = params.radius.max(asked).max(least) + 2.0 * slack;
        let Some(LineClearance { clearance, at }) = probe.least_below(&points, bound, &mut hint)
        else {
            continue;
        };
        if clearance < least || report.worst_edge.is_none() {
            least = clearance;
            report.min_clearance = Some(clearance);
            report.worst_edge = Some(id);
        }
        if clearance < params.radius - slack || clearance <= slack {
            report.violations.push(Violation {
                edge: id,
                clearance,
                at,
            });
        }
        let excessive = |claimed: &f64| claimed.is_nan() || *claimed > clearance + slack;
        if let Some(claimed) = claim.filter(excessive) {
            report.overclaims.push(Overclaim {
                edge: id,
                claimed,
                clearance,
                at,
            });
        }
    }
    report
        .violations
        .sort_by(|p, q| p.clearance.total_cmp(&q.clearance));
    let excess = |o: &Overclaim| o.claimed - o.clearance;
    report
        .overclaims
        .sort_by(|p, q| excess(q).total_cmp(&excess(p)));
    report
}
