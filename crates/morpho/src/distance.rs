//! The exact Euclidean distance transform: from each foreground pixel to the nearest background.
//!
//! Two passes (Meijster, Roerdink and Hesselink, A general algorithm for computing distance
//! transforms in linear time, 2000): first the distance to the nearest background pixel of the same
//! column, then along each row the best column.
//!
//! [`Border::Background`] makes everything outside the image background; [`Border::Neutral`] and
//! [`Border::Foreground`] are one rule here: only background inside the image counts, as in OpenCV.

use crate::{BitImage, Border};

/// The squared distance [cells^2], centre to centre, from each pixel to the nearest background pixel;
/// row after row. It is 0 on background and `u32::MAX` where there is no background at all (or none
/// nearer than 2^16 cells).
#[must_use]
pub fn squared(image: &BitImage, border: Border) -> Vec<u32> {
    transform(image, border, |n| n * n)
}

/// The squared doubled distance [(cells / 2)^2] from each pixel's centre to the nearest point of any
/// background pixel's unit square: the minimum over background pixels at offset (dx, dy) of
/// `max(2|dx| - 1, 0)^2 + max(2|dy| - 1, 0)^2`; row after row.
///
/// A foreground pixel beside background has 1 (half a cell); a clearance of `r` cells is a value of at
/// least `4 r^2`. It is 0 on background and `u32::MAX` where there is no background at all (or none
/// nearer than 2^15 cells).
#[must_use]
pub fn squared_to_squares(image: &BitImage, border: Border) -> Vec<u32> {
    transform(image, border, |n| {
        let edge = (2 * n).saturating_sub(1);
        edge * edge
    })
}

/// The pixels whose [`squared_to_squares`] is at least `min_squared_doubled`, among the foreground.
///
/// For a clearance of `r` cells ask for `ceil(4 r^2)`. 0 and 1 give the foreground itself.
#[must_use]
pub fn at_least(image: &BitImage, min_squared_doubled: u32, border: Border) -> BitImage {
    let distance = squared_to_squares(image, border);
    let width = image.width();
    BitImage::from_fn(width, image.height(), |x, y| {
        image.get(x, y) && distance[y * width + x] >= min_squared_doubled
    })
}

fn transform(image: &BitImage, border: Border, square: impl Fn(u64) -> u64) -> Vec<u32> {
    const FAR: u64 = 1 << 40;
    let (width, height) = (image.width(), image.height());
    let outside = match border {
        Border::Background => 0,
        Border::Neutral | Border::Foreground => FAR,
    };
    let mut column = vec![0_u64; width * height];
    for x in 0..width {
        let mut run = outside;
        for y in 0..height {
            run = if image.get(x, y) { run + 1 } else { 0 };
            column[y * width + x] = run;
        }
        let mut run = outside;
        for y in (0..height).rev() {
            run = if image.get(x, y) { run + 1 } else { 0 };
            let cell = &mut column[y * width + x];
            *cell = (*cell).min(run);
        }
    }
    let vertical: Vec<u64> = column
        .iter()
        .map(|&n| if n >= FAR { FAR } else { square(n) })
        .collect();
    let mut result = vec![0; width * height];
    for y in 0..height {
        let row = &vertical[y * width..(y + 1) * width];
        for x in 0..width {
            let mut best = row[x];
            for k in 1.. {
                let across = square(k as u64);
                if across >= best || (k > x && x + k >= width && border != Border::Background) {
                    break;
                }
                let side = |inside: bool, at: usize| if inside { row[at] } else { outside };
                let left = side(k <= x, x.wrapping_sub(k));
                let right = side(x + k < width, x + k);
                best = best.min(across + left.min(right));
            }
            result[y * width + x] = u32::try_from(best).unwrap_or(u32::MAX);
        }
    }
    result
}
