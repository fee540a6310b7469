//! Seed fill, reconstruction, hole filling.

use crate::{BitImage, Pixel};

/// Which pixels are neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Connectivity {
    /// Left, right, above, below.
    Four,
    /// Those and the four diagonal ones. OpenCV's default for components.
    #[default]
    Eight,
}

impl Connectivity {
    /// The connectivity that the background must have so that a closed curve of the foreground
    /// separates an inside from an outside: four for eight, eight for four.
    #[must_use]
    pub const fn dual(self) -> Self {
        match self {
            Self::Four => Self::Eight,
            Self::Eight => Self::Four,
        }
    }
}

/// The connected foreground component that contains `seed`; empty if the seed is background or
/// outside the image.
#[must_use]
pub fn seed_fill(image: &BitImage, seed: Pixel, connectivity: Connectivity) -> BitImage {
    let mut out = BitImage::default();
    seed_fill_into(
        image,
        seed,
        connectivity,
        &mut FillWorkspace::new(),
        &mut out,
    );
    out
}

/// Memory that the `_into` forms of filling keep between calls.
#[derive(Clone, Debug, Default)]
pub struct FillWorkspace {
    stack: Vec<Front>,
}

impl FillWorkspace {
    /// A workspace that holds nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// [`seed_fill`] into an image whose memory is reused.
pub fn seed_fill_into(
    image: &BitImage,
    seed: Pixel,
    connectivity: Connectivity,
    workspace: &mut FillWorkspace,
    out: &mut BitImage,
) {
    out.reset(image.width(), image.height());
    if !image.get(seed.x, seed.y) {
        return;
    }
    let mut flood = Flood::new(image, connectivity, workspace, out);
    flood.spread(seed.y, seed.x / 64, 1 << (seed.x % 64));
}

/// Reconstruction by dilation: the components of `mask` that hold a foreground pixel of `marker`.
/// Marker pixels outside the mask do not count.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn reconstruct(marker: &BitImage, mask: &BitImage, connectivity: Connectivity) -> BitImage {
    let mut out = BitImage::default();
    reconstruct_into(
        marker,
        mask,
        connectivity,
        &mut FillWorkspace::new(),
        &mut out,
    );
    out
}

/// [`reconstruct`] into an image whose memory is reused.
///
/// # Panics
/// If the sizes differ.
pub fn reconstruct_into(
    marker: &BitImage,
    mask: &BitImage,
    connectivity: Connectivity,
    workspace: &mut FillWorkspace,
    out: &mut BitImage,
) {
    assert_eq!(
        (marker.width(), marker.height()),
        (mask.width(), mask.height()),
        "images of different sizes"
    );
    out.reset(mask.width(), mask.height());
    let mut flood = Flood::new(mask, connectivity, workspace, out);
    for y in 0..mask.height() {
        for (column, &word) in marker.row(y).iter().enumerate() {
            if word != 0 {
                flood.spread(y, column, word);
            }
        }
    }
}

/// Pixels of one word that were reached and whose neighbours were not looked at yet.
#[derive(Clone, Copy, Debug)]
struct Front {
    /// Among all words of the image.
    index: usize,
    /// Among the words of its row.
    column: usize,
    bits: u64,
}

/// A fill at work. Runs are filled whole within a word, so that what is left of a word's mask
/// consists of whole runs always.
struct Flood<'a> {
    mask: &'a [u64],
    filled: &'a mut [u64],
    stride: usize,
    connectivity: Connectivity,
    stack: &'a mut Vec<Front>,
}

impl<'a> Flood<'a> {
    fn new(
        mask: &'a BitImage,
        connectivity: Connectivity,
        workspace: &'a mut FillWorkspace,
        filled: &'a mut BitImage,
    ) -> Self {
        workspace.stack.clear();
        Self {
            mask: mask.words(),
            filled: filled.words_mut(),
            stride: mask.stride(),
            connectivity,
            stack: &mut workspace.stack,
        }
    }

    /// Fills all that is connected with some bits of one word.
    fn spread(&mut self, y: usize, column: usize, bits: u64) {
        self.reach(y * self.stride + column, column, bits);
        while let Some(front) = self.stack.pop() {
            match self.connectivity {
                Connectivity::Four => self.step::<false>(front),
                Connectivity::Eight => self.step::<true>(front),
            }
        }
    }

    /// Looks at the neighbours of a front.
    #[inline(always)]
    fn step<const DIAGONAL: bool>(&mut self, front: Front) {
        let Front {
            index,
            column,
            bits,
        } = front;
        let stride = self.stride;
        let wide = if DIAGONAL {
            bits | bits << 1 | bits >> 1
        } else {
            bits
        };
        let (above, below) = (index >= stride, index + stride < self.mask.len());
        if bits & 1 != 0 && column > 0 {
            const LAST: u64 = 1 << 63;
            self.reach(index - 1, column - 1, LAST);
            if DIAGONAL && above {
                self.reach(index - stride - 1, column - 1, LAST);
            }
            if DIAGONAL && below {
                self.reach(index + stride - 1, column - 1, LAST);
            }
        }
        if bits >> 63 != 0 && column + 1 < stride {
            self.reach(index + 1, column + 1, 1);
            if DIAGONAL && above {
                self.reach(index - stride + 1, column + 1, 1);
            }
            if DIAGONAL && below {
                self.reach(index + stride + 1, column + 1, 1);
            }
        }
        if above {
            self.reach(index - stride, column, wide);
        }
        if below {
            self.reach(index + stride, column, wide);
        }
    }

    /// Fills the runs of one word that some bits touch.
    #[inline(always)]
    fn reach(&mut self, index: usize, column: usize, bits: u64) {
        let left = self.mask[index] & !self.filled[index];
        let seeds = left & bits;
        if seeds != 0 {
            let bits = touched_runs(left, seeds);
            self.filled[index] |= bits;
            self.stack.push(Front {
                index,
                column,
                bits,
            });
        }
    }
}

/// The runs of ones in `word` that hold a bit of `seeds`, which are bits of `word`.
#[inline(always)]
fn touched_runs(word: u64, mut seeds: u64) -> u64 {
    let mut touched = 0;
    while seeds != 0 {
        let seed = seeds & seeds.wrapping_neg();
        // the carry runs through the ones above the seed
        let above = word & !word.wrapping_add(seed) & !(seed - 1);
        let zeros_below = !word & (seed - 1);
        let start = 64 - zeros_below.leading_zeros();
        touched |= above | (seed - 1) >> start << start;
        seeds &= !touched;
    }
    touched
}

/// Adds every hole: every background component, of the dual connectivity, that does not touch
/// the image's edge.
#[must_use]
pub fn fill_holes(image: &BitImage, connectivity: Connectivity) -> BitImage {
    let background = image.complement();
    let (width, height) = (image.width(), image.height());
    let mut edge = BitImage::new(width, height);
    for y in 0..height {
        let row = edge.row_mut(y);
        if y == 0 || y + 1 == height {
            row.copy_from_slice(background.row(y));
        } else if width > 0 {
            row[0] |= 1;
            row[(width - 1) / 64] |= 1 << ((width - 1) % 64);
        }
    }
    let mut filled = reconstruct(&edge, &background, connectivity.dual());
    filled.invert();
    filled
}
