//! Homotopic thinning by its definition, pixel by pixel.
//!
//! Layer after layer, the tiles of 64 x 16 pixels that the layer concerns are visited, column after
//! column. A visit deletes the simple pixels that no later layer holds, one parity class after
//! another: rows before columns. Ends stay; but if one belongs to this layer or the last and a pixel of
//! a later layer is within three rows and three columns of it, a second round follows, in which such
//! ends go too.

use super::thin::neighbours;
use crate::BitImage;

/// The twin of [`crate::thin::homotopic`].
#[must_use]
pub fn homotopic(image: &BitImage) -> BitImage {
    let (width, height) = (image.width(), image.height());
    let mut layer = vec![0; width * height];
    let mut eroded = image.clone();
    for k in 0..width + height {
        let square = (k + 1) * 5 / 12 > k * 5 / 12;
        let old = eroded.clone();
        for y in 0..height {
            for x in 0..width {
                let p = neighbours(&old, x, y);
                let stays = (0..8).all(|i| p[i] || (i % 2 == 1 && !square));
                if old.get(x, y) && !stays {
                    layer[y * width + x] = k;
                    eroded.set(x, y, false);
                }
            }
        }
    }
    Peel::new(image, layer).run()
}

/// The twin of [`crate::thin::homotopic_ordered`].
#[must_use]
pub fn homotopic_ordered(image: &BitImage, order: &[u32]) -> BitImage {
    let (width, height) = (image.width(), image.height());
    let foreground = |i: usize| image.get(i % width, i / width);
    let mut values: Vec<u32> = (0..width * height)
        .filter(|&i| foreground(i))
        .map(|i| order[i])
        .collect();
    values.sort_unstable();
    values.dedup();
    let layer = order
        .iter()
        .map(|value| values.partition_point(|v| v < value))
        .collect();
    Peel::new(image, layer).run()
}

struct Peel<'a> {
    image: &'a BitImage,
    /// The layer of each pixel.
    layer: Vec<usize>,
    now: BitImage,
    /// The tiles of this layer, column after column, and those of the next.
    active: Vec<bool>,
    next: Vec<bool>,
    tiles_down: usize,
}

impl<'a> Peel<'a> {
    fn new(image: &'a BitImage, layer: Vec<usize>) -> Self {
        let tiles_down = image.height().div_ceil(16);
        let tiles = image.width().div_ceil(64) * tiles_down;
        Self {
            image,
            layer,
            now: image.clone(),
            active: vec![false; tiles],
            next: vec![false; tiles],
            tiles_down,
        }
    }

    fn run(mut self) -> BitImage {
        for y in 0..self.image.height() {
            for x in 0..self.image.width() {
                let tile = self.tile(x, y);
                self.active[tile] |= self.image.get(x, y);
            }
        }
        for k in 0.. {
            self.name_tiles(k);
            if !self.active.contains(&true) {
                break;
            }
            for tile in 0..self.active.len() {
                if std::mem::take(&mut self.active[tile]) {
                    let ends = self.round(tile, k, false);
                    if ends {
                        self.round(tile, k, true);
                    }
                }
            }
            std::mem::swap(&mut self.active, &mut self.next);
        }
        self.now
    }

    fn tile(&self, x: usize, y: usize) -> usize {
        x / 64 * self.tiles_down + y / 16
    }

    /// Which tiles a layer concerns.
    fn name_tiles(&mut self, k: usize) {
        for y in 0..self.image.height() {
            for x in 0..self.image.width() {
                let (tile, layer) = (self.tile(x, y), self.layer[y * self.image.width() + x]);
                if !self.image.get(x, y) {
                    continue;
                }
                if layer == k {
                    self.active[tile] = true;
                    self.touch(x, y);
                }
                self.next[tile] |= layer + 1 == k;
            }
        }
    }

    /// The next layer sees all tiles that a pixel touches.
    fn touch(&mut self, x: usize, y: usize) {
        for v in y.saturating_sub(1)..(y + 2).min(self.image.height()) {
            for u in x.saturating_sub(1)..(x + 2).min(self.image.width()) {
                let tile = self.tile(u, v);
                self.next[tile] = true;
            }
        }
    }

    /// One round over a tile. Whether it left ends that a round for `loose` ends may delete.
    fn round(&mut self, tile: usize, k: usize, loose: bool) -> bool {
        let (left, top) = (tile / self.tiles_down * 64, tile % self.tiles_down * 16);
        let mut ends = false;
        for (odd_row, odd_column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            for y in (top + odd_row..(top + 16).min(self.image.height())).step_by(2) {
                for x in (left + odd_column..(left + 64).min(self.image.width())).step_by(2) {
                    let p = neighbours(&self.now, x, y);
                    let layer = self.layer[y * self.image.width() + x];
                    if !self.now.get(x, y) || layer > k || !is_simple(p) {
                        continue;
                    }
                    let young = layer + 1 >= k;
                    let end = p.iter().filter(|&&set| set).count() < 2;
                    let may_end = young && self.later_near(x, y, k);
                    if end && !(loose && may_end) {
                        ends |= may_end;
                    } else {
                        self.now.set(x, y, false);
                        self.touch(x, y);
                    }
                }
            }
        }
        ends
    }

    fn later_near(&self, x: usize, y: usize, k: usize) -> bool {
        let (width, height) = (self.image.width(), self.image.height());
        (y.saturating_sub(3)..(y + 4).min(height)).any(|v| {
            (x.saturating_sub(3)..(x + 4).min(width))
                .any(|u| self.image.get(u, v) && self.layer[v * width + u] > k)
        })
    }
}

/// Whether deleting a foreground pixel with these neighbours keeps the topology (8-connected
/// foreground, 4-connected background): its Yokoi number is 1.
fn is_simple(p: [bool; 8]) -> bool {
    let components = (0..4)
        .filter(|i| !p[2 * i] && (p[2 * i + 1] || p[(2 * i + 2) % 8]))
        .count();
    components == 1
}
