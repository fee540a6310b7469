//! Thinning: to lines one pixel wide.

mod homotopic;
mod octagons;
mod ordered;
mod tiles;
mod two_pass;

use crate::BitImage;
use octagons::Octagons;
use ordered::Ordered;

/// Thinning after Zhang and Suen (A fast parallel algorithm for thinning digital patterns, CACM 1984),
/// bit for bit as OpenCV's `ximgproc.thinning`: the outermost rows and columns are never deleted.
///
/// It may delete 2x2 blocks wholly; where counts of parts matter take [`homotopic`].
#[must_use]
pub fn zhang_suen(image: &BitImage) -> BitImage {
    two_pass::thin::<two_pass::ZhangSuen>(image)
}

/// Thinning after Guo and Hall (Parallel thinning with two-subiteration algorithms, CACM 1989), bit for
/// bit as OpenCV's `ximgproc.thinning`: the outermost rows and columns are never deleted.
#[must_use]
pub fn guo_hall(image: &BitImage) -> BitImage {
    two_pass::thin::<two_pass::GuoHall>(image)
}

/// Thinning to a centred skeleton one pixel wide that keeps the topology of every image: as many
/// 8-connected foreground components and 4-connected background components (outside = background).
#[must_use]
pub fn homotopic(image: &BitImage) -> BitImage {
    homotopic::thin(image, Octagons::new(image))
}

/// As [`homotopic`], peeled in ascending `order` (one value a pixel, row after row; background's are
/// ignored). Few distinct values are faster: each is a layer.
///
/// # Panics
/// If `order` has not one entry a pixel.
#[must_use]
pub fn homotopic_ordered(image: &BitImage, order: &[u32]) -> BitImage {
    assert_eq!(
        order.len(),
        image.width() * image.height(),
        "one order a pixel"
    );
    homotopic::thin(image, Ordered::new(image, order))
}
