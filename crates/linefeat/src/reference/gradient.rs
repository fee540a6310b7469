//! Sobel's masks, written out.

use image::GrayImage;

/// Sobel 3 x 3 responses (gx, gy) at pixel (u, v); the border pixels repeat outside the picture.
///
/// # Panics
/// If the picture is empty.
#[must_use]
pub fn sobel(image: &GrayImage, u: u32, v: u32) -> (i16, i16) {
    let (width, height) = (i64::from(image.width()), i64::from(image.height()));
    let at = |du: i64, dv: i64| {
        let u = (i64::from(u) + du).clamp(0, width - 1);
        let v = (i64::from(v) + dv).clamp(0, height - 1);
        i16::from(image.get_pixel(u as u32, v as u32).0[0])
    };
    let gx = (at(1, -1) + 2 * at(1, 0) + at(1, 1)) - (at(-1, -1) + 2 * at(-1, 0) + at(-1, 1));
    let gy = (at(-1, 1) + 2 * at(0, 1) + at(1, 1)) - (at(-1, -1) + 2 * at(0, -1) + at(1, -1));
    (gx, gy)
}
