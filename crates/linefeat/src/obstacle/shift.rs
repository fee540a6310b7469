//! By how much the last frame is off where odometry puts it: a nod of the camera, a turn that slipped.
//!
//! That shifts all of the picture, and a thing that moves but a part of it: half of the picture's strips
//! must agree better under a shift, or it is not believed.

use super::fan::Fan;
use super::memory::Memory;
use crate::floor_view::times;

/// Every how many pixels the frames are compared.
const STRIDE: usize = 4;

/// Upright strips of the picture.
const STRIPS: usize = 8;

/// Most that is looked for along u and v [px].
const MOST: [i32; 2] = [6, 12];

/// The difference that a shift leaves, over that without it, must be below this to be believed.
const WORTH: f64 = 0.93;

/// A place between the pixels is believed where a pixel beside it adds at least this share of the
/// difference.
const BEND: f64 = 0.1;

/// Differences above this are all the same [gray levels].
const MOST_DIFFERENT: i32 = 40;

/// How the last frame is to be read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shift {
    /// To add to a place in the last frame [px].
    pub(super) by: [f64; 2],
    /// This frame's brightness over the last one's [gray levels].
    pub(super) brighter: f64,
    /// Standard deviation of a pixel's difference [gray levels].
    pub(super) noise: f64,
}

/// Finds shifts; keeps its buffers.
#[derive(Debug, Default)]
pub(super) struct Shifter {
    places: Vec<Place>,
    differences: Vec<i32>,
}

/// A value of this frame's floor and where the last frame should show the same.
#[derive(Clone, Copy, Debug)]
struct Place {
    strip: usize,
    value: i32,
    then: [i32; 2],
}

/// How the frames differ under a shift.
#[derive(Clone, Copy, Debug)]
struct Spread {
    median: f64,
    /// Mean absolute deviation from the median, a strip; infinite where nothing is seen twice.
    strips: [f64; STRIPS],
    noise: f64,
}

impl Spread {
    /// The difference over that of another, such that half of the strips have no greater one.
    fn over(&self, other: &Self) -> f64 {
        let mut shares: [f64; STRIPS] =
            std::array::from_fn(|i| (self.strips[i] + 0.1) / (other.strips[i] + 0.1));
        for share in &mut shares {
            if share.is_nan() {
                *share = 1.0;
            }
        }
        *shares.select_nth_unstable_by(STRIPS / 2, f64::total_cmp).1
    }
}

impl Shifter {
    pub(super) fn shift(
        &mut self,
        current: &Memory,
        previous: &Memory,
        warp: &[[f64; 3]; 3],
        fan: &Fan,
    ) -> Shift {
        self.take_places(current, warp, fan);
        let at_rest = self.measure(previous, [0, 0]);
        let mut best = ([0, 0], 1.0);
        // first the nod, which is the larger, then the turn, then both once more
        for axis in [1, 0, 1] {
            let start = best.0;
            for step in -MOST[axis]..=MOST[axis] {
                let mut by = start;
                by[axis] = step;
                let share = self.measure(previous, by).over(&at_rest);
                if share < best.1 {
                    best = (by, share);
                }
            }
        }
        let by = if best.1 < WORTH { best.0 } else { [0, 0] };
        let found = self.measure(previous, by);
        let between: [f64; 2] = std::array::from_fn(|axis| {
            let mut beside = |step: i32| {
                let mut by = by;
                by[axis] += step;
                self.measure(previous, by).over(&found)
            };
            let (less, more) = (beside(-1), beside(1));
            let bend = less + more - 2.0;
            if bend > 2.0 * BEND {
                ((less - more) / (2.0 * bend)).clamp(-0.5, 0.5)
            } else {
                0.0
            }
        });
        Shift {
            by: [0, 1].map(|axis| f64::from(by[axis]) + between[axis]),
            brighter: found.median,
            noise: found.noise,
        }
    }

    fn take_places(&mut self, current: &Memory, warp: &[[f64; 3]; 3], fan: &Fan) {
        let [w, h] = current.size();
        let most = w.div_ceil(STRIDE) * h.div_ceil(STRIDE);
        self.places.clear();
        self.places.reserve(most);
        self.differences.clear();
        self.differences.reserve(most);
        for v in (0..h).step_by(STRIDE) {
            for u in (0..w).step_by(STRIDE) {
                if fan.range[v * w + u].is_infinite() {
                    continue;
                }
                let [x, y, z] = times(warp, [u as f64, v as f64, 1.0]);
                let then = [x / z, y / z];
                if then.iter().all(|c| c.abs() < 1e6) {
                    self.places.push(Place {
                        strip: u * STRIPS / w,
                        value: i32::from(current.smooth[v * w + u]),
                        then: then.map(|c| c.round() as i32),
                    });
                }
            }
        }
    }

    fn measure(&mut self, previous: &Memory, by: [i32; 2]) -> Spread {
        let [w, h] = previous.size();
        let difference = |place: &Place| {
            let [u, v] = [0, 1].map(|axis| place.then[axis] + by[axis]);
            let inside = u >= 0 && v >= 0 && (u as usize) < w && (v as usize) < h;
            inside.then(|| place.value - i32::from(previous.smooth[v as usize * w + u as usize]))
        };
        self.differences.clear();
        self.differences
            .extend(self.places.iter().filter_map(difference));
        let median = middle(&mut self.differences);
        self.differences.clear();
        let (mut sums, mut counts) = ([0; STRIPS], [0; STRIPS]);
        for place in &self.places {
            if let Some(difference) = difference(place) {
                let off = (difference - median).abs().min(MOST_DIFFERENT);
                sums[place.strip] += off;
                counts[place.strip] += 1;
                self.differences.push(off);
            }
        }
        Spread {
            median: f64::from(median),
            strips: std::array::from_fn(|i| {
                if counts[i] == 0 {
                    f64::INFINITY
                } else {
                    f64::from(sums[i]) / f64::from(counts[i])
                }
            }),
            // of a normal distribution; whole levels hide half a level
            noise: 1.4826 * (f64::from(middle(&mut self.differences)) + 0.5),
        }
    }
}

/// The median, 0 of nothing; changes the order.
fn middle(values: &mut [i32]) -> i32 {
    if values.is_empty() {
        return 0;
    }
    *values.select_nth_unstable(values.len() / 2).1
}
