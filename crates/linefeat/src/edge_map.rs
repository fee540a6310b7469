//! Edge pixels with their gradients.

use image::GrayImage;

use crate::bits::Bits;

/// An edge pixel and the gradient there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EdgePixel {
    /// Column.
    pub u: u32,
    /// Row.
    pub v: u32,
    /// Sobel response to brighter-to-the-right, -1020 to 1020.
    pub gx: i16,
    /// Sobel response to brighter-downwards, -1020 to 1020.
    pub gy: i16,
}

/// The edge pixels of a picture: as a list in row order with gradients, and as packed bits.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EdgeMap {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) words: Vec<u64>,
    pub(crate) pixels: Vec<EdgePixel>,
}

impl EdgeMap {
    /// No edges in a picture of no size: a place for results.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Columns of the picture.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows of the picture.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The edge pixels by rows, in a row by columns.
    #[must_use]
    pub fn pixels(&self) -> &[EdgePixel] {
        &self.pixels
    }

    /// Row `v` as bits: bit `u % 64` of word `u / 64` is pixel u; bits past the width are 0.
    ///
    /// # Panics
    /// If the picture has no row `v`.
    #[must_use]
    pub fn row(&self, v: u32) -> &[u64] {
        assert!(v < self.height, "no row {v} of {}", self.height);
        let words = self.width.div_ceil(64) as usize;
        &self.words[v as usize * words..][..words]
    }

    /// Whether (u, v) is an edge pixel; nothing outside the picture is.
    #[must_use]
    pub fn contains(&self, u: u32, v: u32) -> bool {
        u < self.width && v < self.height && self.row(v)[u as usize / 64] >> (u % 64) & 1 == 1
    }

    /// Makes room for as many edges as pixels. What no frame needs is not touched, and takes no memory.
    pub(crate) fn reserve(&mut self, pixels: usize) {
        self.pixels
            .reserve(pixels.saturating_sub(self.pixels.len()));
    }

    /// The edges of `image` that `bits` has.
    pub(crate) fn collect(&mut self, bits: &Bits, image: &GrayImage) {
        (self.width, self.height) = image.dimensions();
        self.words.clear();
        for v in 0..bits.height() {
            self.words.extend_from_slice(bits.row(v));
        }
        pulp::Arch::new().dispatch(Collect { map: self, image });
    }

    /// 255 at edge pixels, 0 elsewhere.
    #[must_use]
    pub fn to_gray(&self) -> GrayImage {
        let mut out = GrayImage::new(self.width, self.height);
        self.write_gray(&mut out);
        out
    }

    /// As [`EdgeMap::to_gray`], into a picture that is used again if it has the size.
    pub fn write_gray(&self, out: &mut GrayImage) {
        if out.dimensions() != (self.width, self.height) {
            *out = GrayImage::new(self.width, self.height);
        }
        if self.width > 0 {
            pulp::Arch::new().dispatch(Paint { map: self, out });
        }
    }
}

struct Paint<'a> {
    map: &'a EdgeMap,
    out: &'a mut GrayImage,
}

impl pulp::NullaryFnOnce for Paint<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let width = self.map.width as usize;
        let words = self.map.words.chunks_exact(width.div_ceil(64));
        for (words, pixels) in words.zip(self.out.chunks_exact_mut(width)) {
            let (blocks, rest) = pixels.as_chunks_mut::<64>();
            for (block, word) in blocks.iter_mut().zip(words) {
                *block = spread(*word);
            }
            if let Some(last) = words.last() {
                rest.copy_from_slice(&spread(*last)[..rest.len()]);
            }
        }
    }
}

/// A byte a bit: 255 or 0.
#[inline(always)]
fn spread(word: u64) -> [u8; 64] {
    const ONES: u64 = 0x0101_0101_0101_0101;
    const DIAGONAL: u64 = 0x8040_2010_0804_0201;
    const SEVENS: u64 = 0x7F7F_7F7F_7F7F_7F7F;
    let mut out = [0; 64];
    for (out, bits) in out
        .as_chunks_mut::<8>()
        .0
        .iter_mut()
        .zip(word.to_le_bytes())
    {
        // bit k stays in byte k only, then moves to the byte's top
        let one_each = (u64::from(bits) * ONES) & DIAGONAL;
        let tops = (one_each + SEVENS) & !SEVENS;
        *out = ((tops >> 7) * 255).to_le_bytes();
    }
    out
}

struct Collect<'a> {
    map: &'a mut EdgeMap,
    image: &'a GrayImage,
}

impl pulp::NullaryFnOnce for Collect<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { map, image } = self;
        let count: u32 = map.words.iter().map(|word| word.count_ones()).sum();
        map.pixels.resize(count as usize, EdgePixel::default());
        let (width, height) = (map.width as usize, map.height as usize);
        let stride = width.div_ceil(64);
        let raw = image.as_raw();
        let mut out = map.pixels.iter_mut();
        for v in 0..height {
            let row = |v: usize| &raw[v * width..][..width];
            let (above, here, below) = (
                row(v.saturating_sub(1)),
                row(v),
                row((v + 1).min(height - 1)),
            );
            for (w, &word) in map.words[v * stride..][..stride].iter().enumerate() {
                let mut rest = word;
                while rest != 0 {
                    let u = w * 64 + rest.trailing_zeros() as usize;
                    rest &= rest - 1;
                    let (gx, gy) = if u > 0 && u + 1 < width {
                        sobel(
                            &above[u - 1..u + 2],
                            &here[u - 1..u + 2],
                            &below[u - 1..u + 2],
                        )
                    } else {
                        let (l, r) = (u.saturating_sub(1), (u + 1).min(width - 1));
                        let three = |row: &[u8]| [row[l], row[u], row[r]];
                        sobel(&three(above), &three(here), &three(below))
                    };
                    if let Some(out) = out.next() {
                        *out = EdgePixel {
                            u: u as u32,
                            v: v as u32,
                            gx,
                            gy,
                        };
                    }
                }
            }
        }
    }
}

/// Sobel's masks on three rows of three.
#[inline(always)]
fn sobel(above: &[u8], here: &[u8], below: &[u8]) -> (i16, i16) {
    let at = |row: &[u8], i: usize| i16::from(row[i]);
    let falling = at(below, 2) - at(above, 0);
    let rising = at(above, 2) - at(below, 0);
    let gx = falling + rising + 2 * (at(here, 2) - at(here, 0));
    let gy = falling - rising + 2 * (at(below, 1) - at(above, 1));
    (gx, gy)
}
