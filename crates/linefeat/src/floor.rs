//! Floor features: floor edges, door edges and door corners among the segments of a frame (Choi, Ryu, Kim
//! 1999, section 3.2).
//!
//! A floor edge has the floor before it and something else behind it. The floor is what lies between the
//! edge and the robot's feet, so each edge is weighed by what the picture shows there: whether it looks the
//! same from the edge down, whether it looks different beyond the edge, and whether another such edge lies
//! in between. Whatever may be a floor edge is given with a confidence, and none is dropped for a low one
//! above [`FloorParams::least_confidence`]: what it is in the building is for the pose step to say.

mod appearance;
mod disturbance;
mod plane;

use image::GrayImage;

use crate::{FloorView, Segment};
use appearance::Surroundings;
use disturbance::{FLOOR_EDGE, VERTICAL, disturbed};
use plane::Plane;

/// Parameters of [`floor_features`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FloorParams {
    /// Shortest floor edge [px], above 0. Raised: clutter goes, and walls seen between doors.
    pub edge_length_px: f64,
    /// Largest angle between a vertical and the direction to the nadir [rad], 0 to 0.5. Raised: verticals of
    /// a nodding or rolling camera stay, and floor lines that point to the robot pass for verticals.
    pub vertical_angle: f64,
    /// How far a vertical may end above the floor edge and how far beside a floor edge's end it may stand
    /// [px], above 0; a few times as far above, with less confidence. Raised: broken corners are closed, and
    /// false ones made.
    pub corner_gap_px: f64,
    /// Features below this confidence are left out, 0 to 1.
    pub least_confidence: f64,
}

impl Default for FloorParams {
    fn default() -> Self {
        Self {
            edge_length_px: 20.0,
            vertical_angle: 0.05,
            corner_gap_px: 6.0,
            least_confidence: 0.12,
        }
    }
}

/// A line where a wall, or what stands like one, meets the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FloorEdge {
    /// Index into the segments.
    pub segment: usize,
    /// How likely it is a floor edge, 0 to 1.
    pub confidence: f64,
    /// Covariance of (rho, theta) as in [`Segment`], with what moves a floor edge besides noise: shading
    /// beside it, and what stands at its ends [px^2, px rad, rad^2].
    pub covariance: [[f64; 2]; 2],
}

/// A vertical that reaches down to a floor edge.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DoorEdge {
    /// Index into the segments.
    pub segment: usize,
    /// How likely it is a vertical edge of the building, 0 to 1.
    pub confidence: f64,
}

/// Where a vertical meets the floor: at a floor edge, or where it ends.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DoorCorner {
    /// Place (u, v) [px].
    pub pixel: [f64; 2],
    /// Covariance of the place [px^2], from those of the two lines and of what moves them besides noise.
    pub covariance: [[f64; 2]; 2],
    /// How likely it is a corner of the building, 0 to 1.
    pub confidence: f64,
    /// Index into the floor edges; `None` where the vertical just ends, and no floor edge was found there.
    pub edge: Option<usize>,
    /// Index into the door edges.
    pub door_edge: usize,
}

/// The floor features of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FloorFeatures {
    /// In the order of the segments.
    pub edges: Vec<FloorEdge>,
    /// In the order of the segments.
    pub door_edges: Vec<DoorEdge>,
    /// In the order of the door edges.
    pub corners: Vec<DoorCorner>,
}

/// The floor features among the segments of a frame.
///
/// A segment is a floor edge or a door edge, or neither. Time grows with the segments and, for the search
/// of corners and of nearer edges, with the square of the candidates among them.
#[must_use]
pub fn floor_features(
    image: &GrayImage,
    segments: &[Segment],
    view: &FloorView,
    params: &FloorParams,
) -> FloorFeatures {
    let mut features = FloorFeatures::default();
    floor_features_into(image, segments, view, params, &mut features);
    features
}

/// As [`floor_features`], into a place whose buffers are used again.
pub fn floor_features_into(
    image: &GrayImage,
    segments: &[Segment],
    view: &FloorView,
    params: &FloorParams,
    features: &mut FloorFeatures,
) {
    features.edges.clear();
    features.door_edges.clear();
    features.corners.clear();
    let plane = Plane::new(view);
    let heading = plane.main_direction(segments, params.vertical_angle);
    for (index, segment) in segments.iter().enumerate() {
        if plane.is_vertical(segment, params.vertical_angle) {
            features.door_edges.push(DoorEdge {
                segment: index,
                confidence: vertical_confidence(segment),
            });
        } else if segment.length_px() >= params.edge_length_px && plane.on_floor(segment) {
            let around = Surroundings::of(image, segment, &plane);
            let aligned = plane.alignment(segment, heading);
            let confidence = around.floor_confidence() * aligned * length_share(segment, 25.0);
            features.edges.push(FloorEdge {
                segment: index,
                confidence,
                covariance: disturbed(segment, &FLOOR_EDGE, around.texture()).covariance,
            });
        }
    }
    doubt_farther(segments, &plane, &mut features.edges);
    features
        .edges
        .retain(|edge| edge.confidence >= params.least_confidence);
    for door_edge in 0..features.door_edges.len() {
        let size = image.dimensions();
        let found = corner(segments, &plane, features, door_edge, params)
            .or_else(|| foot(segments, &plane, features, door_edge, size));
        features.corners.extend(found);
    }
}

fn vertical_confidence(segment: &Segment) -> f64 {
    length_share(segment, 12.0) * segment.contrast.abs() / (segment.contrast.abs() + 8.0)
}

fn length_share(segment: &Segment, half_px: f64) -> f64 {
    let length = segment.length_px();
    length / (length + half_px)
}

/// How much of what lies closely behind a floor edge it rules out, over its own confidence.
const SHADE: f64 = 1.25;

/// What lies behind a likelier floor edge is less likely one: skirting boards, stripes, shadows on walls.
fn doubt_farther(segments: &[Segment], plane: &Plane, edges: &mut [FloorEdge]) {
    for index in 0..edges.len() {
        let FloorEdge {
            segment,
            confidence,
            ..
        } = edges[index];
        let mut factor = 1.0;
        for (other, edge) in edges.iter().enumerate() {
            if other != index && edge.confidence > 0.5 * confidence {
                let covered = plane.covered(&segments[segment], &segments[edge.segment]);
                factor *= 1.0 - (SHADE * edge.confidence * covered).min(0.98);
            }
        }
        edges[index].confidence *= factor;
    }
}

/// The corner of a vertical: where it meets the likeliest of the floor edges that it ends at.
fn corner(
    segments: &[Segment],
    plane: &Plane,
    features: &FloorFeatures,
    door_edge: usize,
    params: &FloorParams,
) -> Option<DoorCorner> {
    let door = &features.door_edges[door_edge];
    let vertical = &segments[door.segment];
    let foot = plane.lower_end(vertical);
    let meets = features
        .edges
        .iter()
        .enumerate()
        .filter_map(|(index, edge)| {
            let floor = &segments[edge.segment];
            let pixel = plane::crossing(vertical, floor)?;
            let gap = distance(foot, pixel) / params.corner_gap_px;
            let beside = plane::beyond_ends(floor, pixel).max(0.0) / params.corner_gap_px;
            // a vertical may end at the skirting board, which is drawn like it
            let near = gap <= SKIRTING_GAP && beside <= 1.0 && plane.floor_point(pixel).is_some();
            let fits = 1.0 / (1.0 + 0.25 * gap * gap + 0.5 * beside * beside);
            near.then_some((index, pixel, edge.confidence, fits))
        });
    let (edge, pixel, edge_confidence, fits) =
        meets.max_by(|a, b| (a.2 * a.3).total_cmp(&(b.2 * b.3)))?;
    let vertical = disturbed(vertical, &VERTICAL, 0.0);
    let floor = Segment {
        covariance: features.edges[edge].covariance,
        ..segments[features.edges[edge].segment]
    };
    Some(DoorCorner {
        pixel,
        covariance: shaded(
            plane::crossing_covariance(&vertical, &floor, pixel)?,
            plane.down(pixel),
        ),
        confidence: CORNER_MOST * sure(edge_confidence.sqrt() * door.confidence * fits),
        edge: Some(edge),
        door_edge,
    })
}

/// One sigma of what shade in the corner between wall and floor shifts a corner by along its vertical, which no
/// scatter along the lines shows [px].
const SHADE_PX: f64 = 0.12;

fn shaded(covariance: [[f64; 2]; 2], down: [f64; 2]) -> [[f64; 2]; 2] {
    let added = |r: usize, c: usize| SHADE_PX * SHADE_PX * down[r] * down[c];
    std::array::from_fn(|r| std::array::from_fn(|c| covariance[r][c] + added(r, c)))
}

/// How far a vertical may end above a floor edge, over [`FloorParams::corner_gap_px`].
const SKIRTING_GAP: f64 = 4.0;
/// An edge detector loses the last pixels of a line before another: its end is this far short [px].
const SHORT_PX: f64 = 2.0;
/// One sigma of where a vertical ends [px]: at the wall's foot, at its skirting, or in a doorway.
const FOOT_PX: f64 = 13.0;
/// A vertical that ends this near to the picture's border goes on outside [px].
const BORDER_PX: f64 = 6.0;
/// Share of plain corners on floor edges that are the building's, and of plain ends of verticals, counted in
/// rendered corridors. The others are furniture's, posters', or the leaf's of a recessed door.
const CORNER_MOST: f64 = 0.88;
const FOOT_MOST: f64 = 0.55;
/// Weight at which half as many are.
const HALF_SURE: f64 = 0.07;

/// How much of its share a corner of this weight (0 to 1) has, counted likewise.
fn sure(weight: f64) -> f64 {
    weight * weight / (weight * weight + HALF_SURE * HALF_SURE)
}

/// Where a vertical ends: known well across it, and roughly along it.
fn foot(
    segments: &[Segment],
    plane: &Plane,
    features: &FloorFeatures,
    door_edge: usize,
    (width, height): (u32, u32),
) -> Option<DoorCorner> {
    let door = &features.door_edges[door_edge];
    let vertical = &disturbed(&segments[door.segment], &VERTICAL, 0.0);
    let [u, v] = plane.lower_end(vertical);
    let inside = |x: f64, size: u32| x > BORDER_PX && x < f64::from(size) - 1.0 - BORDER_PX;
    if !inside(u, width) || v > f64::from(height) - 1.0 - BORDER_PX {
        return None;
    }
    plane.floor_point([u, v])?;
    let normal = [vertical.theta.cos(), vertical.theta.sin()];
    let down = plane.down([u, v]);
    let across = plane::variance_at(vertical, [u, v]);
    let along = FOOT_PX * FOOT_PX;
    let entry = |r: usize, c: usize| across * normal[r] * normal[c] + along * down[r] * down[c];
    Some(DoorCorner {
        pixel: [u + SHORT_PX * down[0], v + SHORT_PX * down[1]],
        covariance: [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]],
        confidence: FOOT_MOST * sure(door.confidence),
        edge: None,
        door_edge,
    })
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
