//! Pixels whose gradient magnitude is greatest along the gradient, as bits: row after row through buffers
//! that stay in the nearest cache.

use std::ops::Range;

use image::GrayImage;

use crate::{
    bits::Bits,
    lanes::{Lanes, Task, Width},
    rows::{MARGIN, Rows, WIDE, WORD, wide},
};

/// The search for ridge pixels.
pub(crate) struct Ridges<'a, T> {
    pub(crate) image: &'a GrayImage,
    /// The rows whose bits are wanted; the bits of others stay as they are.
    pub(crate) rows: Range<usize>,
    /// Low and high, from -1 to the greatest magnitude there is.
    pub(crate) limits: (i32, i32),
    pub(crate) buffers: &'a mut Rows<T>,
    /// Gets the ridge pixels above the low limit.
    pub(crate) weak: &'a mut Bits,
    /// Gets those above the high limit.
    pub(crate) strong: &'a mut Bits,
}

impl<T: Width> Task for Ridges<'_, T> {
    type Value = T;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Value = T>>(self, lanes: L) {
        let (width, height) = (self.image.width() as usize, self.image.height() as usize);
        if width == 0 || self.rows.is_empty() {
            return;
        }
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
                buffers.gradient(lanes, v, width, height);
            } else {
                buffers.magnitude[v % 3].fill(T::default());
            }
            if v > self.rows.start {
                let (weak, strong) = (self.weak.row_mut(v - 1), self.strong.row_mut(v - 1));
                buffers.suppress(lanes, v - 1, self.limits, weak, strong);
                mask_last(weak, width);
                mask_last(strong, width);
            }
        }
    }
}

/// Clears the bits past the width in a row's last word.
fn mask_last(row: &mut [u64], width: usize) {
    if let (Some(last), bits @ 1..) = (row.last_mut(), width % WORD) {
        *last &= (1 << bits) - 1;
    }
}

impl<T: Width> Rows<T> {
    /// The bits of row `v`; the magnitudes of the rows beside it are there.
    #[inline(always)]
    fn suppress<L: Lanes<Value = T>>(
        &self,
        lanes: L,
        v: usize,
        limits: (i32, i32),
        weak: &mut [u64],
        strong: &mut [u64],
    ) {
        let above = &self.magnitude[(v + 2) % 3];
        let here = &self.magnitude[v % 3];
        let below = &self.magnitude[(v + 1) % 3];
        let (gx, _) = self.gx[v % 2].as_chunks::<WORD>();
        let (gy, _) = self.gy[v % 2].as_chunks::<WORD>();
        let (low, high) = (lanes.splat(limits.0), lanes.splat(limits.1));
        let words = weak.iter_mut().zip(strong);
        for (w, ((weak, strong), (gx, gy))) in words.zip(gx.iter().zip(gy)).enumerate() {
            let at = MARGIN - 1 + w * WORD;
            let rows = [wide(above, at), wide(here, at), wide(below, at)];
            (*weak, *strong) = ridge_word(lanes, rows, gx, gy, low, high);
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Registers;

    /// Whatever registers the machine has must find the same bits.
    #[test]
    fn every_way_finds_the_same() {
        let mut state = 1_u64;
        let mut random = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        for (width, height) in [(1, 1), (7, 3), (64, 5), (65, 9), (127, 20), (200, 33)] {
            for contrast in [2, 30, 256] {
                let image = GrayImage::from_fn(width, height, |_, _| {
                    image::Luma([((random() >> 20) % contrast) as u8])
                });
                for limits in [(-1, 0), (20, 60), (300, 900)] {
                    same::<i16>(&image, limits);
                    same::<i32>(&image, (limits.0 * 100, limits.1 * 100));
                }
            }
        }
    }

    fn same<T: Width>(image: &GrayImage, limits: (i32, i32)) {
        let bits = |registers| {
            let (mut weak, mut strong) = (Bits::default(), Bits::default());
            for bits in [&mut weak, &mut strong] {
                bits.resize(image.width() as usize, image.height() as usize);
            }
            let task = Ridges {
                image,
                rows: 0..image.height() as usize,
                limits,
                buffers: &mut Rows::default(),
                weak: &mut weak,
                strong: &mut strong,
            };
            T::run_on(registers, task);
            [weak, strong].map(|bits| bits.words().to_vec())
        };
        let plain = bits(Registers::Plain);
        for registers in Registers::all() {
            assert_eq!(bits(registers), plain, "{registers:?}");
        }
    }
}
