//! What is truly to be seen in a simulated picture, for scoring.

use occgrid::{Point2, Pose2};

use super::camera::Renderer;
use super::world::{DoorCorner, World};
use crate::real::distance;

/// A door corner in sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisibleCorner {
    /// Which.
    pub corner: DoorCorner,
    /// Where in the picture [px].
    pub pixel: [f64; 2],
}

/// A stretch of the line where a wall or furniture meets the floor, wholly in sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloorEdge {
    /// Its ends, map frame [m].
    pub ends: [Point2; 2],
    /// Its ends in the picture [px]; the line between them is straight where the lens is a pinhole.
    pub pixels: [[f64; 2]; 2],
}

/// Spacing of the places at which a floor edge is tested [m].
const STEP: f64 = 0.02;

impl Renderer {
    /// Every door corner that the camera sees: inside the picture, on a face turned to it, not hidden.
    pub fn door_corners(
        &mut self,
        world: &World,
        map_from_base: Pose2,
        time: f64,
    ) -> Vec<VisibleCorner> {
        let foot = self.look_around(world, map_from_base, time);
        let faces = |corner: &DoorCorner| {
            let (x, y) = (
                foot.origin.x - corner.position.x,
                foot.origin.y - corner.position.y,
            );
            x * corner.facing.x + y * corner.facing.y > 1e-9
        };
        let seen = world.door_corners().iter().filter(|c| faces(c));
        seen.filter_map(|corner| {
            let pixel = self.pixel_inside(map_from_base, corner.position)?;
            self.sees(&foot, corner.position, 0.0)
                .then_some(VisibleCorner {
                    corner: *corner,
                    pixel,
                })
        })
        .collect()
    }

    /// Every stretch of floor edge that the camera sees; ends are true to 1 mm where something hides
    /// the rest. People's feet are no floor edges, but hide them.
    pub fn floor_edges(
        &mut self,
        world: &World,
        map_from_base: Pose2,
        time: f64,
    ) -> Vec<FloorEdge> {
        let foot = self.look_around(world, map_from_base, time);
        let mut edges = Vec::new();
        for [a, b] in world.floor_outline() {
            // free space is on the left: seen from there, the camera is on the left too
            let left = (b.x - a.x) * (foot.origin.y - a.y) - (b.y - a.y) * (foot.origin.x - a.x);
            if left <= 0.0 {
                continue;
            }
            let at = |t: f64| Point2::new(a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t);
            let visible = |t: f64| {
                let pixel = self.pixel_inside(map_from_base, at(t))?;
                self.sees(&foot, at(t), 0.0).then_some(pixel)
            };
            for ends in stretches(distance(a, b), |t| visible(t).is_some()) {
                let pixels = ends.map(visible);
                if let [Some(p), Some(q)] = pixels {
                    edges.push(FloorEdge {
                        ends: ends.map(at),
                        pixels: [p, q],
                    });
                }
            }
        }
        edges
    }

    fn pixel_inside(&self, map_from_base: Pose2, point: Point2) -> Option<[f64; 2]> {
        let camera = self.camera();
        let [u, v] = camera.pixel_of(map_from_base, point, 0.0)?;
        let inside = |x: f64, size: u32| x >= -0.5 && x <= f64::from(size) - 0.5;
        (inside(u, camera.width) && inside(v, camera.height)).then_some([u, v])
    }
}

/// The parts of 0..1, along a line of this length, on which `holds`; found where they are longer than
/// [`STEP`].
fn stretches(length: f64, holds: impl Fn(f64) -> bool) -> Vec<[f64; 2]> {
    let steps = (length / STEP).ceil().clamp(1.0, 1e5) as usize;
    let border = |mut inside: f64, mut outside: f64| {
        while (inside - outside).abs() * length > 1e-3 {
            let middle = (inside + outside) / 2.0;
            if holds(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    };
    let mut found = Vec::new();
    let (mut begin, mut before) = (None, 0.0);
    for step in 0..=steps {
        let t = step as f64 / steps as f64;
        match (holds(t), begin) {
            (true, None) => begin = Some(if step == 0 { 0.0 } else { border(t, before) }),
            (false, Some(from)) => {
                found.push([from, border(before, t)]);
                begin = None;
            }
            _ => {}
        }
        before = t;
    }
    found.extend(begin.map(|from| [from, 1.0]));
    found
}
