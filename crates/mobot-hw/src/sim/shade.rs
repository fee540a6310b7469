//! How bright a surface looks: its paint, its pattern, the light on it.

use occgrid::Point2;

use super::fan::Ray;
use super::solid::{BOTTOM, Footprint, Solid, TOP};
use super::texture;
use super::world::World;
use crate::real::{Placed, length};

/// From where a picture is taken.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View {
    pub(crate) map_from_foot: Placed,
    /// Of the camera above the floor.
    pub(crate) height: f64,
    /// What one pixel sees, about.
    pub(crate) pixel_angle: f64,
}

pub(crate) struct Shader<'a> {
    world: &'a World,
    moving: &'a [Solid],
    view: View,
    patches: Vec<(Placed, super::building::Patch)>,
}

/// Identities of surfaces: floor, ceiling, and 64 for every solid.
const FLOOR: u32 = 0;
const CEILING: u32 = 1;
const FIRST_SOLID: u32 = 64;
const CEILING_BRIGHTNESS: f32 = 0.85;

impl<'a> Shader<'a> {
    pub(crate) fn new(world: &'a World, moving: &'a [Solid], view: View) -> Self {
        let patches = world.floor.patches.iter().map(|p| {
            let [x, y] = p.at;
            let pose = occgrid::Pose2::new(x, y, p.yaw_deg.to_radians());
            (Placed::at(pose), *p)
        });
        Self {
            world,
            moving,
            view,
            patches: patches.collect(),
        }
    }

    #[expect(clippy::unused_self, reason = "beside the other surfaces")]
    pub(crate) fn ceiling(&self) -> (f32, u32) {
        (CEILING_BRIGHTNESS, CEILING)
    }

    /// The floor at `range`, through `part` of a pixel's width.
    pub(crate) fn floor(&self, ray: &Ray, range: f64, part: f64) -> (f32, u32) {
        let at = self.place(ray, range);
        let angle = self.view.pixel_angle * part;
        let slant = length(range, self.view.height);
        let (deep, wide) = (slant * slant / self.view.height * angle, slant * angle);
        let ahead = self.view.map_from_foot.turned(Point2::new(ray.x, ray.y));
        let du = ahead.x.abs() * deep + ahead.y.abs() * wide;
        let dv = ahead.y.abs() * deep + ahead.x.abs() * wide;
        let floor = &self.world.floor;
        let mut albedo = floor.brightness * texture::factor(&floor.texture, at.x, at.y, du, dv);
        for (placed, patch) in &self.patches {
            let p = placed.inward(at);
            let soft = patch.softness.max(du.max(dv));
            let inside = |x: f64, size: f64| ((size / 2.0 - x.abs()) / soft + 0.5).clamp(0.0, 1.0);
            let cover = inside(p.x, patch.size[0]) * inside(p.y, patch.size[1]);
            albedo *= 1.0 + (patch.factor - 1.0) * cover;
        }
        ((albedo * self.world.light.on_floor(at)) as f32, FLOOR)
    }

    /// A side of a solid, through `part` of a pixel's width.
    pub(crate) fn solid(
        &self,
        ray: &Ray,
        range: f64,
        index: usize,
        side: u8,
        part: f64,
    ) -> (f32, u32) {
        let fixed = self.world.solids.len();
        let solid = if index < fixed {
            &self.world.solids[index]
        } else {
            &self.moving[index - fixed]
        };
        let at = self.place(ray, range);
        let id = FIRST_SOLID + 64 * index as u32 + 8 * u32::from(side);
        let angle = self.view.pixel_angle * part;
        if side == TOP || side == BOTTOM {
            return self.cap(solid, at, length(range, self.view.height) * angle, side, id);
        }
        let (normal, along) = upright(&solid.footprint, side, at);
        let z = self.view.height - ray.slope * range;
        let ahead = self.view.map_from_foot.turned(Point2::new(ray.x, ray.y));
        let facing = (ahead.x * normal.x + ahead.y * normal.y).abs().max(0.02);
        let across = (1.0 + ray.slope * ray.slope).sqrt();
        let (du, dv) = (
            range * across / facing * angle,
            range * across * across * angle,
        );
        let finish = &solid.finish;
        let along = if side >= 2 {
            along + finish.along
        } else {
            along
        };
        let band = finish.bands.iter().rposition(|b| {
            b.sides >> side & 1 == 1
                && (b.along[0]..b.along[1]).contains(&along)
                && (b.up[0]..b.up[1]).contains(&z)
        });
        let brightness = match band {
            Some(band) => finish.bands[band].brightness,
            None => finish.brightness * texture::factor(&finish.texture, along, z, du, dv),
        };
        // less light reaches the foot of a wall
        let foot = 1.0 - 0.03 / (0.15 + z);
        let light = self.world.light.on_wall(at, normal) * foot;
        let band = band.map_or(0, |b| b as u32 % 7 + 1);
        ((brightness * light) as f32, id + band)
    }

    /// Top or underside.
    fn cap(&self, solid: &Solid, at: Point2, width: f64, side: u8, id: u32) -> (f32, u32) {
        let local = match solid.footprint {
            Footprint::Block { placed, .. } => placed.inward(at),
            Footprint::Disc { center, .. } => Point2::new(at.x - center.x, at.y - center.y),
        };
        let finish = &solid.finish;
        let pattern = texture::factor(&finish.texture, local.x, local.y, width, width);
        let light = if side == TOP {
            1.1 * self.world.light.on_floor(at)
        } else {
            0.5
        };
        ((finish.brightness * pattern * light) as f32, id)
    }

    fn place(&self, ray: &Ray, range: f64) -> Point2 {
        self.view
            .map_from_foot
            .outward(Point2::new(ray.x * range, ray.y * range))
    }
}

/// Outward normal of a side, and the coordinate along it.
fn upright(footprint: &Footprint, side: u8, at: Point2) -> (Point2, f64) {
    match footprint {
        Footprint::Block { placed, .. } => {
            let local = placed.inward(at);
            let (normal, along) = match side {
                0 => (Point2::new(1.0, 0.0), local.y),
                1 => (Point2::new(-1.0, 0.0), local.y),
                2 => (Point2::new(0.0, 1.0), local.x),
                _ => (Point2::new(0.0, -1.0), local.x),
            };
            (placed.turned(normal), along)
        }
        Footprint::Disc { center, radius } => {
            let (x, y) = ((at.x - center.x) / radius, (at.y - center.y) / radius);
            let quarter = y / (x.abs() + y.abs()).max(1e-9);
            let around = if x >= 0.0 { quarter } else { 2.0 - quarter };
            (
                Point2::new(x, y),
                around * std::f64::consts::FRAC_PI_2 * radius,
            )
        }
    }
}
