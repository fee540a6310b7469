//! Seeded hostile images and elements: they need no quality, only variety.

use morpho::{BitImage, Border, Connectivity, Element, Pixel};

/// Sides around the ends of words.
pub(crate) const SIDES: [usize; 15] = [0, 1, 2, 3, 5, 8, 17, 31, 62, 63, 64, 65, 127, 128, 129];

pub(crate) const BORDERS: [Border; 3] = [Border::Neutral, Border::Background, Border::Foreground];

pub(crate) const CONNECTIVITIES: [Connectivity; 2] = [Connectivity::Four, Connectivity::Eight];

/// xorshift64
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((self.next() >> 11) % n as u64) as usize
    }

    pub(crate) fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// A small side often, any of [`SIDES`] sometimes.
    pub(crate) fn side(&mut self) -> usize {
        if self.below(4) == 0 {
            self.pick(&SIDES)
        } else {
            self.below(24)
        }
    }

    /// Specks, blobs or stripes of any density.
    pub(crate) fn image(&mut self, width: usize, height: usize) -> BitImage {
        let percent = self.pick(&[2, 10, 30, 50, 70, 90, 98]);
        let grain = self.pick(&[[1, 1], [1, 1], [2, 2], [3, 5], [9, 4], [70, 1], [1, 40]]);
        let (columns, rows) = (width / grain[0] + 1, height / grain[1] + 1);
        let coarse: Vec<bool> = (0..columns * rows)
            .map(|_| self.below(100) < percent)
            .collect();
        let noise = self.pick(&[0, 0, 1, 5]);
        BitImage::from_fn(width, height, |x, y| {
            coarse[y / grain[1] * columns + x / grain[0]] ^ (self.below(100) < noise)
        })
    }

    pub(crate) fn any_image(&mut self) -> BitImage {
        let (width, height) = (self.pick(&SIDES), self.side());
        self.image(width, height)
    }

    /// Rectangles, disks, masks with the anchor anywhere, also outside.
    pub(crate) fn element(&mut self) -> Element {
        let far = self.below(8) == 0;
        match self.below(4) {
            0 => {
                let limit = if far { 150 } else { 9 };
                Element::rectangle(
                    1 + self.below(limit),
                    1 + self.below(if far { 20 } else { 9 }),
                )
            }
            1 => Element::disk(self.below(if far { 20 } else { 6 })),
            _ => loop {
                let (width, height) = (1 + self.below(if far { 90 } else { 7 }), 1 + self.below(7));
                let mask = self.image(width, height);
                let anchor = Pixel::new(self.below(width + 2), self.below(height + 2));
                if let Ok(element) = Element::from_mask(&mask, anchor) {
                    return element;
                }
            },
        }
    }
}

/// Rounds of a battery: the long form on demand.
pub(crate) fn rounds(short: usize) -> usize {
    if std::env::var_os("MOBOT_LONG").is_some() {
        short * 50
    } else {
        short
    }
}
