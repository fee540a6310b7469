//! Frames with the lens undone: straight things are straight in them.

use image::{GrayImage, Luma};

use crate::{FloorCamera, Lens, PixelPoint};

/// Undoes a lens in frame after frame of one size.
///
/// The rectified picture has the camera matrix of the frame, so that its pixels are the undistorted pixels of
/// [`FloorHomography`](crate::FloorHomography) but for a whole number of columns and rows, [`origin`](Self::origin).
/// It is the largest upright rectangle all of which the frame shows, at most a quarter of the frame beyond each of
/// its borders: nothing in it is made up.
#[derive(Debug, Clone, PartialEq)]
pub struct Rectifier {
    frame: [u32; 2],
    origin: [i32; 2],
    size: [u32; 2],
    taps: Vec<Tap>,
}

/// Where a rectified pixel is in the frame: the index of the pixel to its upper left, and the weights of the next
/// column and the next row [1 / 256].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Tap {
    index: u32,
    right: u16,
    below: u16,
}

/// How far beyond a border of the frame the rectified picture may reach, over the frame's side: farther out a lens
/// that bends so strongly spreads one pixel over many.
const BEYOND: f64 = 0.25;

impl Rectifier {
    /// For frames of a size [px]; `None` where no rectangle of 2 x 2 pixels or more is seen whole.
    #[must_use]
    pub fn new(lens: &Lens, [width, height]: [u32; 2]) -> Option<Self> {
        if width < 2 || height < 2 {
            return None;
        }
        let [left, top, right, bottom] = seen_whole(lens, [width, height])?;
        let size = [(right - left + 1) as u32, (bottom - top + 1) as u32];
        let mut taps = Vec::with_capacity(size[0] as usize * size[1] as usize);
        for v in top..=bottom {
            for u in left..=right {
                let ideal = PixelPoint::new(f64::from(u), f64::from(v));
                taps.push(Tap::at(lens.distort(ideal)?, [width, height]));
            }
        }
        Some(Self {
            frame: [width, height],
            origin: [left, top],
            size,
            taps,
        })
    }

    /// Width and height of the frames that it takes [px].
    #[must_use]
    pub const fn frame_size(&self) -> [u32; 2] {
        self.frame
    }

    /// The undistorted pixel (u, v) at the centre of the rectified picture's pixel (0, 0) [px].
    #[must_use]
    pub const fn origin(&self) -> [i32; 2] {
        self.origin
    }

    /// `flat` becomes the frame without its lens, between pixels bilinearly. Linear in the pixels; nothing is
    /// allocated where `flat` has the size already.
    ///
    /// # Panics
    /// If the frame has another size than was said.
    pub fn rectify(&self, frame: &GrayImage, flat: &mut GrayImage) {
        let [width, height] = self.frame;
        assert_eq!(frame.dimensions(), (width, height), "another frame's lens");
        let [columns, rows] = self.size;
        if flat.dimensions() != (columns, rows) {
            *flat = GrayImage::from_pixel(columns, rows, Luma([0]));
        }
        let (pixels, stride) = (frame.as_raw().as_slice(), width as usize);
        for (value, tap) in flat.iter_mut().zip(&self.taps) {
            *value = tap.value(pixels, stride);
        }
    }
}

impl Tap {
    fn at(PixelPoint { u, v }: PixelPoint, [width, height]: [u32; 2]) -> Self {
        // the last column and row are read through the pixel before them: its neighbour must exist
        let fixed = |x: f64, size: u32| {
            let (last, most) = (size - 2, 256 * (size - 1));
            let at = ((256.0 * x).round().max(0.0) as u32).min(most);
            let whole = (at >> 8).min(last);
            (whole, (at - (whole << 8)) as u16)
        };
        let ((column, right), (row, below)) = (fixed(u, width), fixed(v, height));
        Self {
            index: row * width + column,
            right,
            below,
        }
    }

    #[inline]
    fn value(self, pixels: &[u8], stride: usize) -> u8 {
        let (right, below) = (u32::from(self.right), u32::from(self.below));
        let row = |from: usize| match pixels.get(from..from + 2) {
            Some(&[a, b]) => 256 * u32::from(a) + right * u32::from(b) - right * u32::from(a),
            _ => 0,
        };
        let at = self.index as usize;
        let (upper, lower) = (row(at), row(at + stride));
        ((upper * (256 - below) + lower * below + (1 << 15)) >> 16) as u8
    }
}

/// What rounding may move a border by [px].
const ROUNDING_PX: f64 = 1e-6;

/// Left, top, right and bottom undistorted pixel of the largest upright rectangle that the frame shows whole.
fn seen_whole(lens: &Lens, [width, height]: [u32; 2]) -> Option<[i32; 4]> {
    let (last_u, last_v) = (f64::from(width) - 1.0, f64::from(height) - 1.0);
    let reach = |extent: f64| BEYOND * (extent + 1.0);
    let mut bounds = [
        -reach(last_u),
        -reach(last_v),
        last_u + reach(last_u),
        last_v + reach(last_v),
    ];
    let ideal = |u: f64, v: f64| lens.undistort(PixelPoint::new(u, v));
    // what the lens cannot have imaged bounds nothing here; it is looked for below
    for v in (0..height).map(f64::from) {
        bounds[0] = ideal(0.0, v).map_or(bounds[0], |p| bounds[0].max(p.u));
        bounds[2] = ideal(last_u, v).map_or(bounds[2], |p| bounds[2].min(p.u));
    }
    for u in (0..width).map(f64::from) {
        bounds[1] = ideal(u, 0.0).map_or(bounds[1], |p| bounds[1].max(p.v));
        bounds[3] = ideal(u, last_v).map_or(bounds[3], |p| bounds[3].min(p.v));
    }
    let mut found = [
        (bounds[0] - ROUNDING_PX).ceil() as i32,
        (bounds[1] - ROUNDING_PX).ceil() as i32,
        (bounds[2] + ROUNDING_PX).floor() as i32,
        (bounds[3] + ROUNDING_PX).floor() as i32,
    ];
    let seen = |u: i32, v: i32| {
        let place = lens.distort(PixelPoint::new(f64::from(u), f64::from(v)));
        place.is_some_and(|p| {
            let within = |x: f64, last: f64| (-0.01..=last + 0.01).contains(&x);
            within(p.u, last_u) && within(p.v, last_v)
        })
    };
    // corners beyond the model's reach: drawn in until all four are seen, and with them what lies between
    while found[2] > found[0] && found[3] > found[1] {
        let [left, top, right, bottom] = found;
        if [(left, top), (right, top), (left, bottom), (right, bottom)]
            .iter()
            .all(|&(u, v)| seen(u, v))
        {
            return Some(found);
        }
        found = [left + 1, top + 1, right - 1, bottom - 1];
    }
    None
}

impl FloorCamera {
    /// The camera of undistorted pixels: the same, its lens undone.
    #[must_use]
    pub fn rectified(&self) -> Self {
        Self {
            lens: self.lens.as_ref().map(Lens::without_distortion),
            ..self.clone()
        }
    }
}
