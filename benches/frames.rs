//! Camera frames of 640 x 480: real ones, and a corridor drawn here.

use std::path::Path;

use image::GrayImage;

/// Columns of every frame.
pub const WIDTH: u32 = 640;
/// Rows of every frame.
pub const HEIGHT: u32 = 480;

/// A gray frame and its name.
pub struct Frame {
    /// What it is.
    pub name: &'static str,
    /// Its pixels.
    pub image: GrayImage,
}

impl Frame {
    /// A robot's view of a hall with a tiled floor.
    #[must_use]
    pub fn robot() -> Self {
        Self::load("dbow2-1")
    }

    /// Three real frames, the robot's first, and the drawn corridor.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let real = ["dbow2-1", "york-urban", "opencv-left01"].map(Self::load);
        real.into_iter().chain([Self::corridor()]).collect()
    }

    /// A corridor with doors and floor tiles, its light falling off, with some noise.
    #[must_use]
    pub fn corridor() -> Self {
        let mut state = 0x9E37_79B9_7F4A_7C15_u64;
        let image = GrayImage::from_fn(WIDTH, HEIGHT, |u, v| {
            let at = |k: u32| {
                let (du, dv) = (f64::from(k % 3) / 3.0, f64::from(k / 3) / 3.0);
                corridor_gray(f64::from(u) + du, f64::from(v) + dv)
            };
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            let noise = (state.count_ones() as f64 - 32.0) * 0.5;
            image::Luma([((0..9).map(at).sum::<f64>() / 9.0 + noise) as u8])
        });
        Self {
            name: "corridor",
            image,
        }
    }

    fn load(name: &'static str) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata/frames");
        let image = image::open(folder.join(format!("{name}.png"))).expect("a frame");
        Self {
            name,
            image: image.into_luma8(),
        }
    }
}

/// What a camera 1 m above the floor, 0.3 m left of the middle, 10 degrees down, sees at (u, v).
fn corridor_gray(u: f64, v: f64) -> f64 {
    const FOCAL_PX: f64 = 520.0;
    const END: f64 = 14.0;
    let (x, y) = ((u - 320.0) / FOCAL_PX, (v - 240.0) / FOCAL_PX);
    let (sin, cos) = 10_f64.to_radians().sin_cos();
    let (ahead, down) = (cos - y * sin, sin + y * cos);
    // ways to the floor or ceiling, to a wall, to the end
    let to_flat = if down > 0.0 { 1.0 / down } else { -1.5 / down };
    let to_wall = if x > 0.0 { 1.5 / x } else { -0.9 / x };
    let way = to_flat.min(to_wall).min(END / ahead);
    let (along, side, below) = (way * ahead, way * x, way * down);
    let odd = |value: f64, period: f64| (value / period).floor() as i64 & 1 == 1;
    let gray = if to_flat.min(to_wall) > way {
        if side.abs() < 0.45 && below > -1.1 {
            70.0
        } else {
            190.0
        }
    } else if to_wall < to_flat {
        let door = (along + 0.4).rem_euclid(3.0);
        match door {
            0.0..0.9 if below > -1.05 => 90.0,
            _ if below > 0.9 => 60.0,
            _ => 200.0,
        }
    } else if down > 0.0 {
        if odd(along, 0.6) == odd(side, 0.6) {
            150.0
        } else {
            135.0
        }
    } else if along.rem_euclid(3.0) < 1.2 && side.abs() < 0.3 {
        250.0
    } else {
        220.0
    };
    gray * (0.4 + 0.6 / (1.0 + 0.02 * along * along))
}
