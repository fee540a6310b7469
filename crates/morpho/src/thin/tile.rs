//! 16 rows of 64 pixels, and what surrounds them.
//!
//! A tile is two vectors of words, its even and its odd rows, so that pixels of one row parity fill
//! whole vectors.

#![expect(
    clippy::needless_range_loop,
    reason = "loops over several rows of lanes at once are what becomes vector code"
)]

/// Words in each half of a tile.
pub(super) const LANES: usize = 8;
/// Rows of a tile.
pub(super) const TILE_ROWS: usize = 2 * LANES;

/// Eight words, one a row, every second row.
pub(super) type Lanes = [u64; LANES];

/// 16 rows of 64 pixels.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
#[repr(align(64))]
pub(super) struct Tile {
    pub(super) even: Lanes,
    pub(super) odd: Lanes,
}

impl Tile {
    #[inline(always)]
    pub(super) fn any(&self) -> u64 {
        let mut all = 0;
        for i in 0..LANES {
            all |= self.even[i] | self.odd[i];
        }
        all
    }

    #[inline(always)]
    pub(super) fn subtract(&mut self, other: &Self) {
        *self = self.difference(other);
    }

    /// The pixels that are in `other` too.
    #[inline(always)]
    pub(super) fn intersection(&self, other: &Self) -> Self {
        let mut tile = *self;
        for i in 0..LANES {
            tile.even[i] &= other.even[i];
            tile.odd[i] &= other.odd[i];
        }
        tile
    }

    /// The pixels that are not in `other`.
    #[inline(always)]
    pub(super) fn difference(&self, other: &Self) -> Self {
        let mut tile = *self;
        for i in 0..LANES {
            tile.even[i] &= !other.even[i];
            tile.odd[i] &= !other.odd[i];
        }
        tile
    }
}

/// One row parity of a tile with the words west and east of it.
#[derive(Clone, Copy)]
pub(super) struct Rows {
    pub(super) west: Lanes,
    pub(super) centre: Lanes,
    pub(super) east: Lanes,
}

impl Rows {
    /// The western neighbour of each pixel.
    #[inline(always)]
    pub(super) fn western(&self) -> Lanes {
        let mut lanes = [0; LANES];
        for i in 0..LANES {
            lanes[i] = self.centre[i] << 1 | self.west[i] >> 63;
        }
        lanes
    }

    #[inline(always)]
    pub(super) const fn centre(&self) -> Lanes {
        self.centre
    }

    /// The eastern neighbour of each pixel.
    #[inline(always)]
    pub(super) fn eastern(&self) -> Lanes {
        let mut lanes = [0; LANES];
        for i in 0..LANES {
            lanes[i] = self.centre[i] >> 1 | self.east[i] << 63;
        }
        lanes
    }

    /// Drops pixels from the tile itself.
    #[inline(always)]
    pub(super) fn subtract(&mut self, pixels: &Lanes) {
        for i in 0..LANES {
            self.centre[i] &= !pixels[i];
        }
    }

    /// The pixels set in both.
    #[inline(always)]
    pub(super) fn intersection(&self, other: &Self) -> Self {
        let mut rows = *self;
        for i in 0..LANES {
            rows.west[i] &= other.west[i];
            rows.centre[i] &= other.centre[i];
            rows.east[i] &= other.east[i];
        }
        rows
    }

    /// The rows two further down: the last one comes from the tile below.
    #[inline(always)]
    fn down(&self, below: [u64; 3]) -> Self {
        Self {
            west: shift_down(&self.west, below[0]),
            centre: shift_down(&self.centre, below[1]),
            east: shift_down(&self.east, below[2]),
        }
    }

    /// The rows two further up: the first one comes from the tile above.
    #[inline(always)]
    fn up(&self, above: [u64; 3]) -> Self {
        Self {
            west: shift_up(&self.west, above[0]),
            centre: shift_up(&self.centre, above[1]),
            east: shift_up(&self.east, above[2]),
        }
    }
}

#[inline(always)]
pub(super) fn shift_down(lanes: &Lanes, last: u64) -> Lanes {
    let mut shifted = [last; LANES];
    shifted[..LANES - 1].copy_from_slice(&lanes[1..]);
    shifted
}

#[inline(always)]
pub(super) fn shift_up(lanes: &Lanes, first: u64) -> Lanes {
    let mut shifted = [first; LANES];
    shifted[1..].copy_from_slice(&lanes[..LANES - 1]);
    shifted
}

/// A tile with all that touches it.
#[derive(Clone, Copy)]
pub(super) struct Window {
    pub(super) even: Rows,
    pub(super) odd: Rows,
    pub(super) above: [u64; 3],
    pub(super) below: [u64; 3],
}

impl Window {
    /// The rows above the even rows.
    #[inline(always)]
    pub(super) fn above_even(&self) -> Rows {
        self.odd.up(self.above)
    }

    /// The rows below the odd rows.
    #[inline(always)]
    pub(super) fn below_odd(&self) -> Rows {
        self.even.down(self.below)
    }
}
