//! Thinning: to lines one pixel wide.

mod active;
mod homotopic;
mod octagons;
mod ordered;
mod tile;
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

/// Thinning to a centred skeleton one pixel wide, which keeps the topology of every image: each
/// 8-connected part of the foreground keeps one part of the skeleton, each 4-connected part of the
/// background (outside = background) stays apart and none is made.
///
/// Peels by octagonal distance from the background, which is within 4 % of the Euclidean one. No pixel
/// can be deleted without a change of topology but ends, and these reach to half the width of a
/// corridor from its dead end; corners of rooms get no branch. Deterministic. The time grows with the
/// area of the tiles (64 x 16 pixels) that still change, summed over the layers.
#[must_use]
pub fn homotopic(image: &BitImage) -> BitImage {
    homotopic::thin(image, Octagons::new(image))
}

/// As [`homotopic`], peeled in ascending `order` (one value a pixel, row after row; those of
/// background do not matter), such as a distance. Each distinct value is a layer: steps of about a
/// cell, as of a rounded distance, make the fewest spurs.
///
/// # Panics
/// If `order` has not one value a pixel, or the image has 2^32 pixels or more.
#[must_use]
pub fn homotopic_ordered(image: &BitImage, order: &[u32]) -> BitImage {
    assert_eq!(
        order.len(),
        image.width() * image.height(),
        "one value a pixel"
    );
    homotopic::thin(image, Ordered::new(image, order))
}
