//! Canny's edges, bit for bit those of `cv2.Canny` with aperture 3.

use std::ops::Range;

use image::GrayImage;

use crate::{
    EdgeMap, Region,
    bits::Bits,
    hysteresis::{self, Open},
    lanes::Width as _,
    ridge::Ridges,
    rows::Rows,
    thresholds::{Count, Histogram},
};

/// How gx and gy make a magnitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Norm {
    /// |gx| + |gy|
    #[default]
    L1,
    /// sqrt(gx^2 + gy^2)
    L2,
}

/// Parameters of [`canny`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CannyParams {
    /// A pixel above this magnitude is an edge if a strong one leads to it [Sobel units: 4 x the step in
    /// gray levels], 0 to 2040. Raised: gaps.
    pub low: f64,
    /// A pixel above this magnitude is an edge by itself [Sobel units], 0 to 2040. Raised: faint edges go.
    pub high: f64,
    /// How gx and gy make a magnitude.
    pub norm: Norm,
}

impl Default for CannyParams {
    fn default() -> Self {
        Self {
            low: 50.0,
            high: 150.0,
            norm: Norm::L1,
        }
    }
}

impl CannyParams {
    /// Both limits as whole magnitudes (L1) or squared magnitudes (L2), the smaller first.
    pub(crate) fn limits(&self) -> (i32, i32) {
        let (low, high) = if self.low > self.high {
            (self.high, self.low)
        } else {
            (self.low, self.high)
        };
        // no magnitude is greater than that of (1020, 1020), and one of 0 is no ridge
        let limit = |value: f64| match self.norm {
            Norm::L1 => (value.floor() as i32).clamp(-1, 2040),
            Norm::L2 => {
                let value = value.min(32767.0);
                let squared = if value > 0.0 { value * value } else { value };
                (squared.floor() as i32).clamp(-1, 2 * 1020 * 1020)
            }
        };
        // only a threshold that is no number can leave the high limit below the low one
        (limit(low), limit(high).max(limit(low)))
    }
}

/// Parameters of [`canny_modified`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ModifiedCannyParams {
    /// Edges outside are left out; the thresholds are those of the inside. Larger: more time.
    pub region: Region,
    /// The share of the region's pixels whose magnitude exceeds the high threshold, 0 to 1. Raised:
    /// fainter edges, more time.
    pub strong_share: f64,
    /// The low threshold as a part of the high one, 0 to 1. Raised: gaps.
    pub low_ratio: f64,
    /// The high threshold is at least so many times the median magnitude, which is the noise's where most of
    /// the region is smooth: of Gaussian noise 1 pixel in 19 000 exceeds 4 medians, 1 in 220 000 exceeds 4.5,
    /// 1 in 3 million exceeds 5. Floors are textured, too, and what is near the noise is badly placed: pose fixes
    /// are best at 6. 0 or more. Raised: textured frames lose faint edges.
    pub noise_factor: f64,
    /// The least high threshold [Sobel units: 4 x the step in gray levels], 0 to 2040: what counts as an
    /// edge in a blank frame. Raised: dark frames lose edges.
    pub min_high: f64,
}

impl Default for ModifiedCannyParams {
    fn default() -> Self {
        Self {
            region: Region::Whole,
            strong_share: 0.08,
            low_ratio: 0.4,
            noise_factor: 6.0,
            min_high: 24.0,
        }
    }
}

/// The edges of `image`, bit for bit those of `cv2.Canny` with aperture 3.
///
/// Gradients are Sobel's, the border pixels repeating outside the picture. A pixel is kept if its magnitude is
/// above that of its two neighbours along the gradient (rounded to four directions; along the axes the second
/// neighbour may be as great) and above `low`, and if a chain of such pixels leads to one above `high`. The
/// thresholds are swapped if `low` is the greater one; magnitudes are compared with the thresholds rounded
/// down (L2: squared, then rounded down). Only for thresholds of 2^31 and more with L1, where OpenCV's
/// conversion overflows and every ridge becomes an edge, the result is what they say: no edge.
///
/// Time and memory are linear in the number of pixels, whatever they show.
///
/// Source: J. Canny, A Computational Approach to Edge Detection, PAMI 1986; the details are OpenCV's.
#[must_use]
pub fn canny(image: &GrayImage, params: &CannyParams) -> EdgeMap {
    let mut edges = EdgeMap::new();
    Canny::new().detect(image, params, &mut edges);
    edges
}

/// The edges of a part of `image`, with thresholds chosen from it (after Choi, Ryu, Kim 1999, section 3.2,
/// which names a modified Canny and leaves its details open).
///
/// The edges are those of [`canny`] with norm L1 without the pixels outside the region, which lead nowhere
/// either. The high threshold is the greatest that `strong_share` of the region's pixels exceed, counted at
/// every fourth pixel of every fourth row, and no less than the two bounds of [`ModifiedCannyParams`]: it follows exposure, and a
/// blank frame has no edges.
#[must_use]
pub fn canny_modified(image: &GrayImage, params: &ModifiedCannyParams) -> EdgeMap {
    let mut edges = EdgeMap::new();
    Canny::new().detect_modified(image, params, &mut edges);
    edges
}

/// The buffers of [`canny`] and [`canny_modified`], for frame after frame: nothing is allocated after the
/// first frame of a size, but when a frame has more edges than any before.
#[derive(Clone, Debug, Default)]
pub struct Canny {
    rows: Rows<i16>,
    long_rows: Rows<i32>,
    histogram: Histogram,
    weak: Bits,
    found: Bits,
    open: Open,
}

impl Canny {
    /// Buffers that grow with the first frame.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// `edges` becomes what [`canny`] finds.
    pub fn detect(&mut self, image: &GrayImage, params: &CannyParams, edges: &mut EdgeMap) {
        self.find(image, params, Region::Whole, edges);
    }

    /// `edges` becomes what [`canny_modified`] finds. Gives the thresholds.
    pub fn detect_modified(
        &mut self,
        image: &GrayImage,
        params: &ModifiedCannyParams,
        edges: &mut EdgeMap,
    ) -> CannyParams {
        i16::dispatch(Count {
            image,
            region: params.region,
            buffers: &mut self.rows,
            histogram: &mut self.histogram,
        });
        let thresholds = params.thresholds(&self.histogram);
        self.find(image, &thresholds, params.region, edges);
        thresholds
    }

    fn find(
        &mut self,
        image: &GrayImage,
        params: &CannyParams,
        region: Region,
        edges: &mut EdgeMap,
    ) {
        let (width, height) = image.dimensions();
        let inside = |v: &u32| !region.columns(*v, width).is_empty();
        let first = (0..height).find(inside).unwrap_or(height) as usize;
        let end = (0..height)
            .rev()
            .find(inside)
            .map_or(first, |v| v as usize + 1);
        for bits in [&mut self.weak, &mut self.found] {
            bits.resize(width as usize, height as usize);
            for v in (0..first).chain(end..height as usize) {
                bits.row_mut(v).fill(0);
            }
        }
        let (limits, rows) = (params.limits(), first..end);
        let (weak, strong) = (&mut self.weak, &mut self.found);
        match params.norm {
            Norm::L1 => i16::dispatch(Ridges {
                image,
                rows,
                limits,
                buffers: &mut self.rows,
                weak,
                strong,
            }),
            Norm::L2 => i32::dispatch(Ridges {
                image,
                rows,
                limits,
                buffers: &mut self.long_rows,
                weak,
                strong,
            }),
        }
        if region != Region::Whole {
            for v in first..end {
                let columns = region.columns(v as u32, width);
                for bits in [&mut self.weak, &mut self.found] {
                    keep(bits.row_mut(v), columns.clone());
                }
            }
        }
        hysteresis::follow(&self.weak, &mut self.found, &mut self.open);
        edges.collect(&self.found, image);
    }
}

impl ModifiedCannyParams {
    fn thresholds(&self, histogram: &Histogram) -> CannyParams {
        let bright = histogram.exceeded_by(self.strong_share) as f64;
        let noise = histogram.exceeded_by(0.5) as f64 * self.noise_factor;
        let high = bright.max(noise).max(self.min_high);
        CannyParams {
            low: self.low_ratio * high,
            high,
            norm: Norm::L1,
        }
    }
}

/// Clears the bits of a row outside the columns.
fn keep(row: &mut [u64], columns: Range<u32>) {
    // as many low bits of word w as there are columns below `end`
    let below = |end: u32, w: usize| match end.saturating_sub(64 * w as u32) {
        bits @ 0..64 => (1 << bits) - 1,
        _ => u64::MAX,
    };
    for (w, word) in row.iter_mut().enumerate() {
        *word &= below(columns.end, w) & !below(columns.start, w);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Canny {
        /// Where the buffers are and how large.
        fn buffers(&self) -> Vec<(usize, usize)> {
            let place = |bits: &Bits| (bits.words().as_ptr().addr(), bits.words().len());
            let mut all = vec![place(&self.weak), place(&self.found)];
            all.extend(self.open.buffers());
            all.extend(self.rows.buffers());
            all.extend(self.long_rows.buffers());
            all.push(self.histogram.buffer());
            all
        }
    }

    #[test]
    fn frames_of_one_size_use_the_same_buffers() {
        let frame = |shift: u32| {
            GrayImage::from_fn(300, 200, |u, v| {
                let inside = (u + shift) % 70 < 30 && v % 50 < 20;
                image::Luma([if inside { 200 } else { 50 }])
            })
        };
        let mut canny = Canny::new();
        let mut edges = EdgeMap::new();
        let run = |canny: &mut Canny, edges: &mut EdgeMap, shift| {
            for norm in [Norm::L1, Norm::L2] {
                let params = CannyParams {
                    norm,
                    ..CannyParams::default()
                };
                canny.detect(&frame(shift), &params, edges);
            }
            canny.detect_modified(&frame(shift), &ModifiedCannyParams::default(), edges);
            assert!(edges.pixels().len() > 1000);
        };
        run(&mut canny, &mut edges, 0);
        let (before, list, bits) = (canny.buffers(), edges.pixels.as_ptr(), edges.words.as_ptr());
        for shift in [3, 0, 3] {
            run(&mut canny, &mut edges, shift);
            assert_eq!(canny.buffers(), before);
            assert_eq!((edges.pixels.as_ptr(), edges.words.as_ptr()), (list, bits));
        }
    }
}
