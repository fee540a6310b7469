//! 64 comparisons a word.

/// The comparison of 64 values with a limit, as a word.
pub(crate) trait Pack: Copy {
    /// Bit i is set iff `values[i]` is `limit` or more.
    fn at_least(self, values: &[u8; 64], limit: u8) -> u64;
}

/// Eight values in a plain word.
#[derive(Clone, Copy)]
pub(crate) struct Portable;

impl Pack for Portable {
    #[inline(always)]
    fn at_least(self, values: &[u8; 64], limit: u8) -> u64 {
        const TOPS: u64 = 0x8080_8080_8080_8080;
        let limit = u64::from_ne_bytes([limit; 8]);
        let mut word = 0;
        for (i, bytes) in values.as_chunks::<8>().0.iter().enumerate() {
            let value = u64::from_le_bytes(*bytes);
            // the lower seven bits cannot borrow past a set top bit
            let lower = (value | TOPS) - (limit & !TOPS);
            let greater = (value & !limit | !(value ^ limit) & lower) & TOPS;
            // moves the eight top bits together
            word |= (greater >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56 << (8 * i);
        }
        word
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) mod x86 {
    use super::Pack;

    impl Pack for pulp::x86::V4 {
        #[inline(always)]
        fn at_least(self, values: &[u8; 64], limit: u8) -> u64 {
            self.cmp_ge_u8x64(pulp::cast(*values), self.splat_u8x64(limit))
                .0
        }
    }

    impl Pack for pulp::x86::V3 {
        #[inline(always)]
        fn at_least(self, values: &[u8; 64], limit: u8) -> u64 {
            let limit = self.splat_u8x32(limit);
            let [low, high]: [pulp::u8x32; 2] = pulp::cast(*values);
            let mask = |half| {
                let ge = self.cmp_ge_u8x32(half, limit);
                let bits = self.avx2._mm256_movemask_epi8(pulp::cast(ge));
                u64::from(bits.cast_unsigned())
            };
            mask(low) | mask(high) << 32
        }
    }
}
