//! Sobel gradients of a whole picture.

use image::GrayImage;

use crate::{
    lanes::{Lanes, Task, Width as _},
    rows::Rows,
};

/// Sobel 3 x 3 gradients of a picture, the border pixels repeating outside it.
///
/// gx is positive where the picture gets brighter to the right, gy where it gets brighter downwards; a step
/// of h gray levels across a straight edge along an axis gives 4 h.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Gradient {
    width: u32,
    height: u32,
    gx: Vec<i16>,
    gy: Vec<i16>,
}

impl Gradient {
    /// The gradients of `image`.
    #[must_use]
    pub fn of(image: &GrayImage) -> Self {
        let mut gradient = Self::default();
        gradient.update(image);
        gradient
    }

    /// Becomes the gradients of `image`; the result's buffers are used again.
    pub fn update(&mut self, image: &GrayImage) {
        (self.width, self.height) = image.dimensions();
        let area = image.as_raw().len();
        self.gx.resize(area, 0);
        self.gy.resize(area, 0);
        if area > 0 {
            i16::dispatch(Whole {
                image,
                gradient: self,
            });
        }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Responses to brighter-to-the-right, row after row.
    #[must_use]
    pub fn gx(&self) -> &[i16] {
        &self.gx
    }

    /// Responses to brighter-downwards, row after row.
    #[must_use]
    pub fn gy(&self) -> &[i16] {
        &self.gy
    }
}

struct Whole<'a> {
    image: &'a GrayImage,
    gradient: &'a mut Gradient,
}

impl Task for Whole<'_> {
    type Value = i16;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Value = i16>>(self, lanes: L) {
        let (width, height) = (self.image.width() as usize, self.image.height() as usize);
        let mut rows = Rows::default();
        rows.resize(width);
        let pixels = |v: usize| &self.image.as_raw()[v * width..][..width];
        rows.read(0, pixels(0));
        for v in 0..height {
            if v + 1 < height {
                rows.read(v + 1, pixels(v + 1));
            }
            rows.gradient(lanes, v, width, height);
            let at = v * width..(v + 1) * width;
            self.gradient.gx[at.clone()].copy_from_slice(&rows.gx[v % 2][..width]);
            self.gradient.gy[at].copy_from_slice(&rows.gy[v % 2][..width]);
        }
    }
}
