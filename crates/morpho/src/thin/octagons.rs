//! Layers by octagonal distance.

use super::active::Active;
use super::homotopic::Layers;
use super::tile::{LANES, Lanes, Rows, Tile, Window};
use super::tiles::Tiles;
use crate::BitImage;

/// Layers of the octagonal distance from the background (outside included): erosions by the cross and
/// the 3x3 square in turn, 7 to 5, which is within 4 % of the Euclidean distance.
pub(super) struct Octagons {
    layer: usize,
    /// The image eroded `layer - 1`, `layer` and `layer + 1` times. Tiles that are not active have
    /// three equal generations.
    eroded: [Tiles; 3],
}

impl Octagons {
    pub(super) fn new(image: &BitImage) -> Self {
        let tiles = Tiles::from_image(image);
        Self {
            layer: 0,
            eroded: [tiles.clone(), tiles.clone(), tiles],
        }
    }
}

impl Layers for Octagons {
    #[inline(always)]
    fn advance(&mut self, active: &mut Active, next: &mut Active) {
        let is_square = (self.layer + 1) * 5 / 12 > self.layer * 5 / 12;
        self.layer += 1;
        self.eroded.rotate_left(1);
        let [before, now, after] = &mut self.eroded;
        active.visit(
            #[inline(always)]
            |index| {
                let window = now.window(index);
                let tile = if is_square {
                    erode_square(&window)
                } else {
                    erode_cross(&window)
                };
                let changed = now.get(index).difference(&tile);
                next.insert_touched(index, &changed);
                if before.get(index) != now.get(index) {
                    next.insert(index);
                }
                *after.get_mut(index) = tile;
            },
        );
    }

    #[inline(always)]
    fn inner(&self) -> &Tiles {
        &self.eroded[2]
    }

    #[inline(always)]
    fn young(&self, index: usize) -> Tile {
        self.eroded[0]
            .get(index)
            .difference(self.eroded[2].get(index))
    }
}

#[inline(always)]
fn erode_cross(window: &Window) -> Tile {
    Tile {
        even: cross_rows(&window.above_even(), &window.even, &window.odd),
        odd: cross_rows(&window.even, &window.odd, &window.below_odd()),
    }
}

#[inline(always)]
fn cross_rows(north: &Rows, rows: &Rows, south: &Rows) -> Lanes {
    let (n, c, s) = (north.centre(), rows.centre(), south.centre());
    let (e, w) = (rows.eastern(), rows.western());
    let mut lanes = [0; LANES];
    for i in 0..LANES {
        lanes[i] = n[i] & c[i] & s[i] & e[i] & w[i];
    }
    lanes
}

#[inline(always)]
fn erode_square(window: &Window) -> Tile {
    Tile {
        even: square_rows(&window.above_even(), &window.even, &window.odd),
        odd: square_rows(&window.even, &window.odd, &window.below_odd()),
    }
}

#[inline(always)]
fn square_rows(north: &Rows, rows: &Rows, south: &Rows) -> Lanes {
    let columns = north.intersection(rows).intersection(south);
    let (c, e, w) = (columns.centre(), columns.eastern(), columns.western());
    let mut lanes = [0; LANES];
    for i in 0..LANES {
        lanes[i] = c[i] & e[i] & w[i];
    }
    lanes
}
