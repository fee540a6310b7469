//! The image as tiles of 64 x 16 pixels, and which tiles may still change.
//!
//! Thinning visits a tile again and again until nothing in it or beside it changes. A tile is two
//! vectors of words, its even and its odd rows, so that pixels of one row parity fill whole vectors.

#![expect(
    clippy::needless_range_loop,
    reason = "loops over several rows of lanes at once are what becomes vector code"
)]

use crate::BitImage;

/// Words in each half of a tile.
pub(super) const LANES: usize = 8;
/// Rows of a tile.
const TILE_ROWS: usize = 2 * LANES;

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

    /// The pixels of both.
    #[inline(always)]
    pub(super) fn union(&self, other: &Self) -> Self {
        let mut tile = *self;
        for i in 0..LANES {
            tile.even[i] |= other.even[i];
            tile.odd[i] |= other.odd[i];
        }
        tile
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
    west: Lanes,
    centre: Lanes,
    east: Lanes,
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
fn shift_down(lanes: &Lanes, last: u64) -> Lanes {
    let mut shifted = [last; LANES];
    shifted[..LANES - 1].copy_from_slice(&lanes[1..]);
    shifted
}

#[inline(always)]
fn shift_up(lanes: &Lanes, first: u64) -> Lanes {
    let mut shifted = [first; LANES];
    shifted[1..].copy_from_slice(&lanes[..LANES - 1]);
    shifted
}

/// A tile with all that touches it.
#[derive(Clone, Copy)]
pub(super) struct Window {
    pub(super) even: Rows,
    pub(super) odd: Rows,
    above: [u64; 3],
    below: [u64; 3],
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

/// Where the tiles of an image lie: column after column, with a margin of one tile all round.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Grid {
    width: usize,
    height: usize,
    columns: usize,
    /// Tiles from one column to the next.
    pitch: usize,
}

impl Grid {
    pub(super) const fn new(image: &BitImage) -> Self {
        let columns = image.stride();
        Self {
            width: image.width(),
            height: image.height(),
            columns,
            pitch: image.height().div_ceil(TILE_ROWS) + 2,
        }
    }

    /// Tiles, margin included.
    pub(super) const fn len(&self) -> usize {
        (self.columns + 2) * self.pitch
    }

    const fn index(&self, column: usize, y: usize) -> usize {
        (column + 1) * self.pitch + y / TILE_ROWS + 1
    }

    /// Cuts a tile's pixels on the image's outermost rows and columns out of `tile`.
    #[inline(always)]
    pub(super) fn cut_frame(&self, index: usize, tile: &mut Tile) {
        let (column, row) = (index / self.pitch - 1, index % self.pitch - 1);
        let mut keep = u64::MAX;
        if column == 0 {
            keep &= !1;
        }
        if column + 1 == self.columns {
            keep &= !(1 << ((self.width - 1) % 64));
        }
        if keep != u64::MAX {
            for i in 0..LANES {
                tile.even[i] &= keep;
                tile.odd[i] &= keep;
            }
        }
        if row == 0 {
            tile.even[0] = 0;
        }
        if row == (self.height - 1) / TILE_ROWS {
            let last = (self.height - 1) % TILE_ROWS;
            let half = if last.is_multiple_of(2) {
                &mut tile.even
            } else {
                &mut tile.odd
            };
            half[last / 2] = 0;
        }
    }
}

/// Where a pixel is kept: tile, row of 16, bit of 64.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place(u32);

impl Place {
    /// The pixel `bit` further in the same word.
    pub(super) const fn at(self, bit: u32) -> Self {
        Self(self.0 + bit)
    }

    pub(super) const fn tile(self) -> usize {
        (self.0 >> 10) as usize
    }

    const fn row(self) -> usize {
        (self.0 >> 6 & 15) as usize
    }

    const fn bit(self) -> u32 {
        self.0 & 63
    }
}

/// An image in tiles.
#[derive(Clone)]
pub(super) struct Tiles {
    grid: Grid,
    tiles: Vec<Tile>,
}

impl Tiles {
    pub(super) fn from_image(image: &BitImage) -> Self {
        let grid = Grid::new(image);
        let mut tiles = vec![Tile::default(); grid.len()];
        for y in 0..image.height() {
            let lane = (y % TILE_ROWS) / 2;
            for (column, &word) in image.row(y).iter().enumerate() {
                let tile = &mut tiles[grid.index(column, y)];
                let half = if y.is_multiple_of(2) {
                    &mut tile.even
                } else {
                    &mut tile.odd
                };
                half[lane] = word;
            }
        }
        Self { grid, tiles }
    }

    pub(super) fn to_image(&self) -> BitImage {
        let mut image = BitImage::new(self.grid.width, self.grid.height);
        for y in 0..self.grid.height {
            let lane = (y % TILE_ROWS) / 2;
            for (column, word) in image.row_mut(y).iter_mut().enumerate() {
                let tile = &self.tiles[self.grid.index(column, y)];
                *word = if y.is_multiple_of(2) {
                    tile.even[lane]
                } else {
                    tile.odd[lane]
                };
            }
        }
        image
    }

    /// As many tiles with no pixel set.
    pub(super) fn cleared(&self) -> Self {
        Self {
            grid: self.grid,
            tiles: vec![Tile::default(); self.tiles.len()],
        }
    }

    /// Where the pixels of a word lie: that of its lowest bit.
    pub(super) const fn place_of_word(&self, column: usize, y: usize) -> Place {
        let tile = self.grid.index(column, y);
        assert!(tile < 1 << 22, "an image of 2^32 pixels or more");
        Place((tile << 10 | (y % TILE_ROWS) << 6) as u32)
    }

    pub(super) fn set(&mut self, place: Place) {
        *self.word(place) |= 1 << place.bit();
    }

    pub(super) fn clear(&mut self, place: Place) {
        *self.word(place) &= !(1 << place.bit());
    }

    fn word(&mut self, place: Place) -> &mut u64 {
        let tile = &mut self.tiles[place.tile()];
        let half = if place.row().is_multiple_of(2) {
            &mut tile.even
        } else {
            &mut tile.odd
        };
        &mut half[place.row() / 2]
    }

    pub(super) const fn grid(&self) -> Grid {
        self.grid
    }

    #[inline(always)]
    pub(super) fn get(&self, index: usize) -> &Tile {
        &self.tiles[index]
    }

    #[inline(always)]
    pub(super) fn get_mut(&mut self, index: usize) -> &mut Tile {
        &mut self.tiles[index]
    }

    #[inline(always)]
    pub(super) fn window(&self, index: usize) -> Window {
        let column = |at: usize| &self.tiles[at - 1..at + 2];
        let west = column(index - self.grid.pitch);
        let centre = column(index);
        let east = column(index + self.grid.pitch);
        let last = LANES - 1;
        Window {
            even: Rows {
                west: west[1].even,
                centre: centre[1].even,
                east: east[1].even,
            },
            odd: Rows {
                west: west[1].odd,
                centre: centre[1].odd,
                east: east[1].odd,
            },
            above: [west[0].odd[last], centre[0].odd[last], east[0].odd[last]],
            below: [west[2].even[0], centre[2].even[0], east[2].even[0]],
        }
    }
}

impl Tiles {
    /// The pixels of a tile with a set pixel at most three rows and three columns away.
    #[inline(always)]
    pub(super) fn near(&self, index: usize) -> Tile {
        let pitch = self.grid.pitch;
        let (west_even, west_odd) = self.seven_rows(index - pitch);
        let (even, odd) = self.seven_rows(index);
        let (east_even, east_odd) = self.seven_rows(index + pitch);
        Tile {
            even: seven_columns(&west_even, &even, &east_even),
            odd: seven_columns(&west_odd, &odd, &east_odd),
        }
    }

    /// What is set in any of seven rows, around the even and around the odd rows of a tile.
    #[inline(always)]
    fn seven_rows(&self, index: usize) -> (Lanes, Lanes) {
        let [above, tile, below] = [index - 1, index, index + 1].map(
            #[inline(always)]
            |at| &self.tiles[at],
        );
        let last = LANES - 1;
        let even_above = shift_up(&tile.even, above.even[last]);
        let odd_above = shift_up(&tile.odd, above.odd[last]);
        let odd_far_above = shift_up(&odd_above, above.odd[last - 1]);
        let even_below = shift_down(&tile.even, below.even[0]);
        let odd_below = shift_down(&tile.odd, below.odd[0]);
        let even_far_below = shift_down(&even_below, below.even[1]);
        let (mut even, mut odd) = ([0; LANES], [0; LANES]);
        for i in 0..LANES {
            let near = even_above[i] | odd_above[i] | even_below[i] | odd_below[i];
            let shared = near | tile.even[i] | tile.odd[i];
            even[i] = shared | odd_far_above[i];
            odd[i] = shared | even_far_below[i];
        }
        (even, odd)
    }
}

#[inline(always)]
fn seven_columns(west: &Lanes, centre: &Lanes, east: &Lanes) -> Lanes {
    let mut lanes = [0; LANES];
    for i in 0..LANES {
        let (w, c, e) = (west[i], centre[i], east[i]);
        let left = c << 1 | c << 2 | c << 3 | w >> 63 | w >> 62 | w >> 61;
        let right = c >> 1 | c >> 2 | c >> 3 | e << 63 | e << 62 | e << 61;
        lanes[i] = c | left | right;
    }
    lanes
}

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
        let mut active = Self::none(tiles.grid);
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
