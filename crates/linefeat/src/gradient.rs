//! Sobel gradients of a whole picture.

use image::GrayImage;

use crate::reference;

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

    /// Becomes the gradients of `image`; the buffers are used again.
    pub fn update(&mut self, image: &GrayImage) {
        (self.width, self.height) = image.dimensions();
        self.gx.clear();
        self.gy.clear();
        for v in 0..self.height {
            for u in 0..self.width {
                let (gx, gy) = reference::gradient::sobel(image, u, v);
                self.gx.push(gx);
                self.gy.push(gy);
            }
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
