//! Made-up pictures, the same as `testdata/golden/make_canny.py` makes, and the frames of `testdata/`.

use std::path::{Path, PathBuf};

use image::{GrayImage, Luma};

pub(crate) const KINDS: [&str; 9] = [
    "noise", "faint", "binary", "blocks", "ramp", "waves", "dots", "flat", "disk",
];

/// splitmix64's finalizer.
pub(crate) fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let value = (value ^ value >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let value = (value ^ value >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    value ^ value >> 31
}

/// A picture of one of the [`KINDS`].
pub(crate) fn picture(kind: &str, seed: u64, width: u32, height: u32) -> GrayImage {
    let s = seed as i64;
    GrayImage::from_fn(width, height, |u, v| {
        let (w, h, u, v) = (
            i64::from(width),
            i64::from(height),
            i64::from(u),
            i64::from(v),
        );
        let random = mix((s * 1_000_003 + v * w + u) as u64);
        let byte = (random & 255) as i64;
        let value = match kind {
            "noise" => byte,
            "faint" => 100 + byte % (2 + s % 14),
            "binary" => byte % 2 * 255,
            "blocks" => {
                let side = 3 + s % 9;
                (mix((s * 7919 + v / side * 1009 + u / side) as u64) & 255) as i64
            }
            "ramp" => (u * (1 + s % 5) + v * (s % 11) + byte % (1 + s % 7)) & 255,
            "waves" => {
                let phase = (u * (3 + s % 29) + v * (s % 31)) / 8 % 128;
                phase.min(127 - phase) * 3 + byte % (1 + s % 7)
            }
            "dots" if byte % 17 == 0 => (random >> 8 & 255) as i64,
            "dots" => 0,
            "flat" => s % 256,
            "disk" => {
                let radius = 1 + s % (1 + w.max(h) / 2);
                let inside = (u - w / 2).pow(2) + (v - h / 2).pow(2) < radius * radius;
                (if inside { 200 } else { 60 }) + byte % (1 + s % 7)
            }
            _ => panic!("no such kind: {kind}"),
        };
        Luma([value as u8])
    })
}

pub(crate) fn testdata(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../testdata")
        .join(path)
}

/// A gray picture of the test data, pixel by pixel as it is in the file.
pub(crate) fn gray(path: &str) -> GrayImage {
    image::open(testdata(path)).expect(path).into_luma8()
}
