//! The exact Euclidean distance transform: from each foreground pixel to the nearest background.
//!
//! Two passes (Meijster, Roerdink and Hesselink, A general algorithm for computing distance
//! transforms in linear time, 2000): the distance to the nearest background pixel of the same
//! column, then along each row the best column. The second pass looks outward from all pixels of a
//! block together until nothing farther can win; rows with a reach too long for that go through
//! lower envelopes.
//!
//! [`Border::Background`] makes everything outside the image background; [`Border::Neutral`] and
//! [`Border::Foreground`] are one rule here: only background inside the image counts, as in OpenCV.

mod envelope;
mod sampled;
mod transform;

use crate::{BitImage, Border, Element, Pixel, erode};
pub use transform::Workspace;
use transform::{Centres, Squares};

/// The squared distance [cells^2], centre to centre, from each pixel to the nearest background pixel;
/// row after row. It is 0 on background and `u32::MAX` where there is no background (or none nearer
/// than 46 340 cells).
#[must_use]
pub fn squared(image: &BitImage, border: Border) -> Vec<u32> {
    let mut distances = Vec::new();
    squared_into(image, border, &mut Workspace::default(), &mut distances);
    distances
}

/// [`squared`] into memory that is used again.
pub fn squared_into(
    image: &BitImage,
    border: Border,
    workspace: &mut Workspace,
    distances: &mut Vec<u32>,
) {
    transform::transform::<Centres>(image, border, workspace, distances);
}

/// The squared doubled distance [(cells / 2)^2] from each pixel's centre to the nearest point of any
/// background pixel's unit square: the minimum over background pixels at offset (dx, dy) of
/// `max(2|dx| - 1, 0)^2 + max(2|dy| - 1, 0)^2`; row after row.
///
/// A foreground pixel beside background has 1 (half a cell); a clearance of `r` cells is a value of at
/// least `4 r^2`. It is 0 on background and `u32::MAX` where there is no background (or none nearer
/// than 23 170 cells).
#[must_use]
pub fn squared_to_squares(image: &BitImage, border: Border) -> Vec<u32> {
    let mut distances = Vec::new();
    squared_to_squares_into(image, border, &mut Workspace::default(), &mut distances);
    distances
}

/// [`squared_to_squares`] into memory that is used again.
pub fn squared_to_squares_into(
    image: &BitImage,
    border: Border,
    workspace: &mut Workspace,
    distances: &mut Vec<u32>,
) {
    transform::transform::<Squares>(image, border, workspace, distances);
}

/// [`squared_to_squares`] of the pixels of `wanted` only, in raster order.
///
/// Two walks over the image, which keep 2 bytes a pixel for 64 rows and for every 64th row, then for each
/// wanted pixel a look outward along its row, as far as its distance. Where few pixels are wanted, this
/// takes a small part of the memory of the whole transform, and of the time that a system takes to hand it out.
///
/// # Panics
/// If the images differ in size.
#[must_use]
pub fn sampled_to_squares(image: &BitImage, wanted: &BitImage, border: Border) -> Vec<u32> {
    assert_eq!(
        (image.width(), image.height()),
        (wanted.width(), wanted.height()),
        "images differ in size"
    );
    sampled::sample::<Squares>(image, wanted, border)
}

/// The foreground pixels whose [`squared_to_squares`] is at least `min_squared_doubled`.
///
/// For a clearance of `r` cells ask for `ceil(4 r^2)`. 0 and 1 give the foreground itself. Up to 64
/// cells of clearance this is one erosion, many times faster than the transform.
#[must_use]
pub fn at_least(image: &BitImage, min_squared_doubled: u32, border: Border) -> BitImage {
    const LARGEST_DISK: usize = 64;
    if min_squared_doubled <= 1 {
        return image.clone();
    }
    // Background in reach: offsets with (2|dx| - 1)+^2 + (2|dy| - 1)+^2 < min_squared_doubled.
    let reach = (min_squared_doubled - 1).isqrt().div_ceil(2) as usize;
    if reach > LARGEST_DISK {
        let distance = squared_to_squares(image, border);
        let far = distance.iter().map(|&d| u8::from(d >= min_squared_doubled));
        let far: Vec<u8> = far.collect();
        return crate::threshold(&far, image.width(), image.height(), 1);
    }
    let edge = |n: usize| (2 * n.abs_diff(reach)).saturating_sub(1).pow(2);
    let side = 2 * reach + 1;
    let near = BitImage::from_fn(side, side, |x, y| {
        edge(x) + edge(y) < min_squared_doubled as usize
    });
    let Ok(disk) = Element::from_mask(&near, Pixel::new(reach, reach)) else {
        return image.clone();
    };
    let outside = match border {
        Border::Background => Border::Background,
        Border::Neutral | Border::Foreground => Border::Neutral,
    };
    erode(image, &disk, outside)
}
