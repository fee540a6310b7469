//! Seed fill, reconstruction, hole filling.

use crate::{BitImage, Pixel};

/// Which pixels are neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Connectivity {
    /// Left, right, above, below.
    Four,
    /// Those and the four diagonal ones. OpenCV's default for components.
    #[default]
    Eight,
}

impl Connectivity {
    /// The connectivity that the background must have so that a closed curve of the foreground
    /// separates an inside from an outside: four for eight, eight for four.
    #[must_use]
    pub const fn dual(self) -> Self {
        match self {
            Self::Four => Self::Eight,
            Self::Eight => Self::Four,
        }
    }
}

/// The connected foreground component that contains `seed`; empty if the seed is background or
/// outside the image.
#[must_use]
pub fn seed_fill(image: &BitImage, seed: Pixel, connectivity: Connectivity) -> BitImage {
    let mut out = BitImage::new(0, 0);
    seed_fill_into(
        image,
        seed,
        connectivity,
        &mut FillWorkspace::new(),
        &mut out,
    );
    out
}

/// Memory that the `_into` forms of filling keep between calls.
#[derive(Clone, Debug, Default)]
pub struct FillWorkspace {
    stack: Vec<Pixel>,
}

impl FillWorkspace {
    /// A workspace that holds nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// [`seed_fill`] into an image whose memory is reused.
pub fn seed_fill_into(
    image: &BitImage,
    seed: Pixel,
    connectivity: Connectivity,
    workspace: &mut FillWorkspace,
    out: &mut BitImage,
) {
    out.reset(image.width(), image.height());
    workspace.stack.clear();
    workspace.stack.push(seed);
    flood(image, connectivity, workspace, out);
}

/// Reconstruction by dilation: the components of `mask` that hold a foreground pixel of `marker`.
/// Marker pixels outside the mask do not count.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn reconstruct(marker: &BitImage, mask: &BitImage, connectivity: Connectivity) -> BitImage {
    let mut out = BitImage::new(0, 0);
    reconstruct_into(
        marker,
        mask,
        connectivity,
        &mut FillWorkspace::new(),
        &mut out,
    );
    out
}

/// [`reconstruct`] into an image whose memory is reused.
///
/// # Panics
/// If the sizes differ.
pub fn reconstruct_into(
    marker: &BitImage,
    mask: &BitImage,
    connectivity: Connectivity,
    workspace: &mut FillWorkspace,
    out: &mut BitImage,
) {
    assert_eq!(
        (marker.width(), marker.height()),
        (mask.width(), mask.height()),
        "images of different sizes"
    );
    out.reset(mask.width(), mask.height());
    for y in 0..mask.height() {
        for x in 0..mask.width() {
            if marker.get(x, y) {
                workspace.stack.push(Pixel::new(x, y));
                flood(mask, connectivity, workspace, out);
            }
        }
    }
}

fn flood(
    mask: &BitImage,
    connectivity: Connectivity,
    workspace: &mut FillWorkspace,
    out: &mut BitImage,
) {
    while let Some(Pixel { x, y }) = workspace.stack.pop() {
        if !mask.get(x, y) || out.get(x, y) {
            continue;
        }
        out.set(x, y, true);
        for ny in y.saturating_sub(1)..=y + 1 {
            for nx in x.saturating_sub(1)..=x + 1 {
                if connectivity == Connectivity::Eight || nx == x || ny == y {
                    workspace.stack.push(Pixel::new(nx, ny));
                }
            }
        }
    }
}

/// Adds every hole: every background component, of the dual connectivity, that does not touch
/// the image's edge.
#[must_use]
pub fn fill_holes(image: &BitImage, connectivity: Connectivity) -> BitImage {
    let background = image.complement();
    let (width, height) = (image.width(), image.height());
    let edge = BitImage::from_fn(width, height, |x, y| {
        x == 0 || y == 0 || x + 1 == width || y + 1 == height
    });
    let mut filled = reconstruct(&edge, &background, connectivity.dual());
    filled.invert();
    filled
}
