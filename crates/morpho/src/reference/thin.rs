//! Thinning by its definition, pixel by pixel.

use crate::BitImage;

/// The eight neighbours of a pixel, clockwise from north: the literature's P2 .. P9. Outside is background.
pub(super) fn neighbours(image: &BitImage, x: usize, y: usize) -> [bool; 8] {
    const AROUND: [(usize, usize); 8] = [
        (1, 0),
        (2, 0),
        (2, 1),
        (2, 2),
        (1, 2),
        (0, 2),
        (0, 1),
        (0, 0),
    ];
    AROUND.map(|(dx, dy)| x + dx > 0 && y + dy > 0 && image.get(x + dx - 1, y + dy - 1))
}

/// The twin of [`crate::thin::zhang_suen`].
#[must_use]
pub fn zhang_suen(image: &BitImage) -> BitImage {
    until_stable(image, |p, second| {
        let transitions = (0..8).filter(|&i| !p[i] && p[(i + 1) % 8]).count();
        let count = p.iter().filter(|&&set| set).count();
        let [north, east, south, west] = [p[0], p[2], p[4], p[6]];
        let (one, two) = if second {
            (north && east && west, north && south && west)
        } else {
            (north && east && south, east && south && west)
        };
        transitions == 1 && (2..=6).contains(&count) && !one && !two
    })
}

/// The twin of [`crate::thin::guo_hall`].
#[must_use]
pub fn guo_hall(image: &BitImage) -> BitImage {
    until_stable(image, |p, second| {
        let components = (0..4)
            .filter(|i| !p[2 * i] && (p[2 * i + 1] || p[(2 * i + 2) % 8]))
            .count();
        let pairs = |first: usize| {
            (0..4)
                .filter(|i| p[(2 * i + first) % 8] || p[(2 * i + first + 1) % 8])
                .count()
        };
        let count = pairs(0).min(pairs(7));
        let kept = if second {
            (p[0] || p[1] || !p[3]) && p[2]
        } else {
            (p[4] || p[5] || !p[7]) && p[6]
        };
        components == 1 && (2..=3).contains(&count) && !kept
    })
}

/// Deletes, in two alternating parallel passes, what `deletable` says, until a round changes nothing.
/// The outermost rows and columns are never deleted, as in OpenCV.
fn until_stable(image: &BitImage, deletable: impl Fn([bool; 8], bool) -> bool) -> BitImage {
    let mut now = image.clone();
    loop {
        let before = now.clone();
        for second in [false, true] {
            let old = now.clone();
            for y in 1..now.height().saturating_sub(1) {
                for x in 1..now.width().saturating_sub(1) {
                    if old.get(x, y) && deletable(neighbours(&old, x, y), second) {
                        now.set(x, y, false);
                    }
                }
            }
        }
        if now == before {
            return now;
        }
    }
}
