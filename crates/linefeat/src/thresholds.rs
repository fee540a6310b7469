//! Thresholds that follow the frame: its contrast and its noise.

use image::GrayImage;

use crate::{
    Region,
    lanes::{Lanes, Task},
    rows::Rows,
};

/// Every so many rows count, and of them every so many pixels, one farther to the left in each: upright lines
/// count as much as level ones.
const STEP: u32 = 4;
/// One more than the greatest sum of absolute gradients.
const LEVELS: usize = 2041;

/// How often each magnitude |gx| + |gy| occurs within the region, among one pixel in `STEP` times `STEP`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Histogram {
    counts: Vec<u32>,
}

impl Histogram {
    #[cfg(test)]
    pub(crate) fn buffer(&self) -> (usize, usize) {
        (self.counts.as_ptr().addr(), self.counts.capacity())
    }

    /// The greatest threshold that `share` of the pixels exceed, or more of them where many are equal. 0 if
    /// there is none.
    pub(crate) fn exceeded_by(&self, share: f64) -> usize {
        let total: u64 = self.counts.iter().map(|&count| u64::from(count)).sum();
        let wanted = share * total as f64;
        let mut above = 0;
        for (magnitude, &count) in self.counts.iter().enumerate().rev() {
            above += u64::from(count);
            if above > 0 && above as f64 >= wanted {
                return magnitude.saturating_sub(1);
            }
        }
        0
    }
}

pub(crate) struct Count<'a> {
    pub(crate) image: &'a GrayImage,
    pub(crate) region: Region,
    pub(crate) buffers: &'a mut Rows<i16>,
    pub(crate) histogram: &'a mut Histogram,
}

impl Task for Count<'_> {
    type Value = i16;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Value = i16>>(self, lanes: L) {
        let (image, rows) = (self.image, self.buffers);
        let (width, height) = (image.width() as usize, image.height() as usize);
        let counts = &mut self.histogram.counts;
        counts.clear();
        counts.resize(LEVELS, 0);
        if width == 0 {
            return;
        }
        rows.resize(width);
        for v in (0..image.height()).step_by(STEP as usize) {
            let columns = self.region.columns(v, image.width());
            if columns.is_empty() {
                continue;
            }
            let v = v as usize;
            for v in v.saturating_sub(1)..(v + 2).min(height) {
                rows.read(v, &image.as_raw()[v * width..][..width]);
            }
            rows.gradient(lanes, v, width, height);
            let skip = (columns.start + v as u32 / STEP).wrapping_neg() % STEP;
            let magnitudes = rows.magnitudes(v, columns).iter();
            for magnitude in magnitudes.skip(skip as usize).step_by(STEP as usize) {
                counts[*magnitude as usize] += 1;
            }
        }
    }
}
