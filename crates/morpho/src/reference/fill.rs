//! Plain twins of filling, labelling, counting holes and cell growing.

use crate::{BitImage, Connectivity, GrowRule, Pixel};

/// Twin of [`seed_fill`](crate::seed_fill()).
#[must_use]
pub fn seed_fill(image: &BitImage, seed: Pixel, connectivity: Connectivity) -> BitImage {
    let mut filled = BitImage::new(image.width(), image.height());
    let mut stack = vec![seed];
    while let Some(Pixel { x, y }) = stack.pop() {
        if !image.get(x, y) || filled.get(x, y) {
            continue;
        }
        filled.set(x, y, true);
        for ny in y.saturating_sub(1)..=y + 1 {
            for nx in x.saturating_sub(1)..=x + 1 {
                if connectivity == Connectivity::Eight || nx == x || ny == y {
                    stack.push(Pixel::new(nx, ny));
                }
            }
        }
    }
    filled
}

/// Twin of [`reconstruct`](crate::reconstruct()).
#[must_use]
pub fn reconstruct(marker: &BitImage, mask: &BitImage, connectivity: Connectivity) -> BitImage {
    let mut filled = BitImage::new(mask.width(), mask.height());
    for y in 0..mask.height() {
        for x in 0..mask.width() {
            if marker.get(x, y) && !filled.get(x, y) {
                filled.unite(&seed_fill(mask, Pixel::new(x, y), connectivity));
            }
        }
    }
    filled
}

/// Twin of [`Components::to_labels`](crate::Components::to_labels).
#[must_use]
pub fn labels(image: &BitImage, connectivity: Connectivity) -> Vec<u32> {
    let mut labels = vec![0; image.width() * image.height()];
    let mut count = 0;
    for y in 0..image.height() {
        for x in 0..image.width() {
            if !image.get(x, y) || labels[y * image.width() + x] != 0 {
                continue;
            }
            count += 1;
            let component = seed_fill(image, Pixel::new(x, y), connectivity);
            for (i, label) in labels.iter_mut().enumerate() {
                if component.get(i % image.width(), i / image.width()) {
                    *label = count;
                }
            }
        }
    }
    labels
}

/// Twin of [`holes`](crate::holes()): the background components of the image in a frame, without
/// the one that the frame belongs to.
#[must_use]
pub fn holes(image: &BitImage, connectivity: Connectivity) -> usize {
    let framed = BitImage::from_fn(image.width() + 2, image.height() + 2, |x, y| {
        x == 0 || y == 0 || !image.get(x - 1, y - 1)
    });
    let labels = labels(&framed, connectivity.dual());
    labels.iter().max().map_or(0, |&last| last as usize - 1)
}

/// Twin of [`grow`](crate::grow()): every pixel is counted into its cell.
#[must_use]
pub fn grow(image: &BitImage, k: usize, rule: GrowRule) -> BitImage {
    let (columns, rows) = (image.width().div_ceil(k), image.height().div_ceil(k));
    let mut free = vec![0; columns * rows];
    for y in 0..image.height() {
        for x in 0..image.width() {
            free[y / k * columns + x / k] += usize::from(image.get(x, y));
        }
    }
    BitImage::from_fn(columns, rows, |x, y| {
        let share = free[y * columns + x] as f64 / (k * k) as f64;
        match rule {
            GrowRule::All => share >= 1.0,
            GrowRule::Majority => share > 0.5,
            GrowRule::Any => share > 0.0,
        }
    })
}
