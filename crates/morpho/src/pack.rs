//! 64 comparisons a word: gray values to bits, with the compare-to-mask instruction where there is
//! one.

/// Words from rows of `width` gray values: bit 1 iff the value is `threshold` or more.
pub(crate) fn pack_rows(gray: &[u8], width: usize, threshold: u8, words: &mut [u64]) {
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(simd) = pulp::x86::V4::try_new() {
            let compare = x86::V4(simd, simd.splat_u8x64(threshold));
            return simd.vectorize(Job {
                gray,
                width,
                words,
                compare,
            });
        }
        if let Some(simd) = pulp::x86::V3::try_new() {
            let compare = x86::V3(simd, simd.splat_u8x32(threshold));
            return simd.vectorize(Job {
                gray,
                width,
                words,
                compare,
            });
        }
    }
    rows(gray, width, words, &Portable(threshold));
}

/// The comparison of 64 values, as a word.
trait Compare {
    fn compare(&self, values: &[u8; 64]) -> u64;
}

#[inline(always)]
fn rows(gray: &[u8], width: usize, words: &mut [u64], compare: &impl Compare) {
    let rows = gray.chunks_exact(width);
    for (values, words) in rows.zip(words.chunks_exact_mut(width.div_ceil(64))) {
        let (blocks, rest) = values.as_chunks::<64>();
        for (word, block) in words.iter_mut().zip(blocks) {
            *word = compare.compare(block);
        }
        if !rest.is_empty() {
            let mut block = [0; 64];
            block[..rest.len()].copy_from_slice(rest);
            let inside = (1 << rest.len()) - 1;
            words[blocks.len()] = compare.compare(&block) & inside;
        }
    }
}

/// The arguments, to be run with the registers that `compare` needs.
struct Job<'a, C> {
    gray: &'a [u8],
    width: usize,
    words: &'a mut [u64],
    compare: C,
}

impl<C: Compare> pulp::NullaryFnOnce for Job<'_, C> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        rows(self.gray, self.width, self.words, &self.compare);
    }
}

/// Eight values in a plain word.
struct Portable(u8);

impl Compare for Portable {
    #[inline(always)]
    fn compare(&self, values: &[u8; 64]) -> u64 {
        const TOPS: u64 = 0x8080_8080_8080_8080;
        let threshold = u64::from_ne_bytes([self.0; 8]);
        let mut word = 0;
        for (i, bytes) in values.as_chunks::<8>().0.iter().enumerate() {
            let value = u64::from_le_bytes(*bytes);
            // the lower seven bits cannot borrow past a set top bit
            let lower = (value | TOPS) - (threshold & !TOPS);
            let greater = (value & !threshold | !(value ^ threshold) & lower) & TOPS;
            // moves the eight top bits together
            word |= (greater >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56 << (8 * i);
        }
        word
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::Compare;

    pub(super) struct V4(pub(super) pulp::x86::V4, pub(super) pulp::u8x64);

    impl Compare for V4 {
        #[inline(always)]
        fn compare(&self, values: &[u8; 64]) -> u64 {
            self.0.cmp_ge_u8x64(pulp::cast(*values), self.1).0
        }
    }

    pub(super) struct V3(pub(super) pulp::x86::V3, pub(super) pulp::u8x32);

    impl Compare for V3 {
        #[inline(always)]
        fn compare(&self, values: &[u8; 64]) -> u64 {
            let [low, high]: [pulp::u8x32; 2] = pulp::cast(*values);
            let mask = |half| {
                let ge = self.0.cmp_ge_u8x32(half, self.1);
                let bits = self.0.avx2._mm256_movemask_epi8(pulp::cast(ge));
                u64::from(bits.cast_unsigned())
            };
            mask(low) | mask(high) << 32
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the machine can do must agree with the definition.
    #[test]
    fn every_way_compares_alike() {
        let mut values = [0; 64];
        for threshold in 0..=255_u8 {
            for round in 0..8_u8 {
                for (i, value) in (0_u8..).zip(&mut values) {
                    *value = match round {
                        0 => threshold.wrapping_add(i).wrapping_sub(32),
                        _ => i.wrapping_mul(37).wrapping_add(round * 29),
                    };
                }
                let want = (0..64).fold(0, |word, i| word | u64::from(values[i] >= threshold) << i);
                assert_eq!(Portable(threshold).compare(&values), want);
                #[cfg(target_arch = "x86_64")]
                {
                    if let Some(simd) = pulp::x86::V4::try_new() {
                        let compare = x86::V4(simd, simd.splat_u8x64(threshold));
                        assert_eq!(compare.compare(&values), want);
                    }
                    if let Some(simd) = pulp::x86::V3::try_new() {
                        let compare = x86::V3(simd, simd.splat_u8x32(threshold));
                        assert_eq!(compare.compare(&values), want);
                    }
                }
            }
        }
    }
}
