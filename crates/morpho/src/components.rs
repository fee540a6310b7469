//! Connected components, holes, the Euler number.

use crate::{BitImage, Connectivity, Pixel, seed_fill};

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Bounds {
    /// Leftmost column.
    pub x: usize,
    /// Topmost row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// One connected component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Component {
    /// Its number, from 1 in the raster order of the components' first pixels.
    pub label: u32,
    /// Its pixels.
    pub area: usize,
    /// The smallest rectangle around it.
    pub bounds: Bounds,
    /// Its first pixel in raster order.
    pub first: Pixel,
}

/// The connected foreground components of an image.
#[derive(Clone, Debug)]
pub struct Components {
    width: usize,
    height: usize,
    components: Vec<Component>,
    labels: Vec<u32>,
}

impl Components {
    /// Labels the foreground components of `image`.
    #[must_use]
    pub fn label(image: &BitImage, connectivity: Connectivity) -> Self {
        let (width, height) = (image.width(), image.height());
        let mut labels = vec![0u32; width * height];
        let mut components = Vec::new();
        for y in 0..height {
            for x in 0..width {
                if !image.get(x, y) || labels[y * width + x] != 0 {
                    continue;
                }
                let label = components.len() as u32 + 1;
                let patch = seed_fill(image, Pixel::new(x, y), connectivity);
                let (mut x0, mut x1, mut y1, mut area) = (x, x, y, 0);
                for py in y..height {
                    for px in 0..width {
                        if patch.get(px, py) {
                            labels[py * width + px] = label;
                            x0 = x0.min(px);
                            x1 = x1.max(px);
                            y1 = py;
                            area += 1;
                        }
                    }
                }
                components.push(Component {
                    label,
                    area,
                    bounds: Bounds {
                        x: x0,
                        y,
                        width: x1 - x0 + 1,
                        height: y1 - y + 1,
                    },
                    first: Pixel::new(x, y),
                });
            }
        }
        Self {
            width,
            height,
            components,
            labels,
        }
    }

    /// How many components there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.components.len()
    }

    /// The components, by label.
    #[must_use]
    pub fn as_slice(&self) -> &[Component] {
        &self.components
    }

    /// The largest component, of equals the first in raster order; `None` if there is none.
    #[must_use]
    pub fn largest(&self) -> Option<&Component> {
        self.components
            .iter()
            .max_by_key(|c| (c.area, std::cmp::Reverse(c.label)))
    }

    /// The label of pixel (x, y); 0 for background and outside the image.
    #[must_use]
    pub fn label_at(&self, x: usize, y: usize) -> u32 {
        if x < self.width && y < self.height {
            self.labels[y * self.width + x]
        } else {
            0
        }
    }

    /// The component that holds pixel (x, y).
    #[must_use]
    pub fn at(&self, x: usize, y: usize) -> Option<&Component> {
        let label = self.label_at(x, y) as usize;
        self.components.get(label.wrapping_sub(1))
    }

    /// The label of every pixel, row after row; 0 is background.
    #[must_use]
    pub fn to_labels(&self) -> Vec<u32> {
        self.labels.clone()
    }

    /// The image of the components that `keep` says yes to.
    #[must_use]
    pub fn select(&self, mut keep: impl FnMut(&Component) -> bool) -> BitImage {
        let kept: Vec<bool> = std::iter::once(false)
            .chain(self.components.iter().map(&mut keep))
            .collect();
        BitImage::from_fn(self.width, self.height, |x, y| {
            kept[self.labels[y * self.width + x] as usize]
        })
    }
}

/// The number of holes: background components, of the dual connectivity, that do not touch the
/// image's edge.
#[must_use]
pub fn holes(image: &BitImage, connectivity: Connectivity) -> usize {
    let mut only = crate::fill_holes(image, connectivity);
    only.subtract(image);
    Components::label(&only, connectivity.dual()).count()
}

/// The Euler number: components minus holes.
#[must_use]
pub fn euler(image: &BitImage, connectivity: Connectivity) -> i64 {
    Components::label(image, connectivity).count() as i64 - holes(image, connectivity) as i64
}
