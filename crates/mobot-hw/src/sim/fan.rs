//! What a camera at one place can see in which direction: solids sorted into a fan of sectors around it,
//! nearest first. Every ray of a picture starts at the same place, so a ray looks into one sector only.

use occgrid::Point2;

use super::solid::{BOTTOM, Footprint, Solid, TOP};
use crate::real::{Placed, length};

/// Sectors of a full turn.
const SECTORS: usize = 2048;
/// Widens every solid's span against rounding.
const MARGIN: f64 = 1e-9;
/// Ends of blocks lie this much deeper than they are [m]: where the end of a wall is flush with the side
/// of another, the side shows.
const ENDS_BEHIND: f64 = 1e-6;

/// A ray from the camera: its direction on the floor (unit length), and how far it sinks a metre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ray {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) slope: f64,
}

impl Ray {
    pub(crate) fn along([x, y, z]: [f64; 3]) -> Self {
        let across = length(x, y);
        let steepest = across.max(1e-12 * z.abs()).max(1e-300);
        if across > 1e-12 * z.abs() {
            Self {
                x: x / across,
                y: y / across,
                slope: -z / across,
            }
        } else {
            Self {
                x: 1.0,
                y: 0.0,
                slope: -z / steepest,
            }
        }
    }
}

/// What a ray met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Way over the floor [m].
    pub(crate) range: f64,
    pub(crate) solid: usize,
    pub(crate) side: u8,
}

/// A solid as seen from the camera.
#[derive(Debug, Clone, Copy)]
struct Seen {
    solid: u32,
    /// Nothing of it is nearer than this.
    nearest: f64,
    bottom: f64,
    top: f64,
    shape: Shape,
}

#[derive(Debug, Clone, Copy)]
enum Shape {
    /// The camera in the block's axes, and the block's first axis in the camera's frame.
    Block {
        from: Point2,
        cos: f64,
        sin: f64,
        half: [f64; 2],
    },
    Disc {
        center: Point2,
        radius: f64,
    },
}

/// The sectors around one place.
#[derive(Debug, Default)]
pub(crate) struct Fan {
    height: f64,
    seen: Vec<Seen>,
    /// First entry of every sector, and one past the last.
    begins: Vec<u32>,
    entries: Vec<u32>,
    spans: Vec<[u32; 2]>,
}

impl Fan {
    /// Sorts solids around the frame `map_from_foot`, for a camera at `height` above it. Solids wholly
    /// farther than `far` are left out.
    pub(crate) fn sort<'a>(
        &mut self,
        solids: impl Iterator<Item = &'a Solid>,
        map_from_foot: &Placed,
        height: f64,
        far: f64,
    ) {
        self.height = height;
        self.seen.clear();
        let foot_from_map = map_from_foot.inverse();
        for (index, solid) in solids.enumerate() {
            let seen = Seen::new(index, solid, &foot_from_map);
            if seen.nearest < far {
                self.seen.push(seen);
            }
        }
        self.seen
            .sort_by(|a, b| a.nearest.total_cmp(&b.nearest).then(a.solid.cmp(&b.solid)));
        self.deal();
    }

    /// Deals the solids, which are sorted by distance, into the sectors they span.
    fn deal(&mut self) {
        self.spans.clear();
        self.spans.extend(self.seen.iter().map(Seen::sectors));
        self.begins.clear();
        self.begins.resize(SECTORS + 1, 0);
        for &[first, last] in &self.spans {
            for sector in first..=last {
                self.begins[sector as usize % SECTORS + 1] += 1;
            }
        }
        for sector in 0..SECTORS {
            self.begins[sector + 1] += self.begins[sector];
        }
        self.entries.clear();
        self.entries.resize(self.begins[SECTORS] as usize, 0);
        let mut next = [0_u32; SECTORS];
        next.copy_from_slice(&self.begins[..SECTORS]);
        for (index, &[first, last]) in self.spans.iter().enumerate() {
            for sector in first..=last {
                let slot = &mut next[sector as usize % SECTORS];
                self.entries[*slot as usize] = index as u32;
                *slot += 1;
            }
        }
    }

    /// The first solid that a ray meets before `far`.
    pub(crate) fn cast(&self, ray: &Ray, far: f64) -> Option<Hit> {
        let sector = (turn(ray.x, ray.y) * (SECTORS as f64 / 4.0)) as usize % SECTORS;
        let list = self.begins[sector] as usize..self.begins[sector + 1] as usize;
        let (mut best, mut hit) = (far, None);
        for &index in &self.entries[list] {
            let seen = &self.seen[index as usize];
            if seen.nearest >= best {
                break;
            }
            if let Some((range, side)) = seen.meet(ray, self.height)
                && range < best
            {
                best = range;
                hit = Some(Hit {
                    range,
                    solid: seen.solid as usize,
                    side,
                });
            }
        }
        hit
    }
}

impl Seen {
    fn new(index: usize, solid: &Solid, foot_from_map: &Placed) -> Self {
        let (shape, nearest) = match solid.footprint {
            Footprint::Block { placed, half } => {
                let block = foot_from_map.compose(&placed);
                let from = block.inward(Point2::new(0.0, 0.0));
                let dx = (from.x.abs() - half[0]).max(0.0);
                let dy = (from.y.abs() - half[1]).max(0.0);
                let shape = Shape::Block {
                    from,
                    cos: block.cos,
                    sin: block.sin,
                    half,
                };
                (shape, length(dx, dy))
            }
            Footprint::Disc { center, radius } => {
                let center = foot_from_map.outward(center);
                let nearest = (length(center.x, center.y) - radius).max(0.0);
                (Shape::Disc { center, radius }, nearest)
            }
        };
        Self {
            solid: index as u32,
            nearest,
            bottom: solid.bottom,
            top: solid.top,
            shape,
        }
    }

    /// First and last sector it may be seen in; the last may be past a full turn.
    fn sectors(&self) -> [u32; 2] {
        let all = [0, SECTORS as u32 - 1];
        const SIGNS: [[f64; 2]; 4] = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        let corners = match self.shape {
            Shape::Block {
                from,
                cos,
                sin,
                half,
            } => {
                if from.x.abs() <= half[0] + MARGIN && from.y.abs() <= half[1] + MARGIN {
                    return all;
                }
                SIGNS.map(|[sx, sy]| {
                    let (x, y) = (sx * half[0] - from.x, sy * half[1] - from.y);
                    (cos * x - sin * y, sin * x + cos * y)
                })
            }
            Shape::Disc { center, radius } => {
                if center.x.abs().max(center.y.abs()) <= radius + MARGIN {
                    return all;
                }
                SIGNS.map(|[sx, sy]| (center.x + sx * radius, center.y + sy * radius))
            }
        };
        let turns = corners.map(|(x, y)| turn(x, y));
        let low = turns.into_iter().fold(f64::INFINITY, f64::min);
        let high = turns.into_iter().fold(f64::NEG_INFINITY, f64::max);
        // a convex thing beside the camera spans less than half a turn, which is 2
        let (low, high) = if high - low <= 2.0 {
            (low, high)
        } else {
            let split = |t: f64| if t < 2.0 { t + 4.0 } else { t };
            let turns = turns.map(split);
            (
                turns.into_iter().fold(f64::INFINITY, f64::min),
                turns.into_iter().fold(f64::NEG_INFINITY, f64::max),
            )
        };
        let sector = |t: f64| (t.max(0.0) * (SECTORS as f64 / 4.0)) as u32;
        [sector(low - MARGIN), sector(high + MARGIN)]
    }

    /// Range and side at which a ray enters it.
    fn meet(&self, ray: &Ray, height: f64) -> Option<(f64, u8)> {
        let (enter, leave, side) = match self.shape {
            Shape::Block {
                from,
                cos,
                sin,
                half,
            } => through_block(ray, from, cos, sin, half)?,
            Shape::Disc { center, radius } => through_disc(ray, center, radius)?,
        };
        let z = height - ray.slope * enter;
        if enter >= 0.0 && z <= self.top && z >= self.bottom {
            let behind = if side < 2 { ENDS_BEHIND } else { 0.0 };
            return Some((enter + behind, side));
        }
        // over its edge onto its top, or under its edge up to its underside
        let cap = if ray.slope > 0.0 && z.min(height) > self.top {
            (TOP, self.top)
        } else if ray.slope < 0.0 && z.max(height) < self.bottom {
            (BOTTOM, self.bottom)
        } else {
            return None;
        };
        let range = (height - cap.1) / ray.slope;
        (range >= enter.max(0.0) && range <= leave).then_some((range, cap.0))
    }
}

fn through_block(
    ray: &Ray,
    from: Point2,
    cos: f64,
    sin: f64,
    half: [f64; 2],
) -> Option<(f64, f64, u8)> {
    let (dx, dy) = (cos * ray.x + sin * ray.y, cos * ray.y - sin * ray.x);
    let (ix, iy) = (1.0 / dx, 1.0 / dy);
    let (reach_x, reach_y) = ((half[0] * ix).abs(), (half[1] * iy).abs());
    let (mid_x, mid_y) = (-from.x * ix, -from.y * iy);
    let (x0, x1, y0, y1) = (
        mid_x - reach_x,
        mid_x + reach_x,
        mid_y - reach_y,
        mid_y + reach_y,
    );
    // a ray along a thin wall's line divides 0 by 0 and meets nothing
    let (enter, side) = if x0 > y0 {
        (x0, u8::from(dx > 0.0))
    } else {
        (y0, 2 + u8::from(dy > 0.0))
    };
    let leave = x1.min(y1);
    (enter <= leave && leave >= 0.0).then_some((enter, leave, side))
}

fn through_disc(ray: &Ray, center: Point2, radius: f64) -> Option<(f64, f64, u8)> {
    let middle = center.x * ray.x + center.y * ray.y;
    let off = center.x * ray.y - center.y * ray.x;
    let half = (radius * radius - off * off).sqrt();
    // NaN where the ray passes by
    (middle + half >= 0.0).then_some((middle - half, middle + half, 0))
}

/// Direction as 0..4, growing counter-clockwise from straight behind; straight ahead is 2.
fn turn(x: f64, y: f64) -> f64 {
    let (x, y) = (-x, -y);
    let part = y / (x.abs() + y.abs());
    match (x >= 0.0, y >= 0.0) {
        (true, true) => part,
        (false, _) => 2.0 - part,
        (true, false) => 4.0 + part,
    }
}
