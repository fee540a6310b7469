//! The simulated camera: one ray a pixel, sixteen at edges, then what a lens and a sensor do to it.

use image::GrayImage;
use occgrid::{Point2, Pose2};

use super::fan::{Fan, Hit, Ray};
use super::lens::{CameraModel, CameraModelError};
use super::person;
use super::sensor::Sensor;
use super::shade::{Shader, View};
use super::solid::Solid;
use super::world::World;
use crate::real::Placed;

pub use super::sensor::Look;

/// Draws what a camera sees; buffers are reused from frame to frame.
#[derive(Debug)]
pub struct Renderer {
    camera: CameraModel,
    sensor: Sensor,
    /// What every pixel's centre looks along, in the frame under the camera; with one pixel more on
    /// every side, for the differences.
    directions: Vec<[f64; 3]>,
    rays: Vec<Ray>,
    /// Flattest ray down, or 0 where a ray goes up: bounds how far the camera sees.
    flattest: f64,
    fan: Fan,
    moving: Vec<Solid>,
    light: Vec<f32>,
    surface: Vec<u32>,
}

/// Sixteen places in a pixel, one in every sixteenth of its width and of its height.
const PLACES: [[f64; 2]; 16] = {
    let mut places = [[0.0; 2]; 16];
    let mut i = 0_u32;
    while i < 16 {
        let mirrored = i.reverse_bits() >> 28;
        places[i as usize] = [
            (i as f64 + 0.5) / 16.0 - 0.5,
            (mirrored as f64 + 0.5) / 16.0 - 0.5,
        ];
        i += 1;
    }
    places
};

impl Renderer {
    /// A renderer for one camera.
    ///
    /// # Errors
    /// [`CameraModelError`] where a parameter is out of range, or the lens cannot be undone somewhere
    /// in the picture.
    pub fn new(camera: CameraModel, look: Look) -> Result<Self, CameraModelError> {
        camera.check()?;
        let (w, h) = (camera.width as usize, camera.height as usize);
        let mut directions = Vec::with_capacity((w + 2) * (h + 2));
        for row in 0..h + 2 {
            for col in 0..w + 2 {
                directions.push(camera.direction(col as f64 - 1.0, row as f64 - 1.0)?);
            }
        }
        let mut rays = Vec::with_capacity(w * h);
        for row in 0..h {
            for col in 0..w {
                rays.push(Ray::along(directions[(row + 1) * (w + 2) + col + 1]));
            }
        }
        let flattest = directions
            .iter()
            .map(|d| Ray::along(*d).slope)
            .fold(f64::INFINITY, f64::min);
        Ok(Self {
            sensor: Sensor::new(&camera, look),
            camera,
            directions,
            rays,
            flattest: flattest.max(0.0),
            fan: Fan::default(),
            moving: Vec::new(),
            light: vec![0.0; w * h],
            surface: vec![0; w * h],
        })
    }

    /// The camera.
    #[must_use]
    pub const fn camera(&self) -> &CameraModel {
        &self.camera
    }

    /// What the camera on a base at `map_from_base` sees at `time` [s]. The seed draws the noise.
    #[must_use]
    pub fn render(
        &mut self,
        world: &World,
        map_from_base: Pose2,
        time: f64,
        seed: u64,
    ) -> GrayImage {
        let map_from_foot = self.look_around(world, map_from_base, time);
        let shader = Shader::new(
            world,
            &self.moving,
            View {
                map_from_foot,
                height: self.camera.mount_height,
                pixel_angle: 1.0 / self.camera.fx,
            },
        );
        let tracer = Tracer {
            fan: &self.fan,
            shader: &shader,
            height: self.camera.mount_height,
            ceiling: world.ceiling,
        };
        for (ray, (light, surface)) in self
            .rays
            .iter()
            .zip(self.light.iter_mut().zip(&mut self.surface))
        {
            (*light, *surface) = tracer.look(ray, 1.0);
        }
        smooth_edges(
            &mut self.light,
            &self.surface,
            &self.directions,
            &self.camera,
            &tracer,
        );
        self.sensor.expose(&mut self.light, seed)
    }

    /// Whether a point of the map frame, `height` above the floor, is in sight of the camera: not behind
    /// anything nearer than 1 cm before it. The pixel may lie outside the picture.
    pub(crate) fn sees(&self, map_from_foot: &Placed, point: Point2, height: f64) -> bool {
        let p = map_from_foot.inward(point);
        let ray = Ray::along([p.x, p.y, height - self.camera.mount_height]);
        let range = p.x * ray.x + p.y * ray.y;
        self.fan.cast(&ray, range - 0.01).is_none()
    }

    /// Sorts everything around the camera; gives the frame under it.
    pub(crate) fn look_around(&mut self, world: &World, map_from_base: Pose2, time: f64) -> Placed {
        let map_from_foot = self.camera.map_from_foot(map_from_base);
        self.moving.clear();
        for walker in &world.walkers {
            self.moving.extend(person::body(walker, time));
        }
        let far = self.camera.mount_height / self.flattest;
        self.fan.sort(
            world.solids.iter().chain(&self.moving),
            &map_from_foot,
            self.camera.mount_height,
            far,
        );
        map_from_foot
    }
}

/// Follows rays to light.
struct Tracer<'a> {
    fan: &'a Fan,
    shader: &'a Shader<'a>,
    height: f64,
    ceiling: f64,
}

impl Tracer<'_> {
    /// Light along a ray, seen through `part` of a pixel's width, and the surface it comes from.
    fn look(&self, ray: &Ray, part: f64) -> (f32, u32) {
        let end = if ray.slope > 0.0 {
            self.height / ray.slope
        } else {
            // NaN for a level ray is larger than nothing: such a ray has no end
            ((self.ceiling - self.height) / -ray.slope).max(0.0)
        };
        match self.fan.cast(ray, end) {
            Some(Hit { range, solid, side }) => self.shader.solid(ray, range, solid, side, part),
            None if ray.slope > 0.0 => self.shader.floor(ray, end, part),
            None => self.shader.ceiling(),
        }
    }
}

/// Replaces every pixel that touches another surface by the mean over its area.
fn smooth_edges(
    light: &mut [f32],
    surface: &[u32],
    directions: &[[f64; 3]],
    camera: &CameraModel,
    tracer: &Tracer<'_>,
) {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let stride = w + 2;
    for row in 0..h {
        let rows = row.saturating_sub(1)..(row + 2).min(h);
        for col in 0..w {
            let own = surface[row * w + col];
            let (left, right) = (col.saturating_sub(1), (col + 2).min(w));
            let edge = rows.clone().any(|r| {
                surface[r * w + left..r * w + right]
                    .iter()
                    .any(|s| *s != own)
            });
            if !edge {
                continue;
            }
            let middle = (row + 1) * stride + col + 1;
            let half = |a: usize, b: usize| -> [f64; 3] {
                std::array::from_fn(|i| (directions[a][i] - directions[b][i]) / 2.0)
            };
            let (across, down) = (
                half(middle + 1, middle - 1),
                half(middle + stride, middle - stride),
            );
            let mut sum = 0.0_f32;
            for [u, v] in PLACES {
                let direction =
                    std::array::from_fn(|i| directions[middle][i] + u * across[i] + v * down[i]);
                sum += tracer.look(&Ray::along(direction), 0.25).0;
            }
            light[row * w + col] = sum / PLACES.len() as f32;
        }
    }
}
