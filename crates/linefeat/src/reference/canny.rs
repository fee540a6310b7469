//! Canny's detector by definition, as `cv2.Canny` with aperture 3 rounds and compares.

use image::{GrayImage, Luma};

use crate::{CannyParams, Norm, reference::gradient::sobel};

/// 0 and 255 as `cv2.Canny` gives them.
#[must_use]
pub fn canny(image: &GrayImage, params: &CannyParams) -> GrayImage {
    let (low, high) = params.limits();
    let (width, height) = image.dimensions();
    let mut out = GrayImage::new(width, height);
    let mut stack = Vec::new();
    for v in 0..height {
        for u in 0..width {
            if is_ridge(image, params.norm, u, v) && magnitude(image, params.norm, u, v) > high {
                out.put_pixel(u, v, Luma([255]));
                stack.push((u, v));
            }
        }
    }
    while let Some((u, v)) = stack.pop() {
        for v in v.saturating_sub(1)..=(v + 1).min(height - 1) {
            for u in u.saturating_sub(1)..=(u + 1).min(width - 1) {
                if out.get_pixel(u, v).0[0] == 0
                    && magnitude(image, params.norm, u, v) > low
                    && is_ridge(image, params.norm, u, v)
                {
                    out.put_pixel(u, v, Luma([255]));
                    stack.push((u, v));
                }
            }
        }
    }
    out
}

/// Gradient magnitude (L1) or its square (L2).
fn magnitude(image: &GrayImage, norm: Norm, u: u32, v: u32) -> i32 {
    let (gx, gy) = sobel(image, u, v);
    let (gx, gy) = (i32::from(gx), i32::from(gy));
    match norm {
        Norm::L1 => gx.abs() + gy.abs(),
        Norm::L2 => gx * gx + gy * gy,
    }
}

/// Whether the magnitude is greatest along the gradient's direction, rounded to four directions.
fn is_ridge(image: &GrayImage, norm: Norm, u: u32, v: u32) -> bool {
    // tan 22.5 degrees in units of 2^-15
    const TAN: i32 = 13573;
    let at = |du: i64, dv: i64| {
        let (u, v) = (i64::from(u) + du, i64::from(v) + dv);
        let inside = (0..i64::from(image.width())).contains(&u)
            && (0..i64::from(image.height())).contains(&v);
        if inside {
            magnitude(image, norm, u as u32, v as u32)
        } else {
            0
        }
    };
    let (gx, gy) = sobel(image, u, v);
    let here = at(0, 0);
    let (x, y) = (i32::from(gx).abs(), i32::from(gy).abs() << 15);
    if y < x * TAN {
        here > at(-1, 0) && here >= at(1, 0)
    } else if y > x * TAN + (x << 16) {
        here > at(0, -1) && here >= at(0, 1)
    } else {
        let s = if (gx ^ gy) < 0 { -1 } else { 1 };
        here > at(-s, -1) && here > at(s, 1)
    }
}
