//! From 8-bit gray to bits and back.

use crate::BitImage;
use crate::pack::pack_rows;

/// The image whose pixel is foreground iff its gray value is `threshold` or more: free from that
/// lightness on.
///
/// # Panics
/// If `gray` does not hold `width * height` values.
#[must_use]
pub fn threshold(gray: &[u8], width: usize, height: usize, threshold: u8) -> BitImage {
    let mut out = BitImage::default();
    threshold_into(gray, width, height, threshold, &mut out);
    out
}

/// [`threshold`](threshold()) into an image whose memory is reused.
///
/// # Panics
/// If `gray` does not hold `width * height` values.
pub fn threshold_into(gray: &[u8], width: usize, height: usize, threshold: u8, out: &mut BitImage) {
    assert_eq!(
        gray.len(),
        width * height,
        "gray values of {width} x {height}"
    );
    out.reshape(width, height);
    if width > 0 {
        pack_rows(gray, width, threshold, out.words_mut());
    }
}

/// 255 for foreground, 0 for background, row after row.
#[must_use]
pub fn to_gray(image: &BitImage) -> Vec<u8> {
    let width = image.width();
    let mut gray = vec![0; width * image.height()];
    if width == 0 {
        return gray;
    }
    for (y, values) in gray.chunks_exact_mut(width).enumerate() {
        for (&word, values) in image.row(y).iter().zip(values.chunks_mut(64)) {
            for (i, value) in values.iter_mut().enumerate() {
                *value = if word >> i & 1 == 1 { 255 } else { 0 };
            }
        }
    }
    gray
}

/// [`threshold`](threshold()) of a gray picture.
#[cfg(feature = "image")]
#[must_use]
pub fn threshold_image(picture: &image::GrayImage, threshold: u8) -> BitImage {
    self::threshold(
        picture.as_raw(),
        picture.width() as usize,
        picture.height() as usize,
        threshold,
    )
}

/// The picture of a binary image: 255 for foreground, 0 for background.
///
/// # Panics
/// If a side exceeds `u32::MAX`.
#[cfg(feature = "image")]
#[must_use]
pub fn to_gray_image(image: &BitImage) -> image::GrayImage {
    let side = |n: usize| u32::try_from(n).expect("a side above u32::MAX");
    image::GrayImage::from_raw(side(image.width()), side(image.height()), to_gray(image))
        .expect("as many values as pixels")
}
