//! Structuring elements: the windows that erosion and dilation look through.

use crate::{BitImage, Pixel};

/// A horizontal run of an element: offsets `dx0..=dx1` from the anchor in row `dy`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct ElementRun {
    pub(crate) dy: isize,
    pub(crate) dx0: isize,
    pub(crate) dx1: isize,
}

impl ElementRun {
    pub(crate) const fn reflected(&self) -> Self {
        Self {
            dy: -self.dy,
            dx0: -self.dx1,
            dx1: -self.dx0,
        }
    }

    /// The largest p such that the run has 2^p columns or more.
    pub(crate) const fn power(&self) -> u32 {
        (self.dx1 - self.dx0 + 1).ilog2()
    }
}

/// A structuring element: a non-empty set of offsets (dx, dy) from an anchor.
///
/// [`erode`](crate::erode) and [`dilate`](crate::dilate) at pixel p look at the pixels p + (dx, dy).
/// The anchor is OpenCV's: column `width / 2`, row `height / 2` of the bounding rectangle, so a
/// window of even width reaches one pixel farther left (up) than right (down).
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Element {
    /// Sorted by `dy`, then `dx0`; disjoint and not adjacent.
    runs: Vec<ElementRun>,
}

/// Why a mask is no structuring element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ElementError {
    /// The mask has no foreground pixel.
    #[error("the mask of {width} x {height} has no foreground pixel")]
    Empty {
        /// Columns of the mask.
        width: usize,
        /// Rows of the mask.
        height: usize,
    },
}

impl Element {
    /// The rectangle of `width` x `height` pixels with the anchor at (`width / 2`, `height / 2`).
    ///
    /// # Panics
    /// If a side is 0 or above 2^31.
    #[must_use]
    pub fn rectangle(width: usize, height: usize) -> Self {
        assert!(width > 0 && height > 0, "a rectangle of {width} x {height}");
        let (left, up) = (offset(width / 2), offset(height / 2));
        let (dx0, dx1) = (-left, offset(width) - left - 1);
        Self {
            runs: (-up..offset(height) - up)
                .map(|dy| ElementRun { dy, dx0, dx1 })
                .collect(),
        }
    }

    /// The square of `side` x `side` pixels: [`rectangle`](Self::rectangle) with equal sides.
    ///
    /// # Panics
    /// If the side is 0 or above 2^31.
    #[must_use]
    pub fn square(side: usize) -> Self {
        Self::rectangle(side, side)
    }

    /// The disk `dx^2 + dy^2 <= radius^2`, `2 radius + 1` pixels wide: the set of
    /// `skimage.morphology.disk(radius)`. (OpenCV's `MORPH_ELLIPSE` rounds otherwise and differs
    /// in some pixels of the rim.)
    ///
    /// # Panics
    /// If the radius is above 2^31.
    #[must_use]
    pub fn disk(radius: usize) -> Self {
        let r = offset(radius);
        Self {
            runs: (-r..=r)
                .map(|dy| {
                    let half = (r * r - dy * dy).isqrt();
                    ElementRun {
                        dy,
                        dx0: -half,
                        dx1: half,
                    }
                })
                .collect(),
        }
    }

    /// The cross of the anchor and its four neighbours.
    #[must_use]
    pub fn cross() -> Self {
        Self::disk(1)
    }

    /// Any set of offsets: the foreground of `mask`, seen from `anchor`, which need be neither
    /// foreground nor inside the mask.
    ///
    /// # Errors
    /// [`ElementError::Empty`] if the mask has no foreground pixel.
    pub fn from_mask(mask: &BitImage, anchor: Pixel) -> Result<Self, ElementError> {
        let mut runs = Vec::new();
        for y in 0..mask.height() {
            let dy = offset(y) - offset(anchor.y);
            let mut x = 0;
            while x < mask.width() {
                if !mask.get(x, y) {
                    x += 1;
                    continue;
                }
                let start = x;
                while mask.get(x, y) {
                    x += 1;
                }
                runs.push(ElementRun {
                    dy,
                    dx0: offset(start) - offset(anchor.x),
                    dx1: offset(x) - offset(anchor.x) - 1,
                });
            }
        }
        if runs.is_empty() {
            return Err(ElementError::Empty {
                width: mask.width(),
                height: mask.height(),
            });
        }
        Ok(Self { runs })
    }

    /// The element turned by 180 degrees about its anchor: every (dx, dy) becomes (-dx, -dy).
    #[must_use]
    pub fn reflected(&self) -> Self {
        Self {
            runs: self.runs.iter().rev().map(ElementRun::reflected).collect(),
        }
    }

    /// Whether the offset (dx, dy) belongs to the element.
    #[must_use]
    pub fn contains(&self, dx: isize, dy: isize) -> bool {
        self.runs
            .iter()
            .any(|run| run.dy == dy && (run.dx0..=run.dx1).contains(&dx))
    }

    /// All offsets (dx, dy), row after row.
    pub fn offsets(&self) -> impl Iterator<Item = [isize; 2]> + '_ {
        self.runs
            .iter()
            .flat_map(|run| (run.dx0..=run.dx1).map(|dx| [dx, run.dy]))
    }

    /// Pixels in the element.
    #[must_use]
    pub fn area(&self) -> usize {
        self.runs
            .iter()
            .map(|run| (run.dx1 - run.dx0 + 1).unsigned_abs())
            .sum()
    }

    /// The farthest that an offset lies from the anchor along an axis.
    pub(crate) fn reach(&self) -> usize {
        self.runs
            .iter()
            .map(|run| run.dy.abs().max(run.dx0.abs()).max(run.dx1.abs()))
            .max()
            .unwrap_or(0)
            .cast_unsigned()
    }

    /// The first run and the rows of a rectangle that holds the anchor's column.
    pub(crate) fn as_rectangle(&self) -> Option<(ElementRun, usize)> {
        let first = self.runs[0];
        let follows = |(dy, run): (isize, &ElementRun)| *run == ElementRun { dy, ..first };
        let is_one = (first.dy..).zip(&self.runs).all(follows);
        (is_one && (first.dx0..=first.dx1).contains(&0)).then_some((first, self.runs.len()))
    }

    pub(crate) fn runs(&self) -> &[ElementRun] {
        &self.runs
    }
}

/// A size as a signed offset.
fn offset(size: usize) -> isize {
    assert!(size <= 1 << 31, "an element of {size} pixels");
    size.cast_signed()
}
