//! Plain twins of the morphological operations.

use crate::{BitImage, Border, Element};

/// The value of a pixel that may lie outside the image: `None` where it does not count.
fn look(image: &BitImage, x: isize, y: isize, border: Border) -> Option<bool> {
    let inside = (0..image.width().cast_signed()).contains(&x)
        && (0..image.height().cast_signed()).contains(&y);
    match border {
        _ if inside => Some(image.get(x.unsigned_abs(), y.unsigned_abs())),
        Border::Neutral => None,
        Border::Background => Some(false),
        Border::Foreground => Some(true),
    }
}

/// Twin of [`erode`](crate::erode()).
#[must_use]
pub fn erode(image: &BitImage, element: &Element, border: Border) -> BitImage {
    BitImage::from_fn(image.width(), image.height(), |x, y| {
        element.offsets().all(|[dx, dy]| {
            look(image, x.cast_signed() + dx, y.cast_signed() + dy, border) != Some(false)
        })
    })
}

/// Twin of [`dilate`](crate::dilate()).
#[must_use]
pub fn dilate(image: &BitImage, element: &Element, border: Border) -> BitImage {
    BitImage::from_fn(image.width(), image.height(), |x, y| {
        element.offsets().any(|[dx, dy]| {
            look(image, x.cast_signed() + dx, y.cast_signed() + dy, border) == Some(true)
        })
    })
}

/// Twin of [`open`](crate::open()): on a plane wide enough that its edge cannot be seen.
#[must_use]
pub fn open(image: &BitImage, element: &Element, border: Border) -> BitImage {
    let (plane, margin) = embed(image, element, border);
    let opened = dilate(
        &erode(&plane, element, border),
        &element.reflected(),
        border,
    );
    crop(&opened, image, margin)
}

/// Twin of [`close`](crate::close()).
#[must_use]
pub fn close(image: &BitImage, element: &Element, border: Border) -> BitImage {
    let (plane, margin) = embed(image, element, border);
    let closed = erode(
        &dilate(&plane, element, border),
        &element.reflected(),
        border,
    );
    crop(&closed, image, margin)
}

/// The image in the middle of a plane of what the border rule says is outside.
fn embed(image: &BitImage, element: &Element, border: Border) -> (BitImage, usize) {
    let reach = element
        .offsets()
        .map(|[dx, dy]| dx.unsigned_abs().max(dy.unsigned_abs()))
        .max()
        .unwrap_or(0);
    let margin = match border {
        Border::Neutral => 0,
        Border::Background | Border::Foreground => 2 * reach,
    };
    let plane = BitImage::from_fn(
        image.width() + 2 * margin,
        image.height() + 2 * margin,
        |x, y| {
            let x = x.cast_signed() - margin.cast_signed();
            let y = y.cast_signed() - margin.cast_signed();
            look(image, x, y, border) == Some(true)
        },
    );
    (plane, margin)
}

fn crop(plane: &BitImage, like: &BitImage, margin: usize) -> BitImage {
    BitImage::from_fn(like.width(), like.height(), |x, y| {
        plane.get(x + margin, y + margin)
    })
}
