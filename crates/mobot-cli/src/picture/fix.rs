//! What `mobot locate` saw in a frame, what it took it for, and the pose that follows.

use monocal::{FloorCamera, FloorPlan, GroundPoint, Lens, Match, PixelPoint, PoseFix};
use occgrid::Point2;

use super::overlay::OVERLAY_SIDE_PX;
use super::{Color, Overlay, Panel};
use crate::frame::Frame;
use crate::nav::Eye;

const FLOOR_EDGE: Color = Color(0, 200, 80);
const DOOR_EDGE: Color = Color(40, 120, 255);
const OTHER: Color = Color(250, 190, 0);
const USED: Color = Color(255, 0, 200);
const SEEN: Color = Color(0, 220, 230);
const PLAN: Color = Color(255, 90, 40);
const GRID: Color = Color(150, 170, 230);
const GRID_FIGURES: Color = Color(20, 60, 200);

/// Grid lines on the floor are this far apart, and reach this far [m].
const GRID_STEP: f64 = 0.5;
const GRID_REACH: f64 = 8.0;

/// Lines on the floor are drawn in pieces of this length [m]: they bend in a lens and end behind walls.
const STEP: f64 = 0.1;

/// Lines by kind, corners with their 95 % ellipses (three times enlarged where they are on a floor edge), a grid on the floor, and the plan
/// as it should be seen from the fix, wide and under what was found: over the frame as it is, bent as its lens bends.
#[must_use]
pub fn fix_overlay(
    frame: &Frame,
    camera: &FloorCamera,
    eye: &Eye,
    plan: &FloorPlan,
    fix: &PoseFix,
) -> Overlay {
    let nodding = camera.nodding(fix.pitch).unwrap_or_else(|| camera.clone());
    let mut drawing = Drawing {
        panel: Panel::new(frame.to_rgb(), OVERLAY_SIDE_PX),
        lens: camera.lens.filter(|lens| !lens.is_plain()),
    };
    let (lines, features) = (eye.segments(), eye.features());
    let floor = Floor::new(plan, fix, nodding, eye.foot());
    floor.grid(&mut drawing.panel);
    for [a, b] in &floor.walls {
        let along = |t: f64| Point2::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y));
        let steps = (a.distance(*b) / STEP).clamp(1.0, 2000.0) as u32;
        let points = (0..=steps).map(|k| along(f64::from(k) / f64::from(steps)));
        floor.line(&mut drawing.panel, points, PLAN, 3.0);
    }
    for (index, line) in lines.iter().enumerate() {
        let color = if features.edges.iter().any(|e| e.segment == index) {
            FLOOR_EDGE
        } else if features.door_edges.iter().any(|e| e.segment == index) {
            DOOR_EDGE
        } else {
            OTHER
        };
        drawing.line(line.start, line.end, color, 2.0);
    }
    for m in &fix.matched {
        if let Match::Edge { edge, .. } = *m {
            let line = &lines[features.edges[edge].segment];
            for end in [line.start, line.end] {
                drawing.dot(end, USED, 4.0);
            }
        }
    }
    for (index, corner) in features.corners.iter().enumerate() {
        let used = fix
            .matched
            .iter()
            .any(|m| matches!(m, Match::Corner { corner, .. } if *corner == index));
        let color = if used { USED } else { SEEN };
        if let Some(at) = drawing.place(corner.pixel) {
            // the ends of verticals that stand on no floor edge are known roughly: enlarged, they would hide the rest
            let enlarged = if corner.edge.is_some() { 3.0 } else { 1.0 };
            drawing
                .panel
                .ellipse(at, corner.covariance, enlarged, color);
            drawing.panel.dot(at, color, 3.0);
        }
    }
    let mut overlay = Overlay::new(vec![drawing.panel]);
    for (color, note) in [
        (FLOOR_EDGE, "floor edges"),
        (DOOR_EDGE, "verticals"),
        (OTHER, "other lines"),
        (
            USED,
            "matched: ends of edges, corners with 95 % ellipses, on floor edges three times enlarged",
        ),
        (SEEN, "corners and ends of verticals, not matched"),
        (PLAN, "walls of the plan, seen from the fix"),
        (GRID, "grid on the floor, 0.5 m, metres ahead of the robot"),
    ] {
        overlay.note(color, note);
    }
    overlay
}

/// A frame to draw on in undistorted pixels.
struct Drawing {
    panel: Panel,
    lens: Option<Lens>,
}

impl Drawing {
    /// Where in the frame an undistorted pixel is.
    fn place(&self, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let Some(lens) = &self.lens else {
            return Some([u, v]);
        };
        lens.distort(PixelPoint::new(u, v)).map(|p| [p.u, p.v])
    }

    /// A straight line, bent by the lens.
    fn line(&mut self, from: [f64; 2], to: [f64; 2], color: Color, width_px: f64) {
        let steps = if self.lens.is_some() { 16 } else { 1 };
        let along = |k: u32| {
            let t = f64::from(k) / f64::from(steps);
            [0, 1].map(|i| from[i] + t * (to[i] - from[i]))
        };
        let points: Vec<[f64; 2]> = (0..=steps).filter_map(|k| self.place(along(k))).collect();
        self.panel.line(&points, color, width_px);
    }

    fn dot(&mut self, at: [f64; 2], color: Color, radius_px: f64) {
        if let Some(at) = self.place(at) {
            self.panel.dot(at, color, radius_px);
        }
    }
}

/// The floor and what of it is in sight of the camera, in base axes.
struct Floor {
    camera: FloorCamera,
    foot: Point2,
    walls: Vec<[Point2; 2]>,
}

impl Floor {
    fn new(plan: &FloorPlan, fix: &PoseFix, camera: FloorCamera, foot: Point2) -> Self {
        let base = fix.pose.inverse();
        let near = |[a, b]: &[Point2; 2]| {
            let length = a.distance(*b);
            a.distance(foot).min(b.distance(foot)) < GRID_REACH + length
        };
        let walls = plan.walls.iter().map(|w| w.map(|p| base.transform_from(p)));
        Self {
            camera,
            foot,
            walls: walls.filter(near).collect(),
        }
    }

    /// Whether no wall stands before a floor point.
    fn in_sight(&self, point: Point2) -> bool {
        let side =
            |a: Point2, b: Point2, p: Point2| (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
        // a hand's breadth short, for what is on a wall
        let range = self.foot.distance(point);
        let t = ((range - 0.05) / range).max(0.0);
        let end = Point2::new(
            self.foot.x + t * (point.x - self.foot.x),
            self.foot.y + t * (point.y - self.foot.y),
        );
        !self.walls.iter().any(|&[a, b]| {
            side(self.foot, end, a) * side(self.foot, end, b) < 0.0
                && side(a, b, self.foot) * side(a, b, end) < 0.0
        })
    }

    /// Lines every half metre, whole metres ahead in figures.
    fn grid(&self, panel: &mut Panel) {
        let count = (GRID_REACH / GRID_STEP) as i32;
        let steps = (GRID_REACH / STEP) as i32;
        let fine = |k: i32| f64::from(k) * STEP;
        for k in 0..=count {
            let x = f64::from(k) * GRID_STEP;
            let across = (-steps..=steps).map(|j| Point2::new(x, fine(j)));
            self.line(panel, across, GRID, 1.0);
        }
        for k in -count..=count {
            let y = f64::from(k) * GRID_STEP;
            let along = (0..=steps).map(|j| Point2::new(fine(j), y));
            self.line(panel, along, GRID, 1.0);
        }
        for metres in 1..=GRID_REACH as i32 {
            let place = Point2::new(f64::from(metres), 0.0);
            if let Some(at) = self.place(place) {
                panel.label(at, GRID_FIGURES, format!("{metres} m"));
            }
        }
    }

    /// Where a floor point is seen.
    fn place(&self, point: Point2) -> Option<[f64; 2]> {
        let pixel = self.camera.pixel_of(GroundPoint::new(point.x, point.y))?;
        let near = pixel.u.abs() < 1e5 && pixel.v.abs() < 1e5;
        (near && self.in_sight(point)).then_some([pixel.u, pixel.v])
    }

    /// A line through floor points, as far as the camera sees them.
    fn line(
        &self,
        panel: &mut Panel,
        points: impl Iterator<Item = Point2>,
        color: Color,
        width_px: f64,
    ) {
        let mut run: Vec<[f64; 2]> = Vec::new();
        for point in points {
            match self.place(point) {
                Some(place) => run.push(place),
                None => panel.line(&std::mem::take(&mut run), color, width_px),
            }
        }
        panel.line(&run, color, width_px);
    }
}
