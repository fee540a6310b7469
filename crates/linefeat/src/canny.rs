//! Canny's edges, bit for bit those of `cv2.Canny` with aperture 3.

use image::GrayImage;

use crate::{
    EdgeMap, hysteresis,
    ridge::{Bits, Job, Rows, Width as _},
};

/// How gx and gy make a magnitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Norm {
    /// |gx| + |gy|
    #[default]
    L1,
    /// sqrt(gx^2 + gy^2)
    L2,
}

/// Parameters of [`canny`].
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// The edges of `image`.
#[must_use]
pub fn canny(image: &GrayImage, params: &CannyParams) -> EdgeMap {
    let mut edges = EdgeMap::new();
    Canny::new().detect(image, params, &mut edges);
    edges
}

/// The buffers of [`canny`], for frame after frame.
#[derive(Clone, Debug, Default)]
pub struct Canny {
    rows: Rows<i16>,
    long_rows: Rows<i32>,
    weak: Vec<u64>,
    stack: Vec<usize>,
}

impl Canny {
    /// Buffers that grow with the first frame.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// `edges` becomes the edges of `image`.
    pub fn detect(&mut self, image: &GrayImage, params: &CannyParams, edges: &mut EdgeMap) {
        let stride = image.width().div_ceil(64) as usize;
        let height = image.height() as usize;
        (edges.width, edges.height) = image.dimensions();
        edges.words.resize(stride * height, 0);
        self.weak.resize(stride * height, 0);
        let rows = 0..height;
        let bits = Bits {
            weak: &mut self.weak,
            strong: &mut edges.words,
        };
        match params.norm {
            Norm::L1 => i16::run(Job {
                image,
                rows,
                limits: params.limits(),
                buffers: &mut self.rows,
                bits,
            }),
            Norm::L2 => i32::run(Job {
                image,
                rows,
                limits: params.limits(),
                buffers: &mut self.long_rows,
                bits,
            }),
        }
        hysteresis::follow(&self.weak, &mut edges.words, stride, &mut self.stack);
        edges.collect(image);
    }
}
