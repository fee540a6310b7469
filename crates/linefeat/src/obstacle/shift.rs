//! By how much the last frame is off where odometry puts it: a nod of the camera, a turn that slipped.

use super::change::Memory;
use super::fan::Fan;
use crate::floor_view::times;

/// Every how many pixels the frames are compared.
const STRIDE: usize = 4;

/// Most that is looked for along u and v [px].
const MOST: [i32; 2] = [6, 12];

/// A shift must explain this much of the difference to be believed.
const WORTH: f64 = 0.93;

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

pub(super) fn shift(current: &Memory, previous: &Memory, warp: &[[f64; 3]; 3], fan: &Fan) -> Shift {
    let places = places(current, warp, fan);
    let [w, h] = current.size();
    let mut differences = Vec::with_capacity(places.len());
    let mut measure = |by: [i32; 2]| {
        differences.clear();
        for &(value, [u, v]) in &places {
            let (u, v) = (u + by[0], v + by[1]);
            if u >= 0 && v >= 0 && (u as usize) < w && (v as usize) < h {
                differences.push(value - i32::from(previous.smooth[v as usize * w + u as usize]));
            }
        }
        spread(&mut differences)
    };
    let at_rest = measure([0, 0]);
    let mut best = ([0, 0], at_rest);
    // first the nod, which is the larger, then the turn, then both once more
    for axis in [1, 0, 1] {
        let start = best.0;
        for step in -MOST[axis]..=MOST[axis] {
            let mut by = start;
            by[axis] = step;
            let found = measure(by);
            if found.mean < best.1.mean {
                best = (by, found);
            }
        }
    }
    let (by, found) = if best.1.mean < WORTH * at_rest.mean {
        best
    } else {
        ([0, 0], at_rest)
    };
    let by = std::array::from_fn(|axis| {
        let mut beside = |step: i32| {
            let mut by = by;
            by[axis] += step;
            measure(by).mean
        };
        let (less, more) = (beside(-1), beside(1));
        let bend = less + more - 2.0 * found.mean;
        let offset = if bend > 0.0 {
            (less - more) / (2.0 * bend)
        } else {
            0.0
        };
        f64::from(by[axis]) + offset.clamp(-0.5, 0.5)
    });
    Shift {
        by,
        brighter: found.median,
        noise: found.noise,
    }
}

/// Values of this frame's floor and where the last frame should show the same.
fn places(current: &Memory, warp: &[[f64; 3]; 3], fan: &Fan) -> Vec<(i32, [i32; 2])> {
    let [w, h] = current.size();
    let mut places = Vec::with_capacity(w * h / (STRIDE * STRIDE));
    for v in (0..h).step_by(STRIDE) {
        for u in (0..w).step_by(STRIDE) {
            if fan.range[v * w + u].is_infinite() {
                continue;
            }
            let pixel = [u as f64, v as f64];
            let [x, y, z] = times(warp, [pixel[0], pixel[1], 1.0]);
            let place = [x / z, y / z];
            if place.iter().all(|c| c.abs() < 1e6) {
                places.push((
                    i32::from(current.smooth[v * w + u]),
                    place.map(|c| c.round() as i32),
                ));
            }
        }
    }
    places
}

#[derive(Clone, Copy, Debug)]
struct Spread {
    median: f64,
    /// Of the absolute deviation from the median, each at most 40.
    mean: f64,
    noise: f64,
}

fn spread(differences: &mut [i32]) -> Spread {
    if differences.is_empty() {
        return Spread {
            median: 0.0,
            mean: f64::INFINITY,
            noise: 0.0,
        };
    }
    let middle = differences.len() / 2;
    let median = *differences.select_nth_unstable(middle).1;
    for d in differences.iter_mut() {
        *d = (*d - median).abs().min(40);
    }
    let sum: i32 = differences.iter().sum();
    let deviation = *differences.select_nth_unstable(middle).1;
    Spread {
        median: f64::from(median),
        mean: f64::from(sum) / differences.len() as f64,
        // of a normal distribution; whole levels hide half a level
        noise: 1.4826 * (f64::from(deviation) + 0.5),
    }
}
