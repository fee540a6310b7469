//! Scenes as PNG.

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use occgrid::GridPoint;

use super::canvas::Canvas;
use super::scene::Scene;

/// Small maps are enlarged until their longer side has about this many pixels.
const LONG_SIDE_PX: u32 = 1400;

/// The scene as PNG bytes, cells enlarged by a whole factor.
pub(super) fn render(scene: &Scene) -> anyhow::Result<Vec<u8>> {
    let [left, top, width, height] = scene.view;
    let zoom = (LONG_SIDE_PX / width.max(height)).clamp(1, 16);
    let mut canvas = enlarged(scene, zoom);
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

/// The map, cells enlarged by a whole factor.
fn enlarged(scene: &Scene, zoom: u32) -> Canvas {
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
    Canvas {
        width: width * zoom,
        height: height * zoom,
        rgb,
    }
}
