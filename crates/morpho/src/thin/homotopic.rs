//! Homotopic thinning: peel layer by layer, delete only simple pixels.
//!
//! A pixel is simple when deleting it changes the topology neither of the foreground (8-connected)
//! nor of the background (4-connected); its 3x3 neighbourhood decides that (Yokoi, Toriwaki and
//! Fukumura 1975). No two pixels of one parity class (x mod 2, y mod 2) touch, so deleting all simple
//! pixels of a class at once equals deleting them one after another: the topology is safe by
//! construction, in whatever order the rest happens.
//!
//! The order makes the skeleton centred: no layer deletes what belongs to a later one. A pixel with
//! one neighbour (an end) may go only while its own layer or the next is peeled, and only within three
//! pixels of a later layer. So a branch along which the distance grows fast (the bisector of a square
//! corner, a bump of a wall) shrinks away, and one with nearly parallel sides (a corridor) stays.
//!
//! Some passes are saved: a tile is visited only when its layer or a change beside it calls for it.

use super::active::Active;
use super::tile::{LANES, Lanes, Rows, Tile, Window};
use super::tiles::Tiles;
use crate::BitImage;

/// What the layers leave in place.
pub(super) trait Layers {
    /// Goes to the next layer: may name more tiles that it concerns, and names those that the layer
    /// after it does.
    fn advance(&mut self, active: &mut Active, next: &mut Active);

    /// The pixels that later layers may delete, but this one may not.
    fn inner(&self) -> &Tiles;

    /// The pixels of a tile that belong to this layer or the one before.
    fn young(&self, index: usize) -> Tile;
}

/// Thins until nothing is deletable.
pub(super) fn thin<L: Layers>(image: &BitImage, layers: L) -> BitImage {
    pulp::Arch::new().dispatch(Job { image, layers })
}

/// The work as a type: a closure would be compiled apart, without the wide vectors.
struct Job<'a, L> {
    image: &'a BitImage,
    layers: L,
}

impl<L: Layers> pulp::NullaryFnOnce for Job<'_, L> {
    type Output = BitImage;

    #[inline(always)]
    fn call(self) -> BitImage {
        peel_all(self.image, self.layers)
    }
}

#[inline(always)]
fn peel_all<L: Layers>(image: &BitImage, mut layers: L) -> BitImage {
    let mut tiles = Tiles::from_image(image);
    let mut active = Active::of(&tiles);
    let mut next = Active::none(tiles.grid());
    loop {
        layers.advance(&mut active, &mut next);
        let visited = active.drain(
            #[inline(always)]
            |index| {
                let inner = layers.inner();
                let mut loose = Tile::default();
                for second in [false, true] {
                    let [deleted, ends] = peel(&mut tiles.window(index), inner.get(index), &loose);
                    if deleted.any() != 0 {
                        tiles.get_mut(index).subtract(&deleted);
                        next.insert_touched(index, &deleted);
                    }
                    if second || ends.any() == 0 {
                        break;
                    }
                    loose = layers.young(index);
                    if ends.intersection(&loose).any() == 0 {
                        break;
                    }
                    loose = loose.intersection(&inner.near(index));
                    if ends.intersection(&loose).any() == 0 {
                        break;
                    }
                }
            },
        );
        if !visited {
            return tiles.to_image();
        }
        std::mem::swap(&mut active, &mut next);
    }
}

const EVEN_COLUMNS: u64 = 0x5555_5555_5555_5555;

/// Deletes the simple pixels of a tile outside `inner`, one parity class after another; ends only if
/// they are `loose`. Which pixels it deleted, and which ends it kept.
#[inline(always)]
fn peel(window: &mut Window, inner: &Tile, loose: &Tile) -> [Tile; 2] {
    let above = window.above_even();
    let even = Part {
        inner: &inner.even,
        loose: &loose.even,
    };
    let even = even.peel(&above, &mut window.even, &window.odd);
    let below = window.below_odd();
    let odd = Part {
        inner: &inner.odd,
        loose: &loose.odd,
    };
    let odd = odd.peel(&window.even, &mut window.odd, &below);
    [0, 1].map(
        #[inline(always)]
        |i| Tile {
            even: even[i],
            odd: odd[i],
        },
    )
}

/// The even or the odd rows of a tile.
struct Part<'a> {
    inner: &'a Lanes,
    loose: &'a Lanes,
}

impl Part<'_> {
    #[inline(always)]
    fn peel(&self, above: &Rows, rows: &mut Rows, below: &Rows) -> [Lanes; 2] {
        let (n, ne, nw) = (above.centre(), above.eastern(), above.western());
        let (s, se, sw) = (below.centre(), below.eastern(), below.western());
        let (mut deleted, mut ends) = ([0; LANES], [0; LANES]);
        for class in [EVEN_COLUMNS, !EVEN_COLUMNS] {
            let (c, e, w) = (rows.centre(), rows.eastern(), rows.western());
            let mut now = [0; LANES];
            for i in 0..LANES {
                let around = [n[i], ne[i], e[i], se[i], s[i], sw[i], w[i], nw[i]];
                let simple = c[i] & class & !self.inner[i] & simple(around);
                let ending = simple & !at_least_two(around) & !self.loose[i];
                now[i] = simple & !ending;
                deleted[i] |= now[i];
                ends[i] |= ending;
            }
            rows.subtract(&now);
        }
        [deleted, ends]
    }
}

/// Whether the neighbours (clockwise from north) make a pixel simple: exactly one run of background
/// 4-neighbours is followed by foreground, that is, the Yokoi number is 1.
#[inline(always)]
const fn simple([n, ne, e, se, s, sw, w, nw]: [u64; 8]) -> u64 {
    let (a, b) = (!n & (ne | e), !e & (se | s));
    let (c, d) = (!s & (sw | w), !w & (nw | n));
    (a ^ b ^ c ^ d) & !(a & b | c & d)
}

#[inline(always)]
const fn at_least_two([a, b, c, d, e, f, g, h]: [u64; 8]) -> u64 {
    let (ab, cd, ef, gh) = (a | b, c | d, e | f, g | h);
    let pairs = a & b | c & d | e & f | g & h;
    pairs | ab & cd | ef & gh | (ab | cd) & (ef | gh)
}
