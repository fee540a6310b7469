//! Patterns on surfaces, averaged over what one pixel sees of them.

use super::building::Texture;
use crate::real::{floor, sin_cos};

/// Factor on a surface's brightness at `(u, v)` [m], averaged over a pixel that covers `du` by `dv` [m].
pub(crate) fn factor(texture: &Texture, u: f64, v: f64, du: f64, dv: f64) -> f64 {
    match *texture {
        Texture::Plain => 1.0,
        Texture::Tiles {
            size,
            joint,
            contrast,
        } => {
            let bare = (1.0 - share(u, du, size, joint)) * (1.0 - share(v, dv, size, joint));
            let tile = lattice(floor(u / size), floor(v / size)) - 0.5;
            let near = fade(du.max(dv), size);
            1.0 - contrast * (1.0 - bare) + 0.4 * contrast * tile * near * bare
        }
        Texture::Speckle { grain, contrast } => {
            let width = du.max(dv);
            let fine = (noise(u / grain, v / grain) - 0.5) * fade(width, grain);
            let coarse =
                (noise(u / (5.0 * grain), v / (5.0 * grain)) - 0.5) * fade(width, 5.0 * grain);
            1.0 + contrast * (1.2 * fine + 0.8 * coarse)
        }
        Texture::Stripes {
            period,
            contrast,
            angle,
        } => {
            let (sin, cos) = sin_cos(angle);
            let across = cos * u + sin * v;
            let width = (cos * du).abs() + (sin * dv).abs();
            1.0 - contrast * share(across, width, period, period / 2.0)
        }
    }
}

/// How much of `x - width/2 .. x + width/2` lies in the first `part` of a period.
fn share(x: f64, width: f64, period: f64, part: f64) -> f64 {
    let width = width.max(1e-6);
    let until = |x: f64| {
        let whole = floor(x / period) as f64;
        whole * part + (x - whole * period).min(part)
    };
    (until(x + width / 2.0) - until(x - width / 2.0)) / width
}

/// What is left of a pattern of this size under a pixel of this width.
fn fade(width: f64, size: f64) -> f64 {
    let r = width / size;
    1.0 / (1.0 + r * r)
}

/// A fixed random number for a lattice point, 0 to 1.
fn lattice(i: i64, j: i64) -> f64 {
    let mut h = (i as u64)
        .wrapping_mul(0x9E37_79B9_7F4A_7C15)
        .wrapping_add((j as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F));
    h ^= h >> 29;
    h = h.wrapping_mul(0xBF58_476D_1CE4_E5B9);
    f64::from((h >> 40) as u32) / f64::from(1_u32 << 24)
}

/// Value noise, 0 to 1, one grain a unit.
fn noise(x: f64, y: f64) -> f64 {
    let (i, j) = (floor(x), floor(y));
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (smooth(x - i as f64), smooth(y - j as f64));
    let (a, b) = (lattice(i, j), lattice(i + 1, j));
    let (c, d) = (lattice(i, j + 1), lattice(i + 1, j + 1));
    (a + (b - a) * fx) * (1.0 - fy) + (c + (d - c) * fx) * fy
}
