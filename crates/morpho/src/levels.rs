//! Windows of any width, through memory: from the meets over 2^j columns follow those over 2^(j+1).

use crate::BitImage;
use crate::element::ElementRun;
use crate::window::Lattice;

/// Some rows, and their meets over powers of two of columns. Between rows lies a margin of outside,
/// no narrower than the windows reach: right of one row and left of the next, so that all rows
/// pass as one.
pub(crate) struct Levels<'a> {
    words: &'a mut [u64],
    /// Words a level.
    length: usize,
    margin: usize,
    /// Words from row to row.
    pub(crate) pitch: usize,
    stride: usize,
    seal: u64,
}

impl<'a> Levels<'a> {
    /// Room for `rows` rows.
    #[inline(always)]
    pub(crate) fn new(
        words: &'a mut Vec<u64>,
        image: &BitImage,
        outside: u64,
        runs: &[ElementRun],
        rows: usize,
    ) -> Self {
        let margin = margin(runs);
        let pitch = image.stride() + margin;
        let length = rows * pitch + 3 * margin + 2;
        let depth = runs.iter().map(ElementRun::power).max().unwrap_or(0) as usize + 1;
        words.clear();
        words.resize(length * depth, outside);
        Self {
            words,
            length,
            margin,
            pitch,
            stride: image.stride(),
            seal: outside & !image.tail_mask(),
        }
    }

    /// Puts a row in its place.
    #[inline(always)]
    pub(crate) fn load(&mut self, place: usize, row: &[u64]) {
        let words = &mut self.words[self.margin + place * self.pitch..][..self.stride];
        words.copy_from_slice(row);
        words[row.len() - 1] |= self.seal;
    }

    /// Works out the levels of the first `rows` rows, up to 2^`power` columns.
    #[inline(always)]
    pub(crate) fn raise<L: Lattice>(&mut self, power: u32, rows: usize) {
        let span = self.margin + rows * self.pitch;
        for level in 1..=power as usize {
            let (below, this) = self.words.split_at_mut(level * self.length);
            let below = &below[(level - 1) * self.length..];
            let shift = 1usize << (level - 1);
            let (skip, bit) = (shift / 64, (shift % 64) as u32);
            let next = View {
                near: &below[skip..],
                far: &below[skip + 1..],
                bit,
            };
            let words = below.iter().zip(next.near).zip(next.far);
            for (out, ((&word, &near), &far)) in this[..span].iter_mut().zip(words) {
                *out = L::meet(word, near >> bit | (far << 1) << (63 - bit));
            }
        }
    }

    /// The meets over the columns `dx0..=dx1` of a run for rows of `out`, [`Self::pitch`] apart.
    #[inline(always)]
    pub(crate) fn window<L: Lattice>(&self, run: &ElementRun, out: &mut [u64]) {
        let power = run.power();
        let level = &self.words[power as usize * self.length..][..self.length];
        let left = self.view(level, run.dx0);
        let right = self.view(level, run.dx1 + 1 - (1 << power));
        let (bl, br) = (left.bit, right.bit);
        let both = left
            .near
            .iter()
            .zip(left.far)
            .zip(right.near)
            .zip(right.far);
        for (out, (((&a, &b), &c), &d)) in out.iter_mut().zip(both) {
            *out = L::meet(
                a >> bl | (b << 1) << (63 - bl),
                c >> br | (d << 1) << (63 - br),
            );
        }
    }

    /// A level from column `dx` of the first row on.
    #[inline(always)]
    fn view<'b>(&self, level: &'b [u64], dx: isize) -> View<'b> {
        let at = (self.margin * 64).wrapping_add_signed(dx);
        View {
            near: &level[at / 64..],
            far: &level[at / 64 + 1..],
            bit: (at % 64) as u32,
        }
    }
}

/// The words that windows reach to the sides.
pub(crate) fn margin(runs: &[ElementRun]) -> usize {
    let reach = |run: &ElementRun| run.dx0.unsigned_abs().max(run.dx1.unsigned_abs());
    runs.iter()
        .map(reach)
        .max()
        .unwrap_or(0)
        .div_ceil(64)
        .max(1)
}

/// Words from a column that need not be the first of a word.
struct View<'a> {
    near: &'a [u64],
    far: &'a [u64],
    bit: u32,
}
