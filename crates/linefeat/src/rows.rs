//! Sobel gradients and their magnitudes, row after row through buffers that stay in the nearest cache.

use std::ops::Range;

use crate::lanes::{Lanes, Width};

/// Pixels a word.
pub(crate) const WORD: usize = 64;
/// A word's pixels and one more on either side.
pub(crate) const WIDE: usize = WORD + 2;
/// Places before the first pixel of a row, so that neighbours to the left need no special case.
pub(crate) const MARGIN: usize = 32;

/// The rows at work: row v is kept at v modulo the number of rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows<T> {
    pub(crate) bytes: [Vec<u8>; 3],
    pub(crate) gx: [Vec<T>; 2],
    pub(crate) gy: [Vec<T>; 2],
    pub(crate) magnitude: [Vec<T>; 3],
}

impl<T: Width> Rows<T> {
    pub(crate) fn resize(&mut self, width: usize) {
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

    /// The magnitudes of some pixels of row `v`.
    pub(crate) fn magnitudes(&self, v: usize, columns: Range<u32>) -> &[T] {
        &self.magnitude[v % 3][MARGIN..][columns.start as usize..columns.end as usize]
    }

    /// Row `v`, its first and last pixel once more.
    #[inline(always)]
    pub(crate) fn read(&mut self, v: usize, pixels: &[u8]) {
        let row = &mut self.bytes[v % 3];
        row[MARGIN..][..pixels.len()].copy_from_slice(pixels);
        row[MARGIN - 1] = pixels[0];
        row[MARGIN + pixels.len()] = pixels[pixels.len() - 1];
    }

    /// The gradients and magnitudes of row `v`; the pixels of the rows above, at and below it are there.
    #[inline(always)]
    pub(crate) fn gradient<L: Lanes<Value = T>>(
        &mut self,
        lanes: L,
        v: usize,
        width: usize,
        height: usize,
    ) {
        let above = &self.bytes[v.saturating_sub(1) % 3];
        let here = &self.bytes[v % 3];
        let below = &self.bytes[(v + 1).min(height - 1) % 3];
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
}

#[inline(always)]
pub(crate) fn wide<T>(row: &[T], at: usize) -> &[T; WIDE] {
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

#[cfg(test)]
impl<T> Rows<T> {
    /// Where the buffers are and how large.
    pub(crate) fn buffers(&self) -> Vec<(usize, usize)> {
        let values = self.gx.iter().chain(&self.gy).chain(&self.magnitude);
        let mut all: Vec<_> = values
            .map(|row| (row.as_ptr().addr(), row.capacity()))
            .chain(
                self.bytes
                    .iter()
                    .map(|row| (row.as_ptr().addr(), row.capacity())),
            )
            .collect();
        // rows may change places
        all.sort_unstable();
        all
    }
}
