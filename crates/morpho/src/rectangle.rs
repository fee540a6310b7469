//! Rectangles: rows meet first, then columns, some rows at a time so that they stay in the cache.

use crate::BitImage;
use crate::element::ElementRun;
use crate::levels::Levels;
use crate::row::{self, Narrow};
use crate::window::{Buffers, Lattice, meet_into};

/// All runs have the same columns, and their rows follow one another.
#[inline(always)]
pub(crate) fn rectangle<L: Lattice>(
    image: &BitImage,
    outside: u64,
    buffers: &mut Buffers,
    out: &mut BitImage,
) {
    let Buffers {
        levels,
        block,
        band,
        runs,
    } = buffers;
    let run = runs[0];
    let rows = Rows::new(image, outside, run.dy, runs.len(), block);
    let Some(window) = Narrow::new(run.dx0, run.dx1) else {
        let levels = Levels::new(levels, image, outside, &runs[..1], rows.band_rows());
        return rows.filter::<L>(&mut Wide { levels, run, band }, out);
    };
    match window.power {
        0 => rows.filter::<L>(&mut OnePass::<0> { window, outside }, out),
        1 => rows.filter::<L>(&mut OnePass::<1> { window, outside }, out),
        2 => rows.filter::<L>(&mut OnePass::<2> { window, outside }, out),
        3 => rows.filter::<L>(&mut OnePass::<3> { window, outside }, out),
        4 => rows.filter::<L>(&mut OnePass::<4> { window, outside }, out),
        _ => rows.filter::<L>(&mut OnePass::<5> { window, outside }, out),
    }
}

/// What rows go through.
trait Horizontal {
    /// Some rows of `stride` words, one after the other, with one word before and one behind.
    fn filter<L: Lattice>(&mut self, rows: &[u64], stride: usize, out: &mut [u64]);
}

/// A narrow window, whose power is known.
struct OnePass<const POWER: usize> {
    window: Narrow,
    outside: u64,
}

impl<const POWER: usize> Horizontal for OnePass<POWER> {
    #[inline(always)]
    fn filter<L: Lattice>(&mut self, rows: &[u64], stride: usize, out: &mut [u64]) {
        row::filter::<L, POWER>(rows, self.window, out);
        // the words at a row's ends saw the rows above and below instead of the outside
        for first in (0..out.len()).step_by(stride) {
            let last = first + stride - 1;
            for at in [first, last] {
                let left = if at == first { self.outside } else { rows[at] };
                let right = if at == last {
                    self.outside
                } else {
                    rows[at + 2]
                };
                out[at] = row::word::<L, POWER>([left, rows[at + 1], right], self.window);
            }
        }
    }
}

/// Any window.
struct Wide<'a> {
    levels: Levels<'a>,
    run: ElementRun,
    band: &'a mut Vec<u64>,
}

impl Horizontal for Wide<'_> {
    #[inline(always)]
    fn filter<L: Lattice>(&mut self, rows: &[u64], stride: usize, out: &mut [u64]) {
        let count = out.len() / stride;
        for (place, row) in rows[1..=out.len()].chunks_exact(stride).enumerate() {
            self.levels.load(place, row);
        }
        self.levels.raise::<L>(self.run.power(), count);
        self.band.resize(count * self.levels.pitch, 0);
        self.levels.window::<L>(&self.run, self.band);
        let windows = self.band.chunks_exact(self.levels.pitch);
        for (out, row) in out.chunks_exact_mut(stride).zip(windows) {
            out.copy_from_slice(&row[..stride]);
        }
    }
}

/// The meets of the rows `y + first .. y + first + count`, for y from 0 upwards.
struct Rows<'a> {
    image: &'a BitImage,
    outside: u64,
    first: isize,
    count: usize,
    block: &'a mut Vec<u64>,
}

/// Windows up to this many rows meet directly.
const FEW_ROWS: usize = 3;

/// Words that go through the window at a time: few enough to stay in the nearest cache.
pub(crate) const BAND_WORDS: usize = 1024;

impl<'a> Rows<'a> {
    fn new(
        image: &'a BitImage,
        outside: u64,
        first: isize,
        count: usize,
        block: &'a mut Vec<u64>,
    ) -> Self {
        Self {
            image,
            outside,
            first,
            count,
            block,
        }
    }

    /// A row of the image; `None` outside.
    #[inline(always)]
    fn row(&self, y: isize) -> Option<&'a [u64]> {
        (0..self.image.height().cast_signed())
            .contains(&y)
            .then(|| self.image.row(y.cast_unsigned()))
    }

    /// Rows that pass at a time.
    fn band_rows(&self) -> usize {
        (BAND_WORDS / self.image.stride()).clamp(1, self.image.height())
    }

    /// The meets through `horizontal` into `out`, some rows at a time.
    #[inline(always)]
    fn filter<L: Lattice>(self, horizontal: &mut impl Horizontal, out: &mut BitImage) {
        let stride = self.image.stride();
        let tail = self.image.tail_mask();
        let band_rows = self.band_rows();
        let mut block = std::mem::take(self.block);
        block.clear();
        block.resize((self.count + 1 + band_rows) * stride + 2, L::NEUTRAL);
        let (van_herk, band) = block.split_at_mut((self.count + 1) * stride);
        for (band_at, out) in out.words_mut().chunks_mut(band_rows * stride).enumerate() {
            let top = band_at * band_rows;
            let band = &mut band[..out.len() + 2];
            let rows = &mut band[1..=out.len()];
            if self.count > FEW_ROWS {
                for (y, row) in (top..).zip(rows.chunks_exact_mut(stride)) {
                    self.split::<L>(y, van_herk, row);
                }
            } else if self.sees_inside(top, top + out.len() / stride) {
                self.direct::<L>(top, rows);
            } else {
                for (y, row) in (top..).zip(rows.chunks_exact_mut(stride)) {
                    if self.sees_inside(y, y + 1) {
                        self.direct::<L>(y, row);
                    } else {
                        self.at_the_edge::<L>(y, row);
                    }
                }
            }
            if self.outside & !tail != 0 {
                for row in rows.chunks_exact_mut(stride) {
                    row[stride - 1] |= !tail;
                }
            }
            horizontal.filter::<L>(band, stride, out);
            if tail != u64::MAX {
                for row in out.chunks_exact_mut(stride) {
                    row[stride - 1] &= tail;
                }
            }
        }
        *self.block = block;
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
        for row in (start..start + self.count.cast_signed()).filter_map(|y| self.row(y)) {
            meet_into::<L>(out, row);
        }
    }

    /// The meet of any number of rows: the suffix of the block of rows that the window starts in
    /// and the prefix of the one it ends in. `van_herk` keeps both from row to row.
    #[inline(always)]
    fn split<L: Lattice>(&self, y: usize, van_herk: &mut [u64], out: &mut [u64]) {
        let stride = self.image.stride();
        let (prefix, suffixes) = van_herk.split_at_mut(stride);
        let start = y.cast_signed() + self.first;
        let place = y % self.count;
        if place == 0 {
            self.suffixes::<L>(start, suffixes);
            prefix.fill(L::NEUTRAL);
        } else if let Some(added) = self.row(start + self.count.cast_signed() - 1) {
            meet_into::<L>(prefix, added);
        }
        if self.sees_inside(y, y + 1) || self.outside == L::NEUTRAL {
            let suffix = &suffixes[place * stride..][..stride];
            for (out, (&a, &b)) in out.iter_mut().zip(prefix.iter().zip(suffix)) {
                *out = L::meet(a, b);
            }
        } else {
            out.fill(self.outside);
        }
    }

    /// The meets of the last 1, 2, 3 .. of the rows `start .. start + count`, the longest first.
    #[inline(always)]
    fn suffixes<L: Lattice>(&self, start: isize, suffixes: &mut [u64]) {
        let stride = self.image.stride();
        for i in (0..self.count).rev() {
            let (these, later) = suffixes.split_at_mut((i + 1) * stride);
            let suffix = &mut these[i * stride..];
            match self.row(start + i.cast_signed()) {
                Some(row) => suffix.copy_from_slice(row),
                None => suffix.fill(L::NEUTRAL),
            }
            if i + 1 < self.count {
                meet_into::<L>(suffix, &later[..stride]);
            }
        }
    }
}
