//! A bit image from one value a cell.

use morpho::BitImage;

/// The image whose pixels are the values, row after row, for which `is_set` holds.
///
/// The comparison runs over bytes and the packing over words, so that both become vector code.
///
/// # Panics
/// If there is not one value a pixel.
pub(crate) fn pack<T: Copy>(
    values: &[T],
    width: usize,
    height: usize,
    is_set: impl Fn(T) -> bool,
) -> BitImage {
    assert_eq!(values.len(), width * height, "values of {width} x {height}");
    let mut words = Vec::with_capacity(width.div_ceil(64) * height);
    for row in values.chunks_exact(width.max(1)) {
        let (whole, rest) = row.as_chunks::<64>();
        for chunk in whole {
            let mut set = [0_u8; 64];
            for (byte, &value) in set.iter_mut().zip(chunk) {
                *byte = u8::from(is_set(value));
            }
            words.push(gather(&set));
        }
        if !rest.is_empty() {
            let mut set = [0_u8; 64];
            for (byte, &value) in set.iter_mut().zip(rest) {
                *byte = u8::from(is_set(value));
            }
            words.push(gather(&set));
        }
    }
    BitImage::from_words(width, height, words)
}

/// The bits of 64 bytes that are 0 or 1.
fn gather(set: &[u8; 64]) -> u64 {
    let (eights, _) = set.as_chunks::<8>();
    eights.iter().enumerate().fold(0, |word, (k, eight)| {
        // byte i of the factor's product's top byte: bit i set where byte i is 1
        let bits = u64::from_le_bytes(*eight).wrapping_mul(0x0102_0408_1020_4080) >> 56;
        word | bits << (8 * k)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_lands_in_its_pixel() {
        for width in [0_usize, 1, 7, 63, 64, 65, 127, 128, 129] {
            for height in [0_usize, 1, 3] {
                let values: Vec<u32> = (0..width * height)
                    .map(|i| (i as u32).wrapping_mul(2_654_435_761) >> 16)
                    .collect();
                let packed = pack(&values, width, height, |v| v >= 30_000);
                let plain =
                    BitImage::from_fn(width, height, |x, y| values[y * width + x] >= 30_000);
                assert_eq!(packed, plain, "{width} x {height}");
            }
        }
    }
}
