//! Homotopic thinning: peel layer by layer, delete only simple pixels.
//!
//! A pixel is simple when deleting it changes the topology neither of the foreground (8-connected)
//! nor of the background (4-connected); its 3x3 neighbourhood decides that (Yokoi, Toriwaki and
//! Fukumura 1975). No two pixels of one parity class (x mod 2, y mod 2) touch, so deleting all simple
//! pixels of a class at once equals deleting them one after another: the topology is safe by
//! construction, in whatever order the rest happens.
//!
//! The order makes the skeleton centred: layer k may delete only what lies outside the image eroded k
//! times. A pixel with one neighbour (an end) may go only while its own layer or the next one is
//! peeled. So a branch whose tip is approached faster than the peeling eats it (the bisector of a
//! corner of 90 degrees) shrinks away, and a branch with sides nearly parallel (a corridor) stays.

use super::tiles::{Active, LANES, Lanes, Rows, Tile, Tiles, Window};
use crate::BitImage;

/// What the layers leave in place.
pub(super) trait Layers {
    /// Goes to the next layer: may name more tiles that it concerns, and names those that the layer
    /// after it does.
    fn advance(&mut self, active: &mut Active, next: &mut Active);

    /// The pixels of a tile that later layers may delete, but this one may not.
    fn inner(&self, index: usize) -> &Tile;

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
                let deleted = peel(
                    &tiles.window(index),
                    layers.inner(index),
                    &layers.young(index),
                );
                if deleted.any() != 0 {
                    tiles.get_mut(index).subtract(&deleted);
                    next.insert_touched(index, &deleted);
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

/// Deletes the simple pixels of a tile, one parity class after another; which ones it was.
#[inline(always)]
fn peel(window: &Window, inner: &Tile, young: &Tile) -> Tile {
    let mut window = *window;
    let north = window.above_even();
    let even = peel_rows(
        &north,
        &mut window.even,
        &window.odd,
        &inner.even,
        &young.even,
    );
    let south = window.below_odd();
    let odd = peel_rows(
        &window.even,
        &mut window.odd,
        &south,
        &inner.odd,
        &young.odd,
    );
    Tile { even, odd }
}

#[inline(always)]
fn peel_rows(north: &Rows, rows: &mut Rows, south: &Rows, inner: &Lanes, young: &Lanes) -> Lanes {
    let (n, ne, nw) = (north.centre(), north.eastern(), north.western());
    let (s, se, sw) = (south.centre(), south.eastern(), south.western());
    let mut deleted = [0; LANES];
    for class in [EVEN_COLUMNS, !EVEN_COLUMNS] {
        let (c, e, w) = (rows.centre(), rows.eastern(), rows.western());
        let mut now = [0; LANES];
        for i in 0..LANES {
            let around = [n[i], ne[i], e[i], se[i], s[i], sw[i], w[i], nw[i]];
            let kept = inner[i] | !(young[i] | at_least_two(around));
            now[i] = c[i] & class & !kept & simple(around);
        }
        rows.subtract(&now);
        for i in 0..LANES {
            deleted[i] |= now[i];
        }
    }
    deleted
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
