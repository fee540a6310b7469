//! Weak pixels that strong ones lead to, 64 pixels a word and eight words at a time.

use crate::bits::{BLOCK, Bits};

/// A block and a word on either side.
const WIDE: usize = BLOCK + 2;

/// Places of words that two sweeps leave open, each once; room for all words is made at once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Open {
    places: Vec<usize>,
    waiting: Vec<bool>,
}

impl Open {
    fn clear(&mut self, words: usize) {
        self.places.clear();
        self.places.reserve(words);
        self.waiting.clear();
        self.waiting.resize(words, false);
    }

    #[inline(always)]
    fn push(&mut self, place: usize) {
        if !self.waiting[place] {
            self.waiting[place] = true;
            self.places.push(place);
        }
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<usize> {
        let place = self.places.pop()?;
        self.waiting[place] = false;
        Some(place)
    }

    #[cfg(test)]
    pub(crate) fn buffers(&self) -> [(usize, usize); 2] {
        [
            (self.places.as_ptr().addr(), self.places.capacity()),
            (self.waiting.as_ptr().addr(), self.waiting.capacity()),
        ]
    }
}

/// Every pixel of `weak` that a chain of neighbours (eight a pixel) within `weak` joins to a pixel of
/// `found`, which is a part of `weak` and of its size.
pub(crate) fn follow(weak: &Bits, found: &mut Bits, open: &mut Open) {
    pulp::Arch::new().dispatch(Follow { weak, found, open });
}

struct Follow<'a> {
    weak: &'a Bits,
    found: &'a mut Bits,
    open: &'a mut Open,
}

impl pulp::NullaryFnOnce for Follow<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let height = self.weak.height();
        let (stride, start) = (self.weak.stride(), self.weak.start(0));
        let (weak, found) = (self.weak.words(), self.found.words_mut());
        for v in 0..height {
            sweep(
                weak,
                found,
                start + v * stride,
                start + v * stride - stride,
                stride,
            );
        }
        for v in (0..height).rev() {
            sweep(
                weak,
                found,
                start + v * stride,
                start + v * stride + stride,
                stride,
            );
        }
        self.open.clear(weak.len());
        for block in (start..start + height * stride).step_by(BLOCK) {
            leftover(weak, found, block, stride, self.open);
        }
        rest(weak, found, stride, self.open);
    }
}

/// Row `at` gets what the row at `beside` leads to, and what that leads to along the row within a word, or
/// to the next word.
#[inline(always)]
fn sweep(weak: &[u64], found: &mut [u64], at: usize, beside: usize, stride: usize) {
    for block in (0..stride).step_by(BLOCK) {
        let Some(weak) = weak[at + block..].first_chunk::<BLOCK>() else {
            return;
        };
        let reached = reached(window(found, beside + block), window(found, at + block));
        let Some(here) = found[at + block..].first_chunk_mut::<BLOCK>() else {
            return;
        };
        let mut new = 0;
        for i in 0..BLOCK {
            new |= reached[i] & weak[i] & !here[i];
        }
        if new != 0 {
            for i in 0..BLOCK {
                here[i] = fill(weak[i], here[i] | reached[i] & weak[i]);
            }
        }
    }
}

/// Pushes the places of a block's words that are not finished.
#[inline(always)]
fn leftover(weak: &[u64], found: &[u64], at: usize, stride: usize, places: &mut Open) {
    let here = window(found, at);
    let mut open = [0; BLOCK];
    let mut any = 0;
    let Some(weak) = weak[at..].first_chunk::<BLOCK>() else {
        return;
    };
    for i in 0..BLOCK {
        open[i] = weak[i] & !here[i + 1];
        any |= open[i];
    }
    if any == 0 {
        return;
    }
    let above = reached(window(found, at - stride), here);
    let below = reached(window(found, at + stride), here);
    any = 0;
    for i in 0..BLOCK {
        open[i] &= above[i] | below[i];
        any |= open[i];
    }
    if any != 0 {
        for (i, open) in open.into_iter().enumerate() {
            if open != 0 {
                places.push(at + i);
            }
        }
    }
}

/// Word by word until nothing changes: each change adds a pixel, so that the time is bounded by their number.
#[inline(always)]
fn rest(weak: &[u64], found: &mut [u64], stride: usize, open: &mut Open) {
    while let Some(at) = open.pop() {
        let mut reached = 0;
        for row in [at - stride, at, at + stride] {
            reached |= beside(found[row - 1], found[row], found[row + 1]);
        }
        let new = fill(weak[at], found[at] | reached & weak[at]) & !found[at];
        found[at] |= new;
        // what the new pixels touch
        for row in [at - stride, at, at + stride] {
            for (place, touched) in [
                (row - 1, new << 63),
                (row, beside(0, new, 0)),
                (row + 1, new >> 63),
            ] {
                if touched & weak[place] & !found[place] != 0 {
                    open.push(place);
                }
            }
        }
    }
}

#[inline(always)]
fn window(words: &[u64], at: usize) -> &[u64; WIDE] {
    words[at - 1..]
        .first_chunk()
        .expect("there is room about the picture")
}

/// What the pixels of a row and of the row beside it lead to in one step.
#[inline(always)]
fn reached(row: &[u64; WIDE], own: &[u64; WIDE]) -> [u64; BLOCK] {
    let mut reached = [0; BLOCK];
    for i in 0..BLOCK {
        let from_beside = beside(row[i], row[i + 1], row[i + 2]);
        reached[i] = from_beside | beside(own[i], own[i + 1], own[i + 2]);
    }
    reached
}

/// A word's pixels and their neighbours in the row.
#[inline(always)]
fn beside(left: u64, here: u64, right: u64) -> u64 {
    here | here << 1 | here >> 1 | left >> 63 | right << 63
}

/// Whole runs of `weak` that hold a bit of `seeds`, which is a part of it.
#[inline(always)]
fn fill(weak: u64, seeds: u64) -> u64 {
    // upwards the carry of an addition runs through, downwards the reach is doubled
    let mut found = (weak.wrapping_add(seeds) ^ weak) & weak | seeds;
    let mut free = weak;
    for shift in [1, 2, 4, 8, 16, 32] {
        found |= found >> shift & free;
        free &= free >> shift;
    }
    found
}
