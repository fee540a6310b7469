//! Where on the floor each pixel looks, in polar coordinates around the camera's foot. Whatever stands on
//! a place is seen in the same direction as its foot: a plumb line has one bearing.

use crate::floor_view::FloorView;

/// Range and direction of every pixel's floor point; made once a camera and picture size.
#[derive(Debug, Default)]
pub(super) struct Fan {
    pub(super) size: [usize; 2],
    /// From the camera's foot [m]; infinite above the horizon and past the greatest range.
    pub(super) range: Vec<f32>,
    /// Number of the direction, from right to left; only where the range is finite.
    pub(super) direction: Vec<u16>,
    /// Bearing of the first direction's middle, and from one to the next [rad].
    first: f64,
    step: f64,
}

impl Fan {
    pub(super) fn new(view: &FloorView, size: [usize; 2], max_range: f64) -> Self {
        let [w, h] = size;
        let foot = view.camera_foot();
        let mut range = vec![f32::INFINITY; w * h];
        let mut bearing = vec![0.0; w * h];
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for (i, (range, bearing)) in range.iter_mut().zip(&mut bearing).enumerate() {
            let Some(p) = view.floor_point([(i % w) as f64, (i / w) as f64]) else {
                continue;
            };
            let [x, y] = [p[0] - foot[0], p[1] - foot[1]];
            if x.hypot(y) <= max_range {
                (*range, *bearing) = (x.hypot(y) as f32, y.atan2(x));
                (least, most) = (f64::min(least, *bearing), f64::max(most, *bearing));
            }
        }
        // as many directions as columns, so that each has about a pixel a row
        let step = ((most - least) / w.min(usize::from(u16::MAX)) as f64).max(1e-9);
        let number = |(range, bearing): (&f32, &f64)| {
            if range.is_finite() {
                ((bearing - least) / step) as u16
            } else {
                0
            }
        };
        Self {
            size,
            direction: range.iter().zip(&bearing).map(number).collect(),
            range,
            first: least + step / 2.0,
            step,
        }
    }

    /// How many directions there are.
    pub(super) fn directions(&self) -> usize {
        self.size[0] + 1
    }

    /// Bearing of a direction, to the left of the base's x axis [rad].
    pub(super) fn bearing(&self, direction: usize) -> f64 {
        self.first + direction as f64 * self.step
    }

    /// Angle between neighbouring directions [rad].
    pub(super) fn step(&self) -> f64 {
        self.step
    }
}
