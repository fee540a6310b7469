//! What is kept of a frame to compare later ones with.

use image::GrayImage;

/// A frame, smoothed, with how much each pixel's neighbourhood differs.
#[derive(Debug, Default)]
pub(super) struct Memory {
    width: usize,
    height: usize,
    pub(super) smooth: Vec<u8>,
    /// The greatest less the least value of 3 x 3 pixels.
    pub(super) slope: Vec<u8>,
}

/// Buffers that filters use in between.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    rows: Vec<u8>,
    least: Vec<u8>,
}

impl Memory {
    pub(super) fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The smooth value at a place inside the picture.
    pub(super) fn between(&self, [u, v]: [f64; 2]) -> f64 {
        let (left, upper) = (u as usize, v as usize);
        let (a, b) = (u - left as f64, v - upper as f64);
        let right = (left + 1).min(self.width - 1);
        let [top, bottom] = [upper, (upper + 1).min(self.height - 1)].map(|v| {
            let row = &self.smooth[v * self.width..];
            f64::from(row[left]) * (1.0 - a) + f64::from(row[right]) * a
        });
        top * (1.0 - b) + bottom * b
    }

    pub(super) fn take(&mut self, frame: &GrayImage, scratch: &mut Scratch) {
        (self.width, self.height) = (frame.width() as usize, frame.height() as usize);
        let weighted =
            |a: u8, b: u8, c: u8| ((u16::from(a) + 2 * u16::from(b) + u16::from(c) + 2) / 4) as u8;
        let w = self.width;
        let Scratch { rows, least } = scratch;
        separable(frame.as_raw(), w, rows, &mut self.smooth, weighted);
        separable(&self.smooth, w, rows, least, |a, b, c| a.min(b).min(c));
        separable(&self.smooth, w, rows, &mut self.slope, |a, b, c| {
            a.max(b).max(c)
        });
        for (most, least) in self.slope.iter_mut().zip(least) {
            *most -= *least;
        }
    }
}

/// A 3 x 3 filter as two of three, borders replicated.
fn separable(
    from: &[u8],
    w: usize,
    rows: &mut Vec<u8>,
    into: &mut Vec<u8>,
    of: impl Fn(u8, u8, u8) -> u8,
) {
    rows.resize(from.len(), 0);
    into.resize(from.len(), 0);
    if w == 0 {
        return;
    }
    let h = from.len() / w;
    for v in 0..h {
        let [a, b, c] = [v.saturating_sub(1), v, (v + 1).min(h - 1)].map(|v| &from[v * w..][..w]);
        for (out, ((&a, &b), &c)) in rows[v * w..][..w].iter_mut().zip(a.iter().zip(b).zip(c)) {
            *out = of(a, b, c);
        }
    }
    for (row, out) in rows.chunks_exact(w).zip(into.chunks_exact_mut(w)) {
        for u in 0..w {
            out[u] = of(row[u.saturating_sub(1)], row[u], row[(u + 1).min(w - 1)]);
        }
    }
}
