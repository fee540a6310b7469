//! The two classic parallel thinnings, 64 pixels a word.
//!
//! A pass reads the old image only, so its deletions are gathered first and made afterwards. A tile
//! need not be visited when nothing in it or beside it changed since the pass of the same kind last
//! saw it: that is, in the last two passes.

use std::marker::PhantomData;

use super::active::Active;
use super::tile::{LANES, Lanes, Rows, Tile};
use super::tiles::Tiles;
use crate::BitImage;

/// What a pass deletes, from the eight neighbours P2 .. P9 (clockwise from north) of 64 pixels.
pub(super) trait Rule {
    fn deletable(p: [u64; 8], second: bool) -> u64;
}

/// Zhang and Suen, CACM 1984.
pub(super) struct ZhangSuen;

impl Rule for ZhangSuen {
    #[inline(always)]
    fn deletable([p2, p3, p4, p5, p6, p7, p8, p9]: [u64; 8], second: bool) -> u64 {
        let ring = [p2, p3, p4, p5, p6, p7, p8, p9, p2];
        // Exactly one 0 -> 1 transition makes the neighbours one run; its length is neither 1 nor 7
        // when some two adjacent are set and some two adjacent are clear.
        let (mut once, mut twice, mut set_pair, mut no_clear_pair) = (0, 0, 0, u64::MAX);
        for i in 0..8 {
            let rise = !ring[i] & ring[i + 1];
            twice |= once & rise;
            once |= rise;
            set_pair |= ring[i] & ring[i + 1];
            no_clear_pair &= ring[i] | ring[i + 1];
        }
        let kept = if second {
            p2 & p8 & (p4 | p6)
        } else {
            p4 & p6 & (p2 | p8)
        };
        once & !twice & set_pair & !no_clear_pair & !kept
    }
}

/// Guo and Hall, CACM 1989, their first algorithm.
pub(super) struct GuoHall;

impl Rule for GuoHall {
    #[inline(always)]
    fn deletable([p2, p3, p4, p5, p6, p7, p8, p9]: [u64; 8], second: bool) -> u64 {
        let (a, b) = (!p2 & (p3 | p4), !p4 & (p5 | p6));
        let (c, d) = (!p6 & (p7 | p8), !p8 & (p9 | p2));
        let one_component = (a ^ b ^ c ^ d) & !(a & b | c & d);
        let first = two_or_three([p9 | p2, p3 | p4, p5 | p6, p7 | p8]);
        let other = two_or_three([p2 | p3, p4 | p5, p6 | p7, p8 | p9]);
        // min(first, other) is 2 or 3: both at least 2, one of them below 4.
        let count = first.0 & other.0 & (first.1 | other.1);
        let kept = if second {
            (p2 | p3 | !p5) & p4
        } else {
            (p6 | p7 | !p9) & p8
        };
        one_component & count & !kept
    }
}

/// Whether at least two, and whether not all four, are set.
#[inline(always)]
const fn two_or_three([a, b, c, d]: [u64; 4]) -> (u64, u64) {
    (a & b | c & d | (a | b) & (c | d), !(a & b & c & d))
}

/// Thins until a round of both passes deletes nothing.
pub(super) fn thin<R: Rule>(image: &BitImage) -> BitImage {
    pulp::Arch::new().dispatch(Job::<R> {
        image,
        rule: PhantomData,
    })
}

/// The work as a type: a closure would be compiled apart, without the wide vectors.
struct Job<'a, R> {
    image: &'a BitImage,
    rule: PhantomData<R>,
}

impl<R: Rule> pulp::NullaryFnOnce for Job<'_, R> {
    type Output = BitImage;

    #[inline(always)]
    fn call(self) -> BitImage {
        thin_tiles::<R>(self.image)
    }
}

#[inline(always)]
fn thin_tiles<R: Rule>(image: &BitImage) -> BitImage {
    let mut tiles = Tiles::from_image(image);
    let mut now = Active::of(&tiles);
    let mut next = now.clone();
    let mut deletions: Vec<(usize, Tile)> = Vec::new();
    let (mut second, mut idle) = (false, false);
    loop {
        deletions.clear();
        let grid = tiles.grid();
        let visited = now.drain(
            #[inline(always)]
            |index| {
                let mut deleted = if second {
                    deletions_of::<R, true>(&tiles, index)
                } else {
                    deletions_of::<R, false>(&tiles, index)
                };
                grid.cut_frame(index, &mut deleted);
                if deleted.any() != 0 {
                    deletions.push((index, deleted));
                }
            },
        );
        if !visited && idle {
            return tiles.to_image();
        }
        idle = !visited;
        for (index, deleted) in &deletions {
            tiles.get_mut(*index).subtract(deleted);
            next.insert_touched(*index, deleted);
            now.insert_touched(*index, deleted);
        }
        std::mem::swap(&mut now, &mut next);
        second = !second;
    }
}

#[inline(always)]
fn deletions_of<R: Rule, const SECOND: bool>(tiles: &Tiles, index: usize) -> Tile {
    let window = tiles.window(index);
    Tile {
        even: rule_on_rows::<R, SECOND>(&window.above_even(), &window.even, &window.odd),
        odd: rule_on_rows::<R, SECOND>(&window.even, &window.odd, &window.below_odd()),
    }
}

#[inline(always)]
fn rule_on_rows<R: Rule, const SECOND: bool>(north: &Rows, rows: &Rows, south: &Rows) -> Lanes {
    let (n, c, s) = (north.centre(), rows.centre(), south.centre());
    let (ne, e, se) = (north.eastern(), rows.eastern(), south.eastern());
    let (nw, w, sw) = (north.western(), rows.western(), south.western());
    let mut deleted = [0; LANES];
    for i in 0..LANES {
        let around = [n[i], ne[i], e[i], se[i], s[i], sw[i], w[i], nw[i]];
        deleted[i] = c[i] & R::deletable(around, SECOND);
    }
    deleted
}
