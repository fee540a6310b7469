//! Pixels whose gradient magnitude is greatest along the gradient, as bits: row after row through buffers
//! that stay in the nearest cache.

use std::ops::{Add, Range};

use image::GrayImage;

use crate::pack::{self, Pack};

/// Pixels a word.
const WORD: usize = 64;
/// Values before the first of a row, so that neighbours to the left need no special case.
const MARGIN: usize = 32;
/// tan 22.5 degrees in units of 2^-15
const TAN: i32 = 13573;

/// A gradient magnitude: the sum of absolute values, or the squared length.
pub(crate) trait Magnitude: Copy + Ord + Default + Add<Output = Self> + From<bool> {
    fn of(gx: i16, gy: i16) -> Self;
    /// The greatest value that compares with every magnitude as `limit` does.
    fn limit(limit: i32) -> Self;
}

impl Magnitude for i16 {
    #[inline(always)]
    fn of(gx: i16, gy: i16) -> Self {
        gx.abs() + gy.abs()
    }

    fn limit(limit: i32) -> Self {
        limit.clamp(-1, 4000) as Self
    }
}

impl Magnitude for i32 {
    #[inline(always)]
    fn of(gx: i16, gy: i16) -> Self {
        let (gx, gy) = (Self::from(gx), Self::from(gy));
        gx * gx + gy * gy
    }

    fn limit(limit: i32) -> Self {
        limit
    }
}

/// The rows at work.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows<M> {
    sum: Vec<i16>,
    difference: Vec<i16>,
    gx: [Vec<i16>; 2],
    gy: [Vec<i16>; 2],
    magnitude: [Vec<M>; 3],
}

/// Where the bits go.
pub(crate) struct Bits<'a> {
    /// Ridge pixels above the low limit.
    pub(crate) weak: &'a mut [u64],
    /// Those above the high limit.
    pub(crate) strong: &'a mut [u64],
}

/// Bits of the rows of `rows`, all other rows being untouched.
pub(crate) fn ridges<M: Magnitude>(
    image: &GrayImage,
    rows: Range<usize>,
    limits: (i32, i32),
    buffers: &mut Rows<M>,
    bits: Bits<'_>,
) {
    let (low, high) = (M::limit(limits.0), M::limit(limits.1));
    buffers.resize(image.width() as usize);
    macro_rules! job {
        ($simd:expr) => {
            Job {
                image,
                rows,
                low,
                high,
                buffers,
                bits,
                pack: $simd,
            }
        };
    }
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(simd) = pulp::x86::V4::try_new() {
            return simd.vectorize(job!(simd));
        }
        if let Some(simd) = pulp::x86::V3::try_new() {
            return simd.vectorize(job!(simd));
        }
    }
    pulp::NullaryFnOnce::call(job!(pack::Portable));
}

struct Job<'a, M, P> {
    image: &'a GrayImage,
    rows: Range<usize>,
    low: M,
    high: M,
    buffers: &'a mut Rows<M>,
    bits: Bits<'a>,
    pack: P,
}

impl<M: Magnitude, P: Pack> pulp::NullaryFnOnce for Job<'_, M, P> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self {
            image,
            rows,
            low,
            high,
            buffers,
            bits,
            pack,
        } = self;
        let (width, height) = (image.width() as usize, image.height() as usize);
        let words = width.div_ceil(WORD);
        let raw = image.as_raw();
        let row = |v: usize| &raw[v * width..][..width];
        // the row above the first: zero outside the picture
        let mut done = rows.start.saturating_sub(1);
        if rows.start == 0 {
            buffers.magnitude[2].fill(M::default());
        }
        let last = (rows.end + 1).min(height);
        for v in rows.start.saturating_sub(1)..rows.end + 1 {
            buffers.turn();
            if v < last {
                buffers.gradient(
                    row(v.saturating_sub(1)),
                    row(v),
                    row((v + 1).min(height - 1)),
                );
            } else {
                buffers.magnitude[2].fill(M::default());
            }
            if v > done && rows.contains(&(v - 1)) {
                done = v - 1;
                let at = done * words..(done + 1) * words;
                buffers.suppress(
                    width,
                    low,
                    high,
                    pack,
                    &mut bits.weak[at.clone()],
                    &mut bits.strong[at],
                );
            }
        }
    }
}

impl<M: Magnitude> Rows<M> {
    fn resize(&mut self, width: usize) {
        let size = 2 * MARGIN + width.next_multiple_of(WORD);
        for row in [&mut self.sum, &mut self.difference] {
            row.resize(size, 0);
        }
        for row in self.gx.iter_mut().chain(&mut self.gy) {
            row.resize(size - 2 * MARGIN, 0);
        }
        for row in &mut self.magnitude {
            row.clear();
            row.resize(size, M::default());
        }
    }

    #[inline(always)]
    fn turn(&mut self) {
        self.gx.swap(0, 1);
        self.gy.swap(0, 1);
        self.magnitude.rotate_left(1);
    }

    /// The newest row of gradients and magnitudes from the three rows of pixels about it.
    #[inline(always)]
    fn gradient(&mut self, above: &[u8], here: &[u8], below: &[u8]) {
        let width = here.len();
        let (sum, difference) = (&mut self.sum[..], &mut self.difference[..]);
        columns(
            above,
            here,
            below,
            &mut sum[MARGIN..],
            &mut difference[MARGIN..],
        );
        for row in [&mut *sum, difference] {
            row[MARGIN - 1] = row[MARGIN];
            row[MARGIN + width] = row[MARGIN + width - 1];
        }
        let gx = &mut self.gx[1][..];
        let gy = &mut self.gy[1][..];
        let n = gx.len();
        let magnitude = &mut self.magnitude[2][..];
        {
            let (sl, sr) = (&sum[MARGIN - 1..][..n], &sum[MARGIN + 1..][..n]);
            let (dl, d, dr) = (
                &difference[MARGIN - 1..][..n],
                &difference[MARGIN..][..n],
                &difference[MARGIN + 1..][..n],
            );
            let gy = &mut gy[..n];
            let m = &mut magnitude[MARGIN..][..n];
            for i in 0..n {
                gx[i] = sr[i] - sl[i];
                gy[i] = dl[i] + 2 * d[i] + dr[i];
                m[i] = M::of(gx[i], gy[i]);
            }
        }
        magnitude[MARGIN + width] = M::default();
    }

    /// The bits of the row before the newest.
    #[inline(always)]
    fn suppress<P: Pack>(
        &self,
        width: usize,
        low: M,
        high: M,
        pack: P,
        weak: &mut [u64],
        strong: &mut [u64],
    ) {
        let [above, here, below] = &self.magnitude;
        let words = weak.len();
        for w in 0..words {
            let at = MARGIN + w * WORD;
            let block = |row: &[M], at: usize| -> [M; WORD] {
                *row[at..]
                    .first_chunk::<WORD>()
                    .unwrap_or(&[M::default(); WORD])
            };
            let m = block(here, at);
            let mut any = false;
            for m in m {
                any |= m > low;
            }
            if !any {
                (weak[w], strong[w]) = (0, 0);
                continue;
            }
            let gx: &[i16; WORD] = self.gx[0][w * WORD..].first_chunk().expect("whole words");
            let gy: &[i16; WORD] = self.gy[0][w * WORD..].first_chunk().expect("whole words");
            let rows = [above, here, below].map(|row| {
                [-1, 0, 1].map(|d: isize| {
                    let b: &[M; WORD] = row[at.wrapping_add_signed(d)..]
                        .first_chunk()
                        .expect("margins");
                    b
                })
            });
            let flags = flags(gx, gy, rows, low, high);
            weak[w] = pack.at_least(&flags, 1);
            strong[w] = pack.at_least(&flags, 2);
        }
        if width % WORD != 0 && words > 0 {
            let inside = (1 << (width % WORD)) - 1;
            weak[words - 1] &= inside;
            strong[words - 1] &= inside;
        }
    }
}

/// 1 at ridge pixels above the low limit, 2 above the high one.
#[inline(always)]
fn flags<M: Magnitude>(
    gx: &[i16; WORD],
    gy: &[i16; WORD],
    [above, here, below]: [[&[M; WORD]; 3]; 3],
    low: M,
    high: M,
) -> [u8; WORD] {
    let mut flags = [0; WORD];
    for i in 0..WORD {
        let m = here[1][i];
        let (x, y) = (gx[i].abs(), gy[i].abs());
        let flat = ((i32::from(2 * x) * TAN) >> 16) as i16;
        let horizontal = y <= flat;
        let vertical = y > 2 * x + flat;
        let falling = (gx[i] ^ gy[i]) < 0;
        let (ul, um, ur) = (above[0][i], above[1][i], above[2][i]);
        let (l, r) = (here[0][i], here[2][i]);
        let (dl, dm, dr) = (below[0][i], below[1][i], below[2][i]);
        let before = if falling { ur } else { ul };
        let after = if falling { dl } else { dr };
        let before = if vertical { um } else { before };
        let after = if vertical { dm } else { after };
        let before = if horizontal { l } else { before };
        let after = if horizontal { r } else { after };
        let strict = M::from(!(horizontal | vertical));
        let ridge = (m > before) & (m >= after + strict) & (m > low);
        flags[i] = u8::from(ridge) + u8::from(ridge & (m > high));
    }
    flags
}

/// Down the columns of three rows: 1 2 1 and -1 0 1.
#[inline(always)]
fn columns(above: &[u8], here: &[u8], below: &[u8], sum: &mut [i16], difference: &mut [i16]) {
    let (a, a_rest) = above.as_chunks::<WORD>();
    let (h, h_rest) = here.as_chunks::<WORD>();
    let (b, b_rest) = below.as_chunks::<WORD>();
    let (s, _) = sum.as_chunks_mut::<WORD>();
    let (d, _) = difference.as_chunks_mut::<WORD>();
    let n = h.len();
    for i in 0..n {
        column_block(&a[i], &h[i], &b[i], &mut s[i], &mut d[i]);
    }
    if !h_rest.is_empty() {
        let pad = |rest: &[u8]| {
            let mut block = [0; WORD];
            block[..rest.len()].copy_from_slice(rest);
            block
        };
        column_block(
            &pad(a_rest),
            &pad(h_rest),
            &pad(b_rest),
            &mut s[n],
            &mut d[n],
        );
    }
}

#[inline(always)]
fn column_block(
    above: &[u8; WORD],
    here: &[u8; WORD],
    below: &[u8; WORD],
    sum: &mut [i16; WORD],
    difference: &mut [i16; WORD],
) {
    for i in 0..WORD {
        let (a, h, b) = (i16::from(above[i]), i16::from(here[i]), i16::from(below[i]));
        sum[i] = a + 2 * h + b;
        difference[i] = b - a;
    }
}
