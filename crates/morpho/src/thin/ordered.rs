//! Layers in an order that the caller gives.

use super::homotopic::Layers;
use super::tiles::{Active, Place, Tile, Tiles};
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

/// The foreground pixels by ascending order (and as they lie, where equal), and the ends of the runs
/// of equal order.
fn sorted(image: &BitImage, tiles: &Tiles, order: &[u32]) -> (Vec<Place>, Vec<usize>) {
    let width = image.width();
    let mut keyed: Vec<(u32, Place)> = Vec::with_capacity(image.count_ones());
    for y in 0..image.height() {
        for (column, &word) in image.row(y).iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                let x = column * 64 + rest.trailing_zeros() as usize;
                rest &= rest - 1;
                keyed.push((order[y * width + x], tiles.place(x, y)));
            }
        }
    }
    let largest = keyed.iter().map(|&(value, _)| value as usize).max();
    let Some(largest) = largest else {
        return (Vec::new(), Vec::new());
    };
    if largest > 4 * keyed.len() + 65_536 {
        keyed.sort_unstable();
        let ends = keyed.chunk_by(|a, b| a.0 == b.0).scan(0, |end, run| {
            *end += run.len();
            Some(*end)
        });
        return (
            keyed.iter().map(|&(_, place)| place).collect(),
            ends.collect(),
        );
    }
    counting_sorted(&keyed, largest)
}

fn counting_sorted(keyed: &[(u32, Place)], largest: usize) -> (Vec<Place>, Vec<usize>) {
    let mut starts = vec![0_usize; largest + 2];
    for &(value, _) in keyed {
        starts[value as usize + 1] += 1;
    }
    let mut ends = Vec::new();
    for value in 1..starts.len() {
        let count = starts[value];
        starts[value] += starts[value - 1];
        if count > 0 {
            ends.push(starts[value]);
        }
    }
    let mut pixels = vec![keyed[0].1; keyed.len()];
    for &(value, place) in keyed {
        pixels[starts[value as usize]] = place;
        starts[value as usize] += 1;
    }
    (pixels, ends)
}
