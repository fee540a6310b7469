//! Which tiles may still change.

use super::tile::{LANES, TILE_ROWS, Tile};
use super::tiles::{Grid, Place, Tiles};

/// A set of tiles, visited in the order of their indices.
#[derive(Clone)]
pub(super) struct Active {
    grid: Grid,
    bits: Vec<u64>,
}

impl Active {
    pub(super) fn none(grid: Grid) -> Self {
        Self {
            grid,
            bits: vec![0; grid.len().div_ceil(64)],
        }
    }

    /// The tiles with any pixel set.
    pub(super) fn of(tiles: &Tiles) -> Self {
        let mut active = Self::none(tiles.grid());
        for (index, tile) in tiles.tiles.iter().enumerate() {
            if tile.any() != 0 {
                active.insert(index);
            }
        }
        active
    }

    #[inline(always)]
    pub(super) fn insert(&mut self, index: usize) {
        self.bits[index / 64] |= 1 << (index % 64);
    }

    /// Inserts the tiles that a pixel touches: its own and those of its neighbours.
    #[inline(always)]
    pub(super) fn insert_touching(&mut self, place: Place) {
        let pitch = self.grid.pitch;
        let own = place.tile();
        let mut insert_rows = |tile: usize| {
            self.insert(tile);
            if place.row() == 0 {
                self.insert(tile - 1);
            }
            if place.row() == TILE_ROWS - 1 {
                self.insert(tile + 1);
            }
        };
        insert_rows(own);
        if place.bit() == 0 {
            insert_rows(own - pitch);
        }
        if place.bit() == 63 {
            insert_rows(own + pitch);
        }
    }

    /// Inserts a tile with changed pixels, and the neighbours that these pixels touch.
    #[inline(always)]
    pub(super) fn insert_touched(&mut self, index: usize, changed: &Tile) {
        let pitch = self.grid.pitch;
        let all = changed.any();
        if all == 0 {
            return;
        }
        self.insert(index);
        let columns = |word: u64| {
            [
                (word & 1 != 0, index - pitch),
                (word >> 63 != 0, index + pitch),
            ]
        };
        for (touched, beside) in columns(all) {
            if touched {
                self.insert(beside);
            }
        }
        for (row, above) in [(changed.even[0], true), (changed.odd[LANES - 1], false)] {
            if row == 0 {
                continue;
            }
            let step = |at: usize| if above { at - 1 } else { at + 1 };
            self.insert(step(index));
            for (touched, beside) in columns(row) {
                if touched {
                    self.insert(step(beside));
                }
            }
        }
    }

    /// Takes all tiles out and hands those inside the image to `visit`, in ascending order.
    /// Whether there was one.
    #[inline(always)]
    pub(super) fn drain(&mut self, visit: impl FnMut(usize)) -> bool {
        let found = self.visit(visit);
        self.bits.fill(0);
        found
    }

    /// Hands the tiles inside the image to `visit`, in ascending order. Whether there was one.
    #[inline(always)]
    pub(super) fn visit(&self, mut visit: impl FnMut(usize)) -> bool {
        let mut found = false;
        for (at, &word) in self.bits.iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                let index = at * 64 + rest.trailing_zeros() as usize;
                rest &= rest - 1;
                let row = index % self.grid.pitch;
                let column = index / self.grid.pitch;
                if row != 0
                    && row + 1 != self.grid.pitch
                    && column != 0
                    && column != self.grid.columns + 1
                {
                    found = true;
                    visit(index);
                }
            }
        }
        found
    }
}
