//! The floor as seen from above.

use image::{ImageBuffer, Pixel, Primitive};

use crate::{FloorCamera, GroundPoint, PixelPoint};

/// Which part of the floor to draw, and how finely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BirdseyeParams {
    /// Nearest `x` [m].
    pub near: f64,
    /// Farthest `x` [m], above `near`.
    pub far: f64,
    /// Largest `y`, at the left edge [m].
    pub left: f64,
    /// Smallest `y`, at the right edge [m], below `left`.
    pub right: f64,
    /// Side of a pixel of the picture [m], above 0; half of it costs four times the time and memory.
    pub metres_per_pixel: f64,
}

/// The floor from above: `x` upwards, `y` to the left.
#[derive(Debug, Clone)]
pub struct Birdseye<P: Pixel> {
    /// The picture; black where the camera does not see the floor.
    pub picture: ImageBuffer<P, Vec<P::Subpixel>>,
    /// Side of a pixel [m].
    pub metres_per_pixel: f64,
    /// The floor point at the centre of the picture's pixel (0, 0), its far left corner.
    pub origin: GroundPoint,
}

/// The largest bird's-eye picture [px].
pub const MOST_BIRDSEYE_PIXELS: f64 = 64e6;

/// A floor of no extent or too many pixels.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("expected 1 to {MOST_BIRDSEYE_PIXELS} pixels of floor, found {width} x {height}")]
pub struct BirdseyeError {
    /// Columns that were asked for.
    pub width: f64,
    /// Rows that were asked for.
    pub height: f64,
}

impl BirdseyeParams {
    /// The floor that a picture of this size shows, where a pixel covers no more than `coarsest` [m] from
    /// row to row, in pixels that are as fine as the picture is there at its best, but at most about `most`
    /// across; `None` where no floor is seen that well.
    #[must_use]
    pub fn of_view(
        camera: &FloorCamera,
        [width, height]: [u32; 2],
        coarsest: f64,
        most: u32,
    ) -> Option<Self> {
        const STEPS: u32 = 64;
        let step =
            |size: u32, k: u32| f64::from(size.saturating_sub(1)) * f64::from(k) / f64::from(STEPS);
        let [mut near, mut far, mut left, mut right] = [
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NEG_INFINITY,
            f64::INFINITY,
        ];
        let mut finest = f64::INFINITY;
        for k in 0..=STEPS {
            for l in 0..=STEPS {
                let pixel = PixelPoint::new(step(width, k), step(height, l));
                let Some((point, size)) = camera.floor_point(pixel).zip(camera.footprint(pixel))
                else {
                    continue;
                };
                if size > coarsest {
                    continue;
                }
                near = near.min(point.x);
                far = far.max(point.x);
                left = left.max(point.y);
                right = right.min(point.y);
                finest = finest.min(size);
            }
        }
        let extent = (far - near).max(left - right);
        (extent.is_finite() && extent > 0.0).then(|| Self {
            near,
            far,
            left,
            right,
            metres_per_pixel: finest.max(extent / f64::from(most.max(1))),
        })
    }

    fn size(&self) -> Result<[u32; 2], BirdseyeError> {
        let width = ((self.left - self.right) / self.metres_per_pixel).ceil();
        let height = ((self.far - self.near) / self.metres_per_pixel).ceil();
        let fits = self.metres_per_pixel > 0.0
            && width >= 1.0
            && height >= 1.0
            && width * height <= MOST_BIRDSEYE_PIXELS;
        if fits {
            Ok([width as u32, height as u32])
        } else {
            Err(BirdseyeError { width, height })
        }
    }
}

impl FloorCamera {
    /// The longer side of a pixel on the floor [m]; `None` above the horizon.
    #[must_use]
    pub fn footprint(&self, pixel: PixelPoint) -> Option<f64> {
        let ideal = match &self.lens {
            Some(lens) => lens.undistort(pixel)?,
            None => pixel,
        };
        let [[a, b], [c, d]] = self.homography.jacobian(ideal)?;
        let size = a.hypot(c).max(b.hypot(d));
        size.is_finite().then_some(size)
    }
}

/// Draws the floor as seen from above, between pixels bilinearly, the lens undone.
///
/// # Errors
/// [`BirdseyeError`] for a floor of no extent or more than [`MOST_BIRDSEYE_PIXELS`].
pub fn birdseye<P>(
    frame: &ImageBuffer<P, Vec<P::Subpixel>>,
    camera: &FloorCamera,
    params: &BirdseyeParams,
) -> Result<Birdseye<P>, BirdseyeError>
where
    P: Pixel,
    P::Subpixel: Into<f64>,
{
    let [width, height] = params.size()?;
    let side = params.metres_per_pixel;
    let origin = GroundPoint::new(params.far - side / 2.0, params.left - side / 2.0);
    let blank = *P::from_slice(&vec![
        P::Subpixel::DEFAULT_MIN_VALUE;
        usize::from(P::CHANNEL_COUNT)
    ]);
    let picture = ImageBuffer::from_fn(width, height, |column, row| {
        let x = origin.x - side * f64::from(row);
        let y = origin.y - side * f64::from(column);
        camera
            .pixel_of(GroundPoint::new(x, y))
            .and_then(|pixel| between(frame, pixel))
            .unwrap_or(blank)
    });
    Ok(Birdseye {
        picture,
        metres_per_pixel: side,
        origin,
    })
}

/// The value between four pixel centres; `None` outside of them.
fn between<P>(frame: &ImageBuffer<P, Vec<P::Subpixel>>, at: PixelPoint) -> Option<P>
where
    P: Pixel,
    P::Subpixel: Into<f64>,
{
    let (width, height) = frame.dimensions();
    let inside = at.u >= 0.0
        && at.v >= 0.0
        && at.u <= f64::from(width) - 1.0
        && at.v <= f64::from(height) - 1.0;
    if !inside {
        return None;
    }
    let (column, row) = (at.u as u32, at.v as u32);
    let (a, b) = (at.u - f64::from(column), at.v - f64::from(row));
    let next = |k: u32, size: u32| (k + 1).min(size - 1);
    let corner = |c: u32, r: u32| frame.get_pixel(c, r).channels();
    let corners = [
        (corner(column, row), (1.0 - a) * (1.0 - b)),
        (corner(next(column, width), row), a * (1.0 - b)),
        (corner(column, next(row, height)), (1.0 - a) * b),
        (corner(next(column, width), next(row, height)), a * b),
    ];
    let mut value = *frame.get_pixel(column, row);
    for (k, channel) in value.channels_mut().iter_mut().enumerate() {
        let mixed: f64 = corners
            .iter()
            .map(|(pixel, weight)| weight * pixel[k].into())
            .sum();
        *channel = num_of(mixed)?;
    }
    Some(value)
}

fn num_of<S: Primitive>(value: f64) -> Option<S> {
    S::from(value.round())
}
