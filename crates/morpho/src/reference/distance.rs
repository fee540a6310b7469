//! Distances by their definition: the minimum over all background pixels.

use crate::{BitImage, Border};

/// The twin of [`crate::distance::squared`]: quadratic in the number of pixels.
#[must_use]
pub fn squared(image: &BitImage, border: Border) -> Vec<u32> {
    nearest(image, border, |dx, dy| dx * dx + dy * dy)
}

/// The twin of [`crate::distance::squared_to_squares`]: quadratic in the number of pixels.
#[must_use]
pub fn squared_to_squares(image: &BitImage, border: Border) -> Vec<u32> {
    let edge = |d: u64| (2 * d).saturating_sub(1).pow(2);
    nearest(image, border, |dx, dy| edge(dx) + edge(dy))
}

fn nearest(image: &BitImage, border: Border, metric: impl Fn(u64, u64) -> u64) -> Vec<u32> {
    let (width, height) = (image.width(), image.height());
    let mut background = Vec::new();
    // One pixel round the image is enough of the outside: whatever lies farther out is farther away.
    for y in 0..height + 2 {
        for x in 0..width + 2 {
            let inside = (1..=width).contains(&x) && (1..=height).contains(&y);
            let is_background = if inside {
                !image.get(x - 1, y - 1)
            } else {
                border == Border::Background
            };
            if is_background {
                background.push((x, y));
            }
        }
    }
    let mut result = Vec::with_capacity(width * height);
    for y in 1..=height {
        for x in 1..=width {
            let best = background
                .iter()
                .map(|&(bx, by)| metric(bx.abs_diff(x) as u64, by.abs_diff(y) as u64))
                .min();
            result.push(best.map_or(u32::MAX, |d| u32::try_from(d).unwrap_or(u32::MAX)));
        }
    }
    result
}
