//! Which pixels of the floor do not show what they showed in the last frame.

use image::GrayImage;

use super::ObstacleParams;
use super::fan::Fan;
use super::shift::shift;
use crate::floor_view::times;

/// How far an edge may be off, as a share of the change over two pixels around it: 0.4 is 0.8 px.
const MISPLACED: f64 = 0.4;

/// A frame, smoothed, with the least and the greatest value of each pixel's neighbourhood.
#[derive(Debug, Default)]
pub(super) struct Memory {
    width: usize,
    height: usize,
    pub(super) smooth: Vec<u8>,
    least: Vec<u8>,
    most: Vec<u8>,
    row: Vec<u8>,
}

impl Memory {
    pub(super) fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The value at a place between pixels.
    fn between(&self, [u, v]: [usize; 2], [a, b]: [f64; 2]) -> f64 {
        let right = (u + 1).min(self.width - 1);
        let [top, bottom] = [v, (v + 1).min(self.height - 1)].map(|v| {
            let row = &self.smooth[v * self.width..];
            f64::from(row[u]) * (1.0 - a) + f64::from(row[right]) * a
        });
        top * (1.0 - b) + bottom * b
    }

    pub(super) fn take(&mut self, frame: &GrayImage) {
        (self.width, self.height) = (frame.width() as usize, frame.height() as usize);
        let (w, h) = (self.width, self.height);
        let raw = frame.as_raw();
        let weighted =
            |a: u8, b: u8, c: u8| ((u16::from(a) + 2 * u16::from(b) + u16::from(c) + 2) / 4) as u8;
        for buffer in [&mut self.smooth, &mut self.least, &mut self.most] {
            buffer.resize(w * h, 0);
        }
        separable(raw, w, h, &mut self.row, &mut self.smooth, weighted);
        let smooth = std::mem::take(&mut self.smooth);
        separable(&smooth, w, h, &mut self.row, &mut self.least, |a, b, c| {
            a.min(b).min(c)
        });
        separable(&smooth, w, h, &mut self.row, &mut self.most, |a, b, c| {
            a.max(b).max(c)
        });
        self.smooth = smooth;
    }
}

/// A 3 x 3 filter as two of three, borders replicated.
fn separable(
    from: &[u8],
    w: usize,
    h: usize,
    between: &mut Vec<u8>,
    into: &mut [u8],
    of: impl Fn(u8, u8, u8) -> u8,
) {
    between.resize(w * h, 0);
    if w == 0 {
        return;
    }
    for v in 0..h {
        let [a, b, c] = [v.saturating_sub(1), v, (v + 1).min(h - 1)].map(|v| &from[v * w..][..w]);
        let rows = a.iter().zip(b).zip(c);
        for (out, ((&a, &b), &c)) in between[v * w..][..w].iter_mut().zip(rows) {
            *out = of(a, b, c);
        }
    }
    for (row, out) in between.chunks_exact(w).zip(into.chunks_exact_mut(w)) {
        for u in 0..w {
            out[u] = of(row[u.saturating_sub(1)], row[u], row[(u + 1).min(w - 1)]);
        }
    }
}

/// Marks the pixels of `current` that have changed, alone-standing thin lines apart. Above the farthest
/// floor and outside the last frame nothing is marked.
pub(super) fn change(
    current: &Memory,
    previous: &Memory,
    warp: &[[f64; 3]; 3],
    fan: &Fan,
    params: &ObstacleParams,
    raw: &mut Vec<bool>,
    changed: &mut Vec<bool>,
) {
    let [w, h] = current.size();
    changed.clear();
    changed.resize(w * h, false);
    if w < 3 || h < 3 {
        return;
    }
    let shift = shift(current, previous, warp, fan);
    let slack = params.least_change.max(5.0 * shift.noise);
    raw.clear();
    raw.resize(w * h, false);
    for v in 0..h {
        for u in 0..w {
            if fan.range[v * w + u].is_infinite() {
                continue;
            }
            let pixel = [u as f64, v as f64];
            let [x, y, z] = times(warp, [pixel[0], pixel[1], 1.0]);
            let (pu, pv) = (x / z + shift.by[0], y / z + shift.by[1]);
            if !(pu >= 0.0 && pv >= 0.0 && pu <= (w - 1) as f64 && pv <= (h - 1) as f64) {
                continue;
            }
            let (uf, vf) = (pu as usize, pv as usize);
            let at = (pv + 0.5) as usize * w + (pu + 0.5) as usize;
            let value = f64::from(current.smooth[v * w + u]) - shift.brighter;
            let then = previous.between([uf, vf], [pu - uf as f64, pv - vf as f64]);
            let slope = f64::from(previous.most[at]) - f64::from(previous.least[at]);
            raw[v * w + u] = (value - then).abs() > slack + MISPLACED * slope;
        }
    }
    open(raw, w, h, changed);
}

/// Keeps what a full block of 5 x 2 or of 2 x 5 pixels covers: strips, but no specks.
fn open(raw: &[bool], w: usize, h: usize, into: &mut [bool]) {
    for [bw, bh] in [[5, 2], [2, 5]] {
        for v in 0..(h + 1).saturating_sub(bh) {
            for u in 0..(w + 1).saturating_sub(bw) {
                if (v..v + bh).all(|v| raw[v * w + u..][..bw].iter().all(|&c| c)) {
                    for v in v..v + bh {
                        into[v * w + u..][..bw].fill(true);
                    }
                }
            }
        }
    }
}
