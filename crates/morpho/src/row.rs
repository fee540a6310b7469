//! A row through a horizontal window of up to 63 columns, in one pass: a word of the result follows
//! from three words of the row.

use crate::window::Lattice;

/// A horizontal window of less than 64 columns, as two windows of 2^power columns that both begin
/// at or left of the anchor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Narrow {
    pub(crate) power: usize,
    /// Columns from the beginning of the first to the anchor, 0 to 63.
    first: u32,
    /// The same of the second.
    second: u32,
}

impl Narrow {
    /// The window of the columns `dx0..=dx1`, if it suits.
    pub(crate) fn new(dx0: isize, dx1: isize) -> Option<Self> {
        let columns = dx1 - dx0 + 1;
        let power = columns.ilog2();
        let (first, second) = (-dx0, (1 << power) - 1 - dx1);
        let suits = columns < 64 && (0..64).contains(&first) && (0..64).contains(&second);
        suits.then_some(Self {
            power: power as usize,
            first: first as u32,
            second: second as u32,
        })
    }
}

/// Writes the meets over the window into `out`. `row` has one word more than `out` before and one
/// behind; `POWER` is the window's.
#[inline(always)]
pub(crate) fn filter<L: Lattice, const POWER: usize>(row: &[u64], window: Narrow, out: &mut [u64]) {
    let (left, middle, right) = (row, &row[1..], &row[2..]);
    let words = left.iter().zip(middle).zip(right);
    if POWER == 1 && (window.first, window.second) == (1, 0) {
        // three columns: fewer shifts than the general way
        for (out, ((&a, &b), &c)) in out.iter_mut().zip(words) {
            *out = L::meet(b, L::meet(b << 1 | a >> 63, b >> 1 | c << 63));
        }
    } else if window.second == 0 {
        for (out, ((&a, &b), &c)) in out.iter_mut().zip(words) {
            let [a, b] = raise::<L, POWER>([a, b, c]);
            *out = L::meet(push(a, b, window.first), b);
        }
    } else {
        for (out, ((&a, &b), &c)) in out.iter_mut().zip(words) {
            *out = word::<L, POWER>([a, b, c], window);
        }
    }
}

/// The meets over the window for the pixels of the middle one of three words.
#[inline(always)]
pub(crate) fn word<L: Lattice, const POWER: usize>(words: [u64; 3], window: Narrow) -> u64 {
    let [a, b] = raise::<L, POWER>(words);
    L::meet(push(a, b, window.first), push(a, b, window.second))
}

/// The meets over 2^POWER columns to the right, in the first two of three words.
#[inline(always)]
fn raise<L: Lattice, const POWER: usize>([mut a, mut b, mut c]: [u64; 3]) -> [u64; 2] {
    for power in 0..POWER {
        let shift = 1 << power;
        a = L::meet(a, a >> shift | b << (64 - shift));
        b = L::meet(b, b >> shift | c << (64 - shift));
        // only the low bits are still wanted, and those come out right
        c = L::meet(c, c >> shift);
    }
    [a, b]
}

/// The second of two words, shifted by 0 to 63 to higher columns.
#[inline(always)]
fn push(a: u64, b: u64, by: u32) -> u64 {
    b << by | (a >> 1) >> (63 - by)
}
