//! The image in tiles of 64 x 16 pixels, which thinning visits again and again until nothing in them
//! or beside them changes.

use super::tile::{LANES, Lanes, Rows, TILE_ROWS, Tile, Window, shift_down, shift_up};
use crate::BitImage;

/// Where the tiles of an image lie: column after column, with a margin of one tile all round.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Grid {
    width: usize,
    height: usize,
    pub(super) columns: usize,
    /// Tiles from one column to the next.
    pub(super) pitch: usize,
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

    pub(super) const fn row(self) -> usize {
        (self.0 >> 6 & 15) as usize
    }

    pub(super) const fn bit(self) -> u32 {
        self.0 & 63
    }
}

/// An image in tiles.
#[derive(Clone)]
pub(super) struct Tiles {
    grid: Grid,
    pub(super) tiles: Vec<Tile>,
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
