//! What the picture shows before and behind a line.

use image::GrayImage;

use super::plane::Plane;
use crate::Segment;

/// Places along a segment.
const PLACES: u32 = 15;
/// Distances from the line at which either side is looked at [px]: past the blur, before the next thing.
const BESIDE: [f64; 3] = [2.5, 3.5, 4.5];
/// Distances behind the line at which a thin one is over: the floor goes on behind a joint of tiles [px].
const BEHIND: [f64; 2] = [5.0, 6.0];
/// Distances towards the camera's foot at which the floor is looked at [px].
const BEFORE: [f64; 6] = [8.0, 12.0, 16.0, 22.0, 30.0, 40.0];
/// Differences of gray level that mean nothing, to begin with.
const NOISE: f64 = 3.0;

/// Distance of the quartiles of a normal distribution in sigmas.
const QUARTILES: f64 = 1.35;

/// Gray levels around a segment, medians over its length.
pub(super) struct Surroundings {
    /// Just before it, on the camera's side.
    near: f64,
    /// Just behind it.
    far: f64,
    /// A little farther behind it.
    behind: Option<f64>,
    /// Farther before it, down to the camera's foot.
    before: Option<f64>,
    /// How much the levels just before it differ along it.
    spread: f64,
}

impl Surroundings {
    pub(super) fn of(image: &GrayImage, segment: &Segment, plane: &Plane) -> Self {
        let mut sides = [[0_u8; PLACES as usize * BESIDE.len()]; 2];
        let mut counts = [0; 2];
        let mut before = [0_u8; PLACES as usize * BEFORE.len()];
        let mut count = 0;
        let mut behind = [0_u8; PLACES as usize * BEHIND.len()];
        let mut count_behind = 0;
        for k in 0..PLACES {
            let share = (f64::from(k) + 0.5) / f64::from(PLACES);
            let p = [0, 1].map(|i| segment.start[i] + share * (segment.end[i] - segment.start[i]));
            let down = plane.down(p);
            let mut normal = [segment.theta.cos(), segment.theta.sin()];
            if normal[0] * down[0] + normal[1] * down[1] < 0.0 {
                normal = [-normal[0], -normal[1]];
            }
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                for d in BESIDE {
                    let at = [p[0] + sign * d * normal[0], p[1] + sign * d * normal[1]];
                    if let Some(level) = level(image, at) {
                        sides[side][counts[side]] = level;
                        counts[side] += 1;
                    }
                }
            }
            for d in BEHIND {
                let at = [p[0] - d * normal[0], p[1] - d * normal[1]];
                if let Some(level) = level(image, at) {
                    behind[count_behind] = level;
                    count_behind += 1;
                }
            }
            // as far from the line, whatever angle it makes with the way down
            let slant = (normal[0] * down[0] + normal[1] * down[1]).max(0.3);
            for d in BEFORE {
                let at = [p[0] + d / slant * down[0], p[1] + d / slant * down[1]];
                if let Some(level) = level(image, at) {
                    before[count] = level;
                    count += 1;
                }
            }
        }
        let [near, far] = &mut sides;
        let near = &mut near[..counts[0]];
        let middle = median(near).unwrap_or(0.0);
        let quarter = |share: usize| {
            near.get(near.len() * share / 4)
                .map_or(0.0, |&l| f64::from(l))
        };
        Self {
            near: middle,
            far: median(&mut far[..counts[1]]).unwrap_or(middle),
            behind: median(&mut behind[..count_behind]),
            before: median(&mut before[..count]),
            spread: quarter(3) - quarter(1),
        }
    }

    /// One sigma of the gray levels just before it, along it.
    pub(super) fn texture(&self) -> f64 {
        self.spread / QUARTILES
    }

    /// How much it looks like floor before the line and like something else behind it, 0 to 1.
    pub(super) fn floor_confidence(&self) -> f64 {
        let step = (self.far - self.near).abs();
        let step = self
            .behind
            .map_or(step, |b| step.min((b - self.near).abs()));
        let differs = step / (step + NOISE + 0.5 * self.spread);
        let same = match self.before {
            Some(before) => {
                let off = (before - self.near).abs() / (NOISE + self.spread + 0.4 * step);
                1.0 / (1.0 + off * off)
            }
            // at the picture's lower border nothing speaks against it
            None => 0.8,
        };
        differs * same
    }
}

fn level(image: &GrayImage, [u, v]: [f64; 2]) -> Option<u8> {
    let (u, v) = (u.round(), v.round());
    let inside =
        u >= 0.0 && v >= 0.0 && u < f64::from(image.width()) && v < f64::from(image.height());
    inside.then(|| image.as_raw()[v as usize * image.width() as usize + u as usize])
}

/// Sorts the levels; their median, if there are enough to speak of one.
fn median(levels: &mut [u8]) -> Option<f64> {
    levels.sort_unstable();
    (levels.len() >= 8).then(|| f64::from(levels[levels.len() / 2]))
}
