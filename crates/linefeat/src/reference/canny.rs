//! Canny's detector by definition, as `cv2.Canny` with aperture 3 rounds and compares.

use image::{GrayImage, Luma};

use crate::{CannyParams, ModifiedCannyParams, Norm, Region, reference::gradient::sobel};

/// 0 and 255 as `cv2.Canny` gives them.
#[must_use]
pub fn canny(image: &GrayImage, params: &CannyParams) -> GrayImage {
    inside(image, params, &Region::Whole)
}

/// 0 and 255 of the modified form.
#[must_use]
pub fn canny_modified(image: &GrayImage, params: &ModifiedCannyParams) -> GrayImage {
    inside(image, &chosen(image, params), &params.region)
}

/// The thresholds of the modified form.
#[must_use]
pub fn chosen(image: &GrayImage, params: &ModifiedCannyParams) -> CannyParams {
    let mut magnitudes = Vec::new();
    for (u, v, _) in image.enumerate_pixels() {
        if v % 4 == 0 && (u + v / 4) % 4 == 0 && params.region.contains(u, v) {
            let (gx, gy) = sobel(image, u, v);
            magnitudes.push(gx.abs() + gy.abs());
        }
    }
    magnitudes.sort_unstable_by(|a, b| b.cmp(a));
    // one less than the last of those that must be above
    let exceeded_by = |share: f64| {
        let count = ((share * magnitudes.len() as f64).ceil() as usize).max(1);
        f64::from(magnitudes.get(count - 1).map_or(0, |m| (m - 1).max(0)))
    };
    let high = exceeded_by(params.strong_share)
        .max(params.noise_factor * exceeded_by(0.5))
        .max(params.min_high);
    CannyParams {
        low: params.low_ratio * high,
        high,
        norm: Norm::L1,
    }
}

fn inside(image: &GrayImage, params: &CannyParams, region: &Region) -> GrayImage {
    let (low, high) = params.limits();
    let (width, height) = image.dimensions();
    let magnitudes = Magnitudes::of(image, params.norm);
    let may_be = |u, v| {
        region.contains(u, v) && magnitudes.at(u, v, 0, 0) > low && magnitudes.is_ridge(u, v)
    };
    let mut out = GrayImage::new(width, height);
    let mut stack = Vec::new();
    for v in 0..height {
        for u in 0..width {
            if magnitudes.at(u, v, 0, 0) > high && may_be(u, v) {
                out.put_pixel(u, v, Luma([255]));
                stack.push((u, v));
            }
        }
    }
    while let Some((u, v)) = stack.pop() {
        for v in v.saturating_sub(1)..(v + 2).min(height) {
            for u in u.saturating_sub(1)..(u + 2).min(width) {
                if out.get_pixel(u, v).0 == [0] && may_be(u, v) {
                    out.put_pixel(u, v, Luma([255]));
                    stack.push((u, v));
                }
            }
        }
    }
    out
}

/// Every pixel's gradient and magnitude (L2: squared).
struct Magnitudes {
    width: u32,
    gradients: Vec<(i16, i16)>,
    values: Vec<i32>,
}

impl Magnitudes {
    fn of(image: &GrayImage, norm: Norm) -> Self {
        let pixels = image.enumerate_pixels();
        let gradients: Vec<_> = pixels.map(|(u, v, _)| sobel(image, u, v)).collect();
        let magnitude = |&(gx, gy): &(i16, i16)| {
            let (gx, gy) = (i32::from(gx), i32::from(gy));
            match norm {
                Norm::L1 => gx.abs() + gy.abs(),
                Norm::L2 => gx * gx + gy * gy,
            }
        };
        Self {
            width: image.width(),
            values: gradients.iter().map(magnitude).collect(),
            gradients,
        }
    }

    /// The magnitude at (u + du, v + dv), 0 outside the picture.
    fn at(&self, u: u32, v: u32, du: i32, dv: i32) -> i32 {
        match (u.checked_add_signed(du), v.checked_add_signed(dv)) {
            (Some(u), Some(v)) if u < self.width => {
                let at = v as usize * self.width as usize + u as usize;
                self.values.get(at).copied().unwrap_or(0)
            }
            _ => 0,
        }
    }

    /// Whether the magnitude is greatest along the gradient's direction, rounded to four directions.
    fn is_ridge(&self, u: u32, v: u32) -> bool {
        // tan 22.5 degrees in units of 2^-15
        const TAN: i32 = 13573;
        let (gx, gy) = self.gradients[v as usize * self.width as usize + u as usize];
        let here = self.at(u, v, 0, 0);
        let (x, y) = (i32::from(gx).abs(), i32::from(gy).abs() << 15);
        if y < x * TAN {
            here > self.at(u, v, -1, 0) && here >= self.at(u, v, 1, 0)
        } else if y > x * TAN + (x << 16) {
            here > self.at(u, v, 0, -1) && here >= self.at(u, v, 0, 1)
        } else {
            let s = if (gx ^ gy) < 0 { -1 } else { 1 };
            here > self.at(u, v, -s, -1) && here > self.at(u, v, s, 1)
        }
    }
}
