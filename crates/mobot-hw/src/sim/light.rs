//! How much light falls on a surface.

use occgrid::Point2;

use super::building::Lamp;

/// Light from everywhere and from lamps, as vector fields on a grid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Light {
    ambient: f64,
    grid: Option<Grid>,
}

/// Spacing of the grid [m], unless the lamps are spread so wide that it would have too many nodes.
const SPACING: f64 = 0.25;
/// Nodes a side at most.
const MAX_NODES: f64 = 1024.0;
/// Past this distance [m] a lamp adds nothing.
const REACH: f64 = 8.0;
/// Walls are lit as at this height [m].
const WALL_HEIGHT: f64 = 0.8;

#[derive(Debug, Clone, PartialEq)]
struct Grid {
    corner: Point2,
    per_metre: f64,
    width: usize,
    height: usize,
    /// Light on the floor, and light along +x, -x, +y, -y on walls.
    nodes: Vec<[f32; 5]>,
}

impl Light {
    pub(crate) fn new(ambient: f64, lamps: &[Lamp]) -> Self {
        let grid = (!lamps.is_empty()).then(|| Grid::new(lamps));
        Self { ambient, grid }
    }

    pub(crate) fn on_floor(&self, at: Point2) -> f64 {
        self.ambient + self.grid.as_ref().map_or(0.0, |g| g.floor(at))
    }

    /// On an upright surface with this outward normal.
    pub(crate) fn on_wall(&self, at: Point2, normal: Point2) -> f64 {
        self.ambient + self.grid.as_ref().map_or(0.0, |g| g.wall(at, normal))
    }
}

impl Grid {
    fn new(lamps: &[Lamp]) -> Self {
        let low = |axis: usize| {
            lamps
                .iter()
                .map(|l| l.at[axis])
                .fold(f64::INFINITY, f64::min)
        };
        let high = |axis: usize| {
            lamps
                .iter()
                .map(|l| l.at[axis])
                .fold(f64::NEG_INFINITY, f64::max)
        };
        let corner = Point2::new(low(0) - REACH, low(1) - REACH);
        let (w, h) = (high(0) + REACH - corner.x, high(1) + REACH - corner.y);
        let spacing = SPACING.max(w.max(h) / MAX_NODES);
        let (width, height) = ((w / spacing) as usize + 2, (h / spacing) as usize + 2);
        let mut nodes = vec![[0.0_f32; 5]; width * height];
        let cells = (REACH / spacing) as i64 + 1;
        for lamp in lamps {
            let (cx, cy) = (
                (lamp.at[0] - corner.x) / spacing,
                (lamp.at[1] - corner.y) / spacing,
            );
            for row in (cy as i64 - cells).max(0)..=(cy as i64 + cells).min(height as i64 - 1) {
                for col in (cx as i64 - cells).max(0)..=(cx as i64 + cells).min(width as i64 - 1) {
                    let dx = lamp.at[0] - (corner.x + col as f64 * spacing);
                    let dy = lamp.at[1] - (corner.y + row as f64 * spacing);
                    let node = &mut nodes[row as usize * width + col as usize];
                    add(node, lamp, dx, dy);
                }
            }
        }
        Self {
            corner,
            per_metre: 1.0 / spacing,
            width,
            height,
            nodes,
        }
    }

    /// Some channels of the nodes, between the four nodes around a place; 0 off the grid.
    fn at<const N: usize>(&self, p: Point2, channels: [usize; N]) -> [f64; N] {
        let (x, y) = (
            (p.x - self.corner.x) * self.per_metre,
            (p.y - self.corner.y) * self.per_metre,
        );
        let (col, row) = (x as usize, y as usize);
        if !(x >= 0.0 && y >= 0.0) || col + 1 >= self.width || row + 1 >= self.height {
            return [0.0; N];
        }
        let (fx, fy) = (x - col as f64, y - row as f64);
        let i = row * self.width + col;
        let quad = [i, i + 1, i + self.width, i + self.width + 1].map(|i| &self.nodes[i]);
        channels.map(|k| {
            let [a, b, c, d] = quad.map(|node| f64::from(node[k]));
            (a + (b - a) * fx) * (1.0 - fy) + (c + (d - c) * fx) * fy
        })
    }

    fn floor(&self, p: Point2) -> f64 {
        let [floor] = self.at(p, [0]);
        floor
    }

    fn wall(&self, p: Point2, normal: Point2) -> f64 {
        let facing = |toward: f64, plus: usize| if toward > 0.0 { plus } else { plus + 1 };
        let [x, y] = self.at(p, [facing(normal.x, 1), facing(normal.y, 3)]);
        normal.x * normal.x * x + normal.y * normal.y * y
    }
}

/// Adds a lamp at an offset to a node; fades to nothing at [`REACH`].
fn add(node: &mut [f32; 5], lamp: &Lamp, dx: f64, dy: f64) {
    let across = dx * dx + dy * dy;
    let fade = (1.0 - across / (REACH * REACH)).max(0.0);
    let on = |up: f64| {
        let d2 = across + up * up;
        lamp.power * fade / (d2 * d2.sqrt())
    };
    node[0] += (on(lamp.height) * lamp.height) as f32;
    let wall = on(lamp.height - WALL_HEIGHT);
    for (slot, toward) in node[1..].iter_mut().zip([dx, -dx, dy, -dy]) {
        *slot += (wall * toward.max(0.0)) as f32;
    }
}
