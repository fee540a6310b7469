//! Vectors of magnitudes: the few operations that the ridge search needs, on what registers there are.

use std::marker::PhantomData;

/// `COUNT` values at once. `COUNT` divides 64.
pub(crate) trait Lanes: Copy {
    /// 16 bits for sums of absolute values, 32 for squared lengths.
    type Value: Copy;
    type Vector: Copy;
    type Mask: Copy;
    const COUNT: usize;

    fn splat(self, value: i32) -> Self::Vector;
    /// The first values of `from`.
    fn load(self, from: &[Self::Value]) -> Self::Vector;
    fn load_bytes(self, from: &[u8]) -> Self::Vector;
    fn store(self, vector: Self::Vector, to: &mut [Self::Value]);
    fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn xor(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn max(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn abs(self, a: Self::Vector) -> Self::Vector;
    /// a tan 22.5 degrees, rounded down, for a from 0 to 1020.
    fn tangent(self, a: Self::Vector) -> Self::Vector;
    /// The magnitude that belongs to `Value`.
    fn magnitude(self, gx: Self::Vector, gy: Self::Vector) -> Self::Vector;
    fn greater(self, a: Self::Vector, b: Self::Vector) -> Self::Mask;
    fn select(self, mask: Self::Mask, yes: Self::Vector, no: Self::Vector) -> Self::Vector;
    /// The lanes of the mask, first lane lowest.
    fn bits(self, mask: Self::Mask) -> u64;
}

/// Work on vectors of `Value`, whatever their length.
pub(crate) trait Task {
    type Value;
    type Output;
    fn run<L: Lanes<Value = Self::Value>>(self, lanes: L) -> Self::Output;
}

/// What the machine has.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Registers {
    Plain,
    #[cfg(target_arch = "x86_64")]
    V3(pulp::x86::V3),
    #[cfg(target_arch = "x86_64")]
    V4(pulp::x86::V4),
}

impl Registers {
    /// All kinds, the widest first.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        #[cfg(target_arch = "x86_64")]
        let wide = [
            pulp::x86::V4::try_new().map(Self::V4),
            pulp::x86::V3::try_new().map(Self::V3),
        ];
        #[cfg(not(target_arch = "x86_64"))]
        let wide = [None];
        wide.into_iter().flatten().chain([Self::Plain])
    }
}

/// The two widths of a magnitude.
pub(crate) trait Width: Copy + Default {
    fn run_on<T: Task<Value = Self>>(registers: Registers, task: T) -> T::Output;

    /// Does the work with the widest registers there are.
    fn dispatch<T: Task<Value = Self>>(task: T) -> T::Output {
        Self::run_on(Registers::all().next().unwrap_or(Registers::Plain), task)
    }
}

#[cfg(target_arch = "x86_64")]
struct With<L, T>(L, T);

#[cfg(target_arch = "x86_64")]
impl<L: Lanes, T: Task<Value = L::Value>> pulp::NullaryFnOnce for With<L, T> {
    type Output = T::Output;

    #[inline(always)]
    fn call(self) -> T::Output {
        self.1.run(self.0)
    }
}

macro_rules! width {
    ($value:ty, $v4:ident, $v3:ident) => {
        impl Width for $value {
            fn run_on<T: Task<Value = Self>>(registers: Registers, task: T) -> T::Output {
                match registers {
                    Registers::Plain => task.run(Portable::<Self>(PhantomData)),
                    #[cfg(target_arch = "x86_64")]
                    Registers::V3(simd) => simd.vectorize(With(x86::$v3(simd), task)),
                    #[cfg(target_arch = "x86_64")]
                    Registers::V4(simd) => simd.vectorize(With(x86::$v4(simd), task)),
                }
            }
        }
    };
}

width!(i16, V4Short, V3Short);
width!(i32, V4Long, V3Long);

/// tan 22.5 degrees in units of 2^-15
const TAN: i32 = 13573;

/// Without special registers.
#[derive(Clone, Copy)]
pub(crate) struct Portable<T>(PhantomData<T>);

macro_rules! portable {
    ($value:ty, |$gx:ident, $gy:ident| $magnitude:expr) => {
        impl Lanes for Portable<$value> {
            type Value = $value;
            type Vector = [$value; 16];
            type Mask = [bool; 16];
            const COUNT: usize = 16;

            #[inline(always)]
            fn splat(self, value: i32) -> Self::Vector {
                [value as $value; 16]
            }
            #[inline(always)]
            fn load(self, from: &[$value]) -> Self::Vector {
                *from.first_chunk().expect("a vector")
            }
            #[inline(always)]
            fn load_bytes(self, from: &[u8]) -> Self::Vector {
                std::array::from_fn(|i| from[i].into())
            }
            #[inline(always)]
            fn store(self, vector: Self::Vector, to: &mut [$value]) {
                to[..16].copy_from_slice(&vector);
            }
            #[inline(always)]
            fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
                std::array::from_fn(|i| a[i] + b[i])
            }
            #[inline(always)]
            fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
                std::array::from_fn(|i| a[i] - b[i])
            }
            #[inline(always)]
            fn xor(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
                std::array::from_fn(|i| a[i] ^ b[i])
            }
            #[inline(always)]
            fn max(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
                std::array::from_fn(|i| a[i].max(b[i]))
            }
            #[inline(always)]
            fn abs(self, a: Self::Vector) -> Self::Vector {
                a.map(<$value>::abs)
            }
            #[inline(always)]
            fn tangent(self, a: Self::Vector) -> Self::Vector {
                a.map(|a| (i32::from(a) * TAN >> 15) as $value)
            }
            #[inline(always)]
            fn magnitude(self, gx: Self::Vector, gy: Self::Vector) -> Self::Vector {
                std::array::from_fn(|i| {
                    let ($gx, $gy) = (gx[i], gy[i]);
                    $magnitude
                })
            }
            #[inline(always)]
            fn greater(self, a: Self::Vector, b: Self::Vector) -> Self::Mask {
                std::array::from_fn(|i| a[i] > b[i])
            }
            #[inline(always)]
            fn select(self, mask: Self::Mask, yes: Self::Vector, no: Self::Vector) -> Self::Vector {
                std::array::from_fn(|i| if mask[i] { yes[i] } else { no[i] })
            }
            #[inline(always)]
            fn bits(self, mask: Self::Mask) -> u64 {
                (0..16).fold(0, |bits, i| bits | u64::from(mask[i]) << i)
            }
        }
    };
}

portable!(i16, |gx, gy| gx.abs() + gy.abs());
portable!(i32, |gx, gy| gx * gx + gy * gy);

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{__m256i, __m512i, __mmask16, __mmask32};

    use pulp::x86::{V3, V4};

    use super::{Lanes, TAN};

    macro_rules! lanes {
        (
            $name:ident($simd:ty): $count:literal of $value:ty, $vector:ty, $mask:ty;
            |$s:ident, $a:ident, $b:ident, $c:ident|
            splat $splat:expr, bytes $bytes:expr, add $add:expr, sub $sub:expr, xor $xor:expr,
            max $max:expr, abs $abs:expr, tangent $tangent:expr, magnitude $magnitude:expr,
            greater $greater:expr, select $select:expr, bits $bits:expr,
        ) => {
            #[derive(Clone, Copy)]
            pub(super) struct $name(pub(super) $simd);

            impl Lanes for $name {
                type Value = $value;
                type Vector = $vector;
                type Mask = $mask;
                const COUNT: usize = $count;

                #[inline(always)]
                fn splat(self, value: i32) -> $vector {
                    let ($s, $a) = (self.0, value as $value);
                    $splat
                }
                #[inline(always)]
                fn load(self, from: &[$value]) -> $vector {
                    pulp::cast(*from.first_chunk::<$count>().expect("a vector"))
                }
                #[inline(always)]
                fn load_bytes(self, from: &[u8]) -> $vector {
                    let ($s, $a) = (self.0, *from.first_chunk::<$count>().expect("a vector"));
                    $bytes
                }
                #[inline(always)]
                fn store(self, vector: $vector, to: &mut [$value]) {
                    *to.first_chunk_mut::<$count>().expect("a vector") = pulp::cast(vector);
                }
                #[inline(always)]
                fn add(self, $a: $vector, $b: $vector) -> $vector {
                    let $s = self.0;
                    $add
                }
                #[inline(always)]
                fn sub(self, $a: $vector, $b: $vector) -> $vector {
                    let $s = self.0;
                    $sub
                }
                #[inline(always)]
                fn xor(self, $a: $vector, $b: $vector) -> $vector {
                    let $s = self.0;
                    $xor
                }
                #[inline(always)]
                fn max(self, $a: $vector, $b: $vector) -> $vector {
                    let $s = self.0;
                    $max
                }
                #[inline(always)]
                fn abs(self, $a: $vector) -> $vector {
                    let $s = self.0;
                    $abs
                }
                #[inline(always)]
                fn tangent(self, $a: $vector) -> $vector {
                    let $s = self.0;
                    $tangent
                }
                #[inline(always)]
                fn magnitude(self, $a: $vector, $b: $vector) -> $vector {
                    let $s = self.0;
                    $magnitude
                }
                #[inline(always)]
                fn greater(self, $a: $vector, $b: $vector) -> $mask {
                    let $s = self.0;
                    $greater
                }
                #[inline(always)]
                fn select(self, $c: $mask, $a: $vector, $b: $vector) -> $vector {
                    let $s = self.0;
                    $select
                }
                #[inline(always)]
                fn bits(self, $c: $mask) -> u64 {
                    let $s = self.0;
                    $bits
                }
            }
        };
    }

    lanes! {
        V4Short(V4): 32 of i16, __m512i, __mmask32;
        |s, a, b, mask|
        splat s.avx512f._mm512_set1_epi16(a),
        bytes s.avx512bw._mm512_cvtepu8_epi16(pulp::cast(a)),
        add s.avx512bw._mm512_add_epi16(a, b),
        sub s.avx512bw._mm512_sub_epi16(a, b),
        xor s.avx512f._mm512_xor_si512(a, b),
        max s.avx512bw._mm512_max_epi16(a, b),
        abs s.avx512bw._mm512_abs_epi16(a),
        tangent s.avx512bw._mm512_mulhi_epi16(
            s.avx512bw._mm512_add_epi16(a, a),
            s.avx512f._mm512_set1_epi16(TAN as i16),
        ),
        magnitude s.avx512bw._mm512_add_epi16(
            s.avx512bw._mm512_abs_epi16(a),
            s.avx512bw._mm512_abs_epi16(b),
        ),
        greater s.avx512bw._mm512_cmpgt_epi16_mask(a, b),
        select s.avx512bw._mm512_mask_blend_epi16(mask, b, a),
        bits {
            let _ = s;
            mask.into()
        },
    }

    lanes! {
        V4Long(V4): 16 of i32, __m512i, __mmask16;
        |s, a, b, mask|
        splat s.avx512f._mm512_set1_epi32(a),
        bytes s.avx512f._mm512_cvtepu8_epi32(pulp::cast(a)),
        add s.avx512f._mm512_add_epi32(a, b),
        sub s.avx512f._mm512_sub_epi32(a, b),
        xor s.avx512f._mm512_xor_si512(a, b),
        max s.avx512f._mm512_max_epi32(a, b),
        abs s.avx512f._mm512_abs_epi32(a),
        tangent s.avx512f._mm512_srai_epi32::<15>(
            s.avx512bw._mm512_madd_epi16(a, s.avx512f._mm512_set1_epi32(TAN)),
        ),
        magnitude s.avx512f._mm512_add_epi32(
            s.avx512f._mm512_mullo_epi32(a, a),
            s.avx512f._mm512_mullo_epi32(b, b),
        ),
        greater s.avx512f._mm512_cmpgt_epi32_mask(a, b),
        select s.avx512f._mm512_mask_blend_epi32(mask, b, a),
        bits {
            let _ = s;
            mask.into()
        },
    }

    lanes! {
        V3Short(V3): 16 of i16, __m256i, __m256i;
        |s, a, b, mask|
        splat s.avx._mm256_set1_epi16(a),
        bytes s.avx2._mm256_cvtepu8_epi16(pulp::cast(a)),
        add s.avx2._mm256_add_epi16(a, b),
        sub s.avx2._mm256_sub_epi16(a, b),
        xor s.avx2._mm256_xor_si256(a, b),
        max s.avx2._mm256_max_epi16(a, b),
        abs s.avx2._mm256_abs_epi16(a),
        tangent s.avx2._mm256_mulhi_epi16(
            s.avx2._mm256_add_epi16(a, a),
            s.avx._mm256_set1_epi16(TAN as i16),
        ),
        magnitude s.avx2._mm256_add_epi16(s.avx2._mm256_abs_epi16(a), s.avx2._mm256_abs_epi16(b)),
        greater s.avx2._mm256_cmpgt_epi16(a, b),
        select s.avx2._mm256_blendv_epi8(b, a, mask),
        bits {
            // eight bytes of each half
            let packed = s.avx2._mm256_packs_epi16(mask, s.avx._mm256_setzero_si256());
            let bits = s.avx2._mm256_movemask_epi8(packed).cast_unsigned();
            (bits & 0xFF | bits >> 8 & 0xFF00).into()
        },
    }

    lanes! {
        V3Long(V3): 8 of i32, __m256i, __m256i;
        |s, a, b, mask|
        splat s.avx._mm256_set1_epi32(a),
        bytes s.avx2._mm256_cvtepu8_epi32(pulp::cast(u128::from(u64::from_le_bytes(a)))),
        add s.avx2._mm256_add_epi32(a, b),
        sub s.avx2._mm256_sub_epi32(a, b),
        xor s.avx2._mm256_xor_si256(a, b),
        max s.avx2._mm256_max_epi32(a, b),
        abs s.avx2._mm256_abs_epi32(a),
        tangent s.avx2._mm256_srai_epi32::<15>(
            s.avx2._mm256_madd_epi16(a, s.avx._mm256_set1_epi32(TAN)),
        ),
        magnitude s.avx2._mm256_add_epi32(
            s.avx2._mm256_mullo_epi32(a, a),
            s.avx2._mm256_mullo_epi32(b, b),
        ),
        greater s.avx2._mm256_cmpgt_epi32(a, b),
        select s.avx2._mm256_blendv_epi8(b, a, mask),
        bits u64::from(s.avx._mm256_movemask_ps(pulp::cast(mask)).cast_unsigned()),
    }
}
