//! A camera that sends pictures and sees nothing: covered, blinded, or stuck.

use image::GrayImage;

/// Samples taken along each side.
const GRID: u32 = 32;
/// Equal pictures that make a camera stuck: real sensors always have noise.
const STUCK_AFTER: u32 = 10;
/// Levels below which, and from the top, a picture is dark or bright as a whole; luma may span 16 to 235 only.
const MARGIN: f64 = 24.0;
/// Standard deviation [levels] below which nothing is to be seen in such a picture.
const SPREAD: f64 = 10.0;

/// What is wrong with a camera's pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum PictureFault {
    /// Black, as when covered.
    Dark,
    /// White, as when blinded.
    Bright,
    /// The same ten times in a row.
    Frozen,
}

/// Looks at the pictures of one camera, whichever it is, one after another.
///
/// ```
/// use image::{GrayImage, Luma};
/// use mobot_hw::{PictureFault, PictureWatch};
///
/// let mut watch = PictureWatch::default();
/// let covered = GrayImage::from_pixel(64, 48, Luma([3]));
/// assert_eq!(watch.look(&covered), Some(PictureFault::Dark));
/// ```
#[derive(Debug, Clone, Default)]
pub struct PictureWatch {
    last: Option<u64>,
    /// Pictures equal to the one before.
    repeats: u32,
}

impl PictureWatch {
    /// What is wrong as of this picture. Reads about a thousand pixels.
    pub fn look(&mut self, picture: &GrayImage) -> Option<PictureFault> {
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        // FNV-1a, by Fowler, Noll and Vo
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for level in samples(picture) {
            hash = (hash ^ u64::from(level)).wrapping_mul(0x0100_0000_01b3);
            let level = f64::from(level);
            (sum, squares, count) = (sum + level, squares + level * level, count + 1.0);
        }
        let repeated = self.last.replace(hash) == Some(hash);
        self.repeats = if repeated { self.repeats + 1 } else { 0 };
        if count == 0.0 {
            return Some(PictureFault::Dark);
        }
        let mean = sum / count;
        let flat = squares / count - mean * mean < SPREAD * SPREAD;
        if flat && mean < MARGIN {
            Some(PictureFault::Dark)
        } else if flat && mean > 255.0 - MARGIN {
            Some(PictureFault::Bright)
        } else if self.repeats + 1 >= STUCK_AFTER {
            Some(PictureFault::Frozen)
        } else {
            None
        }
    }
}

/// Pixels in the middles of a grid's cells; all of a picture that is smaller.
fn samples(picture: &GrayImage) -> impl Iterator<Item = u8> {
    let along = |side: u32| {
        let cells = side.min(GRID);
        (0..cells).map(move |cell| (2 * cell + 1) * side / (2 * cells))
    };
    let (width, height) = picture.dimensions();
    along(height).flat_map(move |v| along(width).map(move |u| picture.get_pixel(u, v).0[0]))
}
