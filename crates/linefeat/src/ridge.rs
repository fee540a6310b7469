//! Pixels whose gradient magnitude is greatest along the gradient, as bits: row after row through buffers
//! that stay in the nearest cache.

use std::{marker::PhantomData, ops::Range};

use image::GrayImage;

use crate::lanes::{Lanes, Portable};

/// Pixels a word.
const WORD: usize = 64;
/// A word's pixels and one more on either side.
const WIDE: usize = WORD + 2;
/// Places before the first pixel of a row, so that neighbours to the left need no special case.
const MARGIN: usize = 32;

/// The rows at work: row v is kept at v modulo the number of rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows<T> {
    bytes: [Vec<u8>; 3],
    gx: [Vec<T>; 2],
    gy: [Vec<T>; 2],
    magnitude: [Vec<T>; 3],
}

/// Where the bits go.
pub(crate) struct Bits<'a> {
    /// Ridge pixels above the low limit.
    pub(crate) weak: &'a mut [u64],
    /// Those above the high limit.
    pub(crate) strong: &'a mut [u64],
}

/// The two widths of a magnitude.
pub(crate) trait Width: Copy + Default {
    /// Does the rows with the widest registers there are.
    fn run(job: Job<'_, Self>);
}

/// What is to be done.
pub(crate) struct Job<'a, T> {
    pub(crate) image: &'a GrayImage,
    /// The rows whose bits are wanted; the bits of others stay as they are.
    pub(crate) rows: Range<usize>,
    /// Low and high, from -1 to the greatest magnitude there is.
    pub(crate) limits: (i32, i32),
    pub(crate) buffers: &'a mut Rows<T>,
    pub(crate) bits: Bits<'a>,
}

struct With<'a, L: Lanes>(L, Job<'a, L::Value>);

impl<L: Lanes<Value: Default>> pulp::NullaryFnOnce for With<'_, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.1.run(self.0);
    }
}

macro_rules! width {
    ($value:ty, $v4:ident, $v3:ident) => {
        impl Width for $value {
            fn run(job: Job<'_, Self>) {
                #[cfg(target_arch = "x86_64")]
                {
                    use crate::lanes::x86::{$v3, $v4};
                    if let Some(simd) = pulp::x86::V4::try_new() {
                        return simd.vectorize(With($v4(simd), job));
                    }
                    if let Some(simd) = pulp::x86::V3::try_new() {
                        return simd.vectorize(With($v3(simd), job));
                    }
                }
                job.run(Portable::<Self>(PhantomData));
            }
        }
    };
}

width!(i16, V4Short, V3Short);
width!(i32, V4Long, V3Long);

impl<T: Copy + Default> Job<'_, T> {
    #[inline(always)]
    fn run<L: Lanes<Value = T>>(self, lanes: L) {
        let (width, height) = (self.image.width() as usize, self.image.height() as usize);
        if width == 0 || self.rows.is_empty() {
            return;
        }
        let words = width.div_ceil(WORD);
        let raw = self.image.as_raw();
        let buffers = self.buffers;
        buffers.resize(width);
        let first = self.rows.start.saturating_sub(1);
        if self.rows.start == 0 {
            // above the picture
            buffers.magnitude[2].fill(T::default());
        }
        for v in first.saturating_sub(1)..=first {
            buffers.read(v, &raw[v * width..][..width]);
        }
        for v in first..=self.rows.end {
            if v + 1 < height {
                buffers.read(v + 1, &raw[(v + 1) * width..][..width]);
            }
            if v < height {
                let rows = [v.saturating_sub(1), v, (v + 1).min(height - 1)];
                buffers.gradient(lanes, v, rows, width);
            } else {
                buffers.magnitude[v % 3].fill(T::default());
            }
            if v > self.rows.start {
                let at = (v - 1) * words..v * words;
                let bits = Bits {
                    weak: &mut self.bits.weak[at.clone()],
                    strong: &mut self.bits.strong[at],
                };
                buffers.suppress(lanes, v - 1, self.limits, bits);
                mask_last(&mut self.bits.weak[v * words - 1], width);
                mask_last(&mut self.bits.strong[v * words - 1], width);
            }
        }
    }
}

/// Clears the bits past the width in a row's last word.
fn mask_last(word: &mut u64, width: usize) {
    if width % WORD != 0 {
        *word &= (1 << (width % WORD)) - 1;
    }
}

impl<T: Copy + Default> Rows<T> {
    fn resize(&mut self, width: usize) {
        let whole = width.next_multiple_of(WORD);
        for row in &mut self.bytes {
            row.resize(whole + 2 * MARGIN, 0);
        }
        for row in self.gx.iter_mut().chain(&mut self.gy) {
            row.resize(whole, T::default());
        }
        for row in &mut self.magnitude {
            row.clear();
            row.resize(whole + 2 * MARGIN, T::default());
        }
    }

    /// Row `v`, its first and last pixel once more.
    #[inline(always)]
    fn read(&mut self, v: usize, pixels: &[u8]) {
        let row = &mut self.bytes[v % 3];
        row[MARGIN..][..pixels.len()].copy_from_slice(pixels);
        row[MARGIN - 1] = pixels[0];
        row[MARGIN + pixels.len()] = pixels[pixels.len() - 1];
    }

    /// The gradients and magnitudes of row `v` from the rows above, at and below it.
    #[inline(always)]
    fn gradient<L: Lanes<Value = T>>(
        &mut self,
        lanes: L,
        v: usize,
        rows: [usize; 3],
        width: usize,
    ) {
        let [above, here, below] = rows;
        let (above, here, below) = (
            &self.bytes[above % 3],
            &self.bytes[here % 3],
            &self.bytes[below % 3],
        );
        let (gx, _) = self.gx[v % 2].as_chunks_mut::<WORD>();
        let (gy, _) = self.gy[v % 2].as_chunks_mut::<WORD>();
        let (magnitude, _) = self.magnitude[v % 3][MARGIN..].as_chunks_mut::<WORD>();
        for (w, ((gx, gy), magnitude)) in gx.iter_mut().zip(gy).zip(magnitude).enumerate() {
            let at = MARGIN - 1 + w * WORD;
            gradient_word(
                lanes,
                [wide(above, at), wide(here, at), wide(below, at)],
                gx,
                gy,
                magnitude,
            );
        }
        self.magnitude[v % 3][MARGIN + width] = T::default();
    }

    /// The bits of row `v`; the magnitudes of the rows beside it are there.
    #[inline(always)]
    fn suppress<L: Lanes<Value = T>>(
        &self,
        lanes: L,
        v: usize,
        limits: (i32, i32),
        bits: Bits<'_>,
    ) {
        let above = &self.magnitude[(v + 2) % 3];
        let here = &self.magnitude[v % 3];
        let below = &self.magnitude[(v + 1) % 3];
        let (gx, _) = self.gx[v % 2].as_chunks::<WORD>();
        let (gy, _) = self.gy[v % 2].as_chunks::<WORD>();
        let (low, high) = (lanes.splat(limits.0), lanes.splat(limits.1));
        let words = bits.weak.iter_mut().zip(bits.strong);
        for (w, ((weak, strong), (gx, gy))) in words.zip(gx.iter().zip(gy)).enumerate() {
            let at = MARGIN - 1 + w * WORD;
            let rows = [wide(above, at), wide(here, at), wide(below, at)];
            (*weak, *strong) = ridge_word(lanes, rows, gx, gy, low, high);
        }
    }
}

#[inline(always)]
fn wide<T>(row: &[T], at: usize) -> &[T; WIDE] {
    row[at..].first_chunk().expect("rows have margins")
}

#[inline(always)]
fn gradient_word<L: Lanes>(
    l: L,
    [above, here, below]: [&[u8; WIDE]; 3],
    gx: &mut [L::Value; WORD],
    gy: &mut [L::Value; WORD],
    magnitude: &mut [L::Value; WORD],
) {
    let mut i = 0;
    while i < WORD {
        let (ul, u, ur) = (
            l.load_bytes(&above[i..]),
            l.load_bytes(&above[i + 1..]),
            l.load_bytes(&above[i + 2..]),
        );
        let (left, right) = (l.load_bytes(&here[i..]), l.load_bytes(&here[i + 2..]));
        let (dl, d, dr) = (
            l.load_bytes(&below[i..]),
            l.load_bytes(&below[i + 1..]),
            l.load_bytes(&below[i + 2..]),
        );
        // the two diagonals are in both
        let (falling, rising) = (l.sub(dr, ul), l.sub(ur, dl));
        let (across, down) = (l.sub(right, left), l.sub(d, u));
        let x = l.add(l.add(falling, rising), l.add(across, across));
        let y = l.add(l.sub(falling, rising), l.add(down, down));
        l.store(x, &mut gx[i..]);
        l.store(y, &mut gy[i..]);
        l.store(l.magnitude(x, y), &mut magnitude[i..]);
        i += L::COUNT;
    }
}

/// Ridge pixels above the low and above the high limit.
#[inline(always)]
fn ridge_word<L: Lanes>(
    l: L,
    [above, here, below]: [&[L::Value; WIDE]; 3],
    gx: &[L::Value; WORD],
    gy: &[L::Value; WORD],
    low: L::Vector,
    high: L::Vector,
) -> (u64, u64) {
    let one = l.splat(1);
    let (mut weak, mut strong) = (0, 0);
    let mut i = 0;
    while i < WORD {
        let m = l.load(&here[i + 1..]);
        if l.bits(l.greater(m, low)) != 0 {
            let (gx, gy) = (l.load(&gx[i..]), l.load(&gy[i..]));
            let (x, y) = (l.abs(gx), l.abs(gy));
            let flat = l.tangent(x);
            // from 22.5 degrees, from 67.5 degrees, the second or fourth quadrant
            let inclined = l.greater(y, flat);
            let steep = l.greater(y, l.add(l.add(x, x), flat));
            let rising = l.greater(l.splat(0), l.xor(gx, gy));
            let before = l.select(rising, l.load(&above[i + 2..]), l.load(&above[i..]));
            let after = l.select(rising, l.load(&below[i..]), l.load(&below[i + 2..]));
            // along the axes the second neighbour may be as great
            let before = l.select(steep, l.load(&above[i + 1..]), before);
            let after = l.select(steep, l.sub(l.load(&below[i + 1..]), one), after);
            let before = l.select(inclined, before, l.load(&here[i..]));
            let after = l.select(inclined, after, l.sub(l.load(&here[i + 2..]), one));
            let limit = l.max(l.max(before, after), low);
            weak |= l.bits(l.greater(m, limit)) << i;
            strong |= l.bits(l.greater(m, l.max(limit, high))) << i;
        }
        i += L::COUNT;
    }
    (weak, strong)
}
