//! Scenes as PNG.

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use occgrid::GridPoint;

use super::scene::{Color, Scene};

/// Small maps are enlarged until their longer side has about this many pixels.
const LONG_SIDE_PX: u32 = 1400;

/// The scene as PNG bytes, cells enlarged by a whole factor.
pub(super) fn render(scene: &Scene) -> anyhow::Result<Vec<u8>> {
    let [left, top, width, height] = scene.view;
    let zoom = (LONG_SIDE_PX / width.max(height)).clamp(1, 16);
    let mut canvas = Canvas::enlarged(scene, zoom);
    let place = |p: GridPoint| {
        let z = f64::from(zoom);
        ((p.col - f64::from(left)) * z, (p.row - f64::from(top)) * z)
    };
    for stroke in &scene.strokes {
        for pair in stroke.points.windows(2) {
            canvas.line(
                place(pair[0]),
                place(pair[1]),
                stroke.width_px / 2.0,
                stroke.color,
            );
        }
    }
    for mark in &scene.marks {
        let at = place(mark.at);
        canvas.line(at, at, mark.radius_px, mark.color);
    }
    encode(
        width * zoom,
        height * zoom,
        &canvas.rgb,
        ExtendedColorType::Rgb8,
    )
}

/// Pixels as PNG bytes.
pub(super) fn encode(
    width: u32,
    height: u32,
    pixels: &[u8],
    color: ExtendedColorType,
) -> anyhow::Result<Vec<u8>> {
    let mut png = Vec::new();
    PngEncoder::new(&mut png).write_image(pixels, width, height, color)?;
    Ok(png)
}

struct Canvas {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Canvas {
    fn enlarged(scene: &Scene, zoom: u32) -> Self {
        let [_, _, width, height] = scene.view.map(|v| v as usize);
        let zoom = zoom as usize;
        let mut rgb = Vec::with_capacity(width * height * zoom * zoom * 3);
        for row in scene.gray.chunks_exact(width) {
            let line: Vec<u8> = row
                .iter()
                .flat_map(|&g| std::iter::repeat_n(g, 3 * zoom))
                .collect();
            for _ in 0..zoom {
                rgb.extend_from_slice(&line);
            }
        }
        Self {
            width: width * zoom,
            height: height * zoom,
            rgb,
        }
    }

    /// Every pixel whose centre is within `radius` of the segment, and at least the nearest one.
    fn line(&mut self, a: (f64, f64), b: (f64, f64), radius: f64, color: Color) {
        let radius = radius.max(0.71);
        let clip = |v: f64, most: usize| v.clamp(0.0, most as f64) as usize;
        let columns =
            clip(a.0.min(b.0) - radius, self.width)..clip(a.0.max(b.0) + radius + 1.0, self.width);
        let rows = clip(a.1.min(b.1) - radius, self.height)
            ..clip(a.1.max(b.1) + radius + 1.0, self.height);
        for y in rows {
            for x in columns.clone() {
                let p = (x as f64 + 0.5, y as f64 + 0.5);
                if squared_distance(p, a, b) <= radius * radius {
                    let at = 3 * (y * self.width + x);
                    self.rgb[at..at + 3].copy_from_slice(&[color.0, color.1, color.2]);
                }
            }
        }
    }
}

fn squared_distance(p: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (px, py) = (p.0 - a.0, p.1 - a.1);
    let t = ((px * dx + py * dy) / (dx * dx + dy * dy).max(1e-12)).clamp(0.0, 1.0);
    (px - t * dx).powi(2) + (py - t * dy).powi(2)
}
