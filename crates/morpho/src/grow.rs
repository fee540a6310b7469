//! Cell growing: k x k pixels become one cell.

use crate::BitImage;

/// When a grown cell is foreground. Pixels of a partial block that lie outside the image count as
/// background, under every rule: a base that needs the whole cell must not stand half off the map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum GrowRule {
    /// All k x k pixels are foreground.
    #[default]
    All,
    /// More than half of the k x k pixels are.
    Majority,
    /// At least one is.
    Any,
}

/// The image of `width / k` x `height / k` cells, rounded up, whose cell (x, y) stands for the
/// pixels `k x .. k x + k`, `k y .. k y + k`.
///
/// # Panics
/// If `k` is 0.
#[must_use]
pub fn grow(image: &BitImage, k: usize, rule: GrowRule) -> BitImage {
    assert!(k > 0, "cells of 0 x 0 pixels");
    BitImage::from_fn(
        image.width().div_ceil(k),
        image.height().div_ceil(k),
        |x, y| {
            let free = (0..k * k)
                .filter(|i| image.get(x * k + i % k, y * k + i / k))
                .count();
            match rule {
                GrowRule::All => free == k * k,
                GrowRule::Majority => 2 * free > k * k,
                GrowRule::Any => free > 0,
            }
        },
    )
}
