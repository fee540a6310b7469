//! Layers in an order that the caller gives.

use super::active::Active;
use super::homotopic::Layers;
use super::tile::Tile;
use super::tiles::{Place, Tiles};
use crate::BitImage;

/// One layer for each distinct value of the order, ascending.
pub(super) struct Ordered {
    /// The foreground pixels, by ascending order.
    pixels: Vec<Place>,
    /// Where each layer ends in `pixels`.
    ends: Vec<usize>,
    layer: usize,
    inner: Tiles,
    young: Tiles,
}

impl Ordered {
    pub(super) fn new(image: &BitImage, order: &[u32]) -> Self {
        let inner = Tiles::from_image(image);
        let (pixels, ends) = sorted(image, &inner, order);
        Self {
            pixels,
            ends,
            layer: 0,
            young: inner.cleared(),
            inner,
        }
    }

    /// The pixels of a layer, none past the last.
    fn pixels_of(&self, layer: usize) -> std::ops::Range<usize> {
        let end = |at: usize| self.ends.get(at).copied().unwrap_or(self.pixels.len());
        let start = if layer == 0 { 0 } else { end(layer - 1) };
        start..end(layer)
    }
}

impl Layers for Ordered {
    #[inline(always)]
    fn advance(&mut self, active: &mut Active, next: &mut Active) {
        if self.layer >= 2 {
            for &place in &self.pixels[self.pixels_of(self.layer - 2)] {
                self.young.clear(place);
            }
        }
        if self.layer >= 1 {
            for &place in &self.pixels[self.pixels_of(self.layer - 1)] {
                next.insert(place.tile());
            }
        }
        for &place in &self.pixels[self.pixels_of(self.layer)] {
            self.inner.clear(place);
            self.young.set(place);
            active.insert(place.tile());
            next.insert_touching(place);
        }
        self.layer += 1;
    }

    #[inline(always)]
    fn inner(&self) -> &Tiles {
        &self.inner
    }

    #[inline(always)]
    fn young(&self, index: usize) -> Tile {
        *self.young.get(index)
    }
}

/// Calls `visit` with the order and the place of each foreground pixel, row after row.
fn for_each_pixel(
    image: &BitImage,
    tiles: &Tiles,
    order: &[u32],
    mut visit: impl FnMut(u32, Place),
) {
    let width = image.width();
    for y in 0..image.height() {
        let row = &order[y * width..(y + 1) * width];
        for (column, &word) in image.row(y).iter().enumerate() {
            let first = tiles.place_of_word(column, y);
            let mut rest = word;
            while rest != 0 {
                let bit = rest.trailing_zeros();
                rest &= rest - 1;
                visit(row[column * 64 + bit as usize], first.at(bit));
            }
        }
    }
}

/// The foreground pixels by ascending order, and the ends of the runs of equal order.
fn sorted(image: &BitImage, tiles: &Tiles, order: &[u32]) -> (Vec<Place>, Vec<usize>) {
    let (mut count, mut largest) = (0, 0);
    for_each_pixel(image, tiles, order, |value, _| {
        count += 1;
        largest = largest.max(value as usize);
    });
    if largest <= 4 * count + 65_536 {
        return counting_sorted(image, tiles, order, count, largest);
    }
    let mut keyed = Vec::with_capacity(count);
    for_each_pixel(image, tiles, order, |value, place| {
        keyed.push((value, place))
    });
    keyed.sort_unstable();
    let ends = keyed.chunk_by(|a, b| a.0 == b.0).scan(0, |end, run| {
        *end += run.len();
        Some(*end)
    });
    (
        keyed.iter().map(|&(_, place)| place).collect(),
        ends.collect(),
    )
}

fn counting_sorted(
    image: &BitImage,
    tiles: &Tiles,
    order: &[u32],
    count: usize,
    largest: usize,
) -> (Vec<Place>, Vec<usize>) {
    let mut starts = vec![0_usize; largest + 2];
    for_each_pixel(image, tiles, order, |value, _| {
        starts[value as usize + 1] += 1
    });
    let mut ends = Vec::new();
    for value in 1..starts.len() {
        let run = starts[value];
        starts[value] += starts[value - 1];
        if run > 0 {
            ends.push(starts[value]);
        }
    }
    let mut pixels = vec![tiles.place_of_word(0, 0); count];
    for_each_pixel(image, tiles, order, |value, place| {
        let start = &mut starts[value as usize];
        pixels[*start] = place;
        *start += 1;
    });
    (pixels, ends)
}
