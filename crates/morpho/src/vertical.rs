//! The vertical half of a rectangle: rows that meet.

use crate::BitImage;
use crate::window::{Lattice, meet_into};

/// Windows up to this many rows meet directly.
const FEW_ROWS: usize = 3;

/// Some words of a row, as one register holds them.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Strip([u64; 8]);

/// The meets of the rows `y + first .. y + first + count` of an image, for its rows y.
pub(crate) struct Vertical<'a> {
    image: &'a BitImage,
    outside: u64,
    first: isize,
    count: usize,
    suffixes: &'a mut Vec<Strip>,
}

impl<'a> Vertical<'a> {
    pub(crate) fn new(
        image: &'a BitImage,
        outside: u64,
        first: isize,
        count: usize,
        suffixes: &'a mut Vec<Strip>,
    ) -> Self {
        suffixes.clear();
        if count > FEW_ROWS {
            suffixes.resize(count, Strip([0; 8]));
        }
        Self {
            image,
            outside,
            first,
            count,
            suffixes,
        }
    }

    /// As many rows as are best made at a time, `about` so many.
    pub(crate) fn band_rows(&self, about: usize) -> usize {
        let block = self.suffixes.len().max(1);
        (about / block).max(1) * block
    }

    /// The meets for rows of the result from `top` on.
    #[inline(always)]
    pub(crate) fn meets<L: Lattice>(&mut self, top: usize, out: &mut [u64]) {
        let stride = self.image.stride();
        if self.count > FEW_ROWS {
            let blocks = out.chunks_mut(self.count * stride);
            for (y, block) in (top..).step_by(self.count).zip(blocks) {
                self.block::<L>(y, block);
            }
        } else if self.sees_inside(top, top + out.len() / stride) {
            self.direct::<L>(top, out);
        } else {
            for (y, row) in (top..).zip(out.chunks_exact_mut(stride)) {
                if self.sees_inside(y, y + 1) {
                    self.direct::<L>(y, row);
                } else {
                    self.at_the_edge::<L>(y, row);
                }
            }
        }
    }

    /// Whether the windows of the rows `top .. bottom` lie inside the image.
    #[inline(always)]
    fn sees_inside(&self, top: usize, bottom: usize) -> bool {
        let last = bottom.cast_signed() - 1 + self.first + self.count.cast_signed();
        top.cast_signed() + self.first >= 0 && last <= self.image.height().cast_signed()
    }

    /// The meets of up to three rows, for the result's rows from `top` on.
    #[inline(always)]
    fn direct<L: Lattice>(&self, top: usize, rows: &mut [u64]) {
        let stride = self.image.stride();
        let start = top.wrapping_add_signed(self.first) * stride;
        // a row that meets itself stays as it is
        let [a, b, c] =
            [0, 1, 2].map(|i| &self.image.words()[start + i.min(self.count - 1) * stride..]);
        for (out, ((&a, &b), &c)) in rows.iter_mut().zip(a.iter().zip(b).zip(c)) {
            *out = L::meet(L::meet(a, b), c);
        }
    }

    /// The meet of the rows of a window that the image's edge cuts.
    #[inline(always)]
    fn at_the_edge<L: Lattice>(&self, y: usize, out: &mut [u64]) {
        if self.outside != L::NEUTRAL {
            return out.fill(self.outside);
        }
        out.fill(L::NEUTRAL);
        let start = y.cast_signed() + self.first;
        for y in start..start + self.count.cast_signed() {
            if (0..self.image.height().cast_signed()).contains(&y) {
                meet_into::<L>(out, self.image.row(y.cast_unsigned()));
            }
        }
    }

    /// Up to `count` rows of the result from row `y` on.
    #[inline(always)]
    fn block<L: Lattice>(&mut self, y: usize, out: &mut [u64]) {
        let stride = self.image.stride();
        let whole = stride - stride % 8;
        for x in (0..whole).step_by(8) {
            self.columns::<L, 8>(y, x, out);
        }
        let mut x = whole;
        if stride - x >= 4 {
            self.columns::<L, 4>(y, x, out);
            x += 4;
        }
        for x in x..stride {
            self.columns::<L, 1>(y, x, out);
        }
        if self.outside != L::NEUTRAL {
            for (y, row) in (y..).zip(out.chunks_exact_mut(stride)) {
                if !self.sees_inside(y, y + 1) {
                    row.fill(self.outside);
                }
            }
        }
    }

    /// The words `x .. x + W` of up to `count` rows of the result: the meets of the last rows of the
    /// first row's window, and those of the rows that follow it.
    #[inline(always)]
    fn columns<L: Lattice, const W: usize>(&mut self, y: usize, x: usize, out: &mut [u64]) {
        let stride = self.image.stride();
        let (height, words) = (self.image.height(), self.image.words());
        let meet_row = |met: &mut [u64; W], y: isize| {
            // rows above the image become very large
            let y = y.cast_unsigned();
            if y < height {
                meet_into::<L>(met, &words[y * stride + x..][..W]);
            }
        };
        let start = y.cast_signed() + self.first;
        let suffixes = self.suffixes.as_mut_slice();
        let count = suffixes.len();
        let mut met = [L::NEUTRAL; W];
        for i in (0..count).rev() {
            meet_row(&mut met, start + i.cast_signed());
            suffixes[i].0[..W].copy_from_slice(&met);
        }
        let mut met = [L::NEUTRAL; W];
        for i in 0..count.min(out.len() / stride) {
            let mut both = met;
            meet_into::<L>(&mut both, &suffixes[i].0[..W]);
            out[i * stride + x..][..W].copy_from_slice(&both);
            meet_row(&mut met, start + (count + i).cast_signed());
        }
    }
}
