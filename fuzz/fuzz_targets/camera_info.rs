//! Any bytes as a camera_info YAML: refused in one line, or a lens whose pixels are numbers.
#![no_main]

use std::fs;

use libfuzzer_sys::fuzz_target;
use mobot_fuzz::{folder, one_line};
use monocal::CameraInfo;

fuzz_target!(|data: &[u8]| {
    let path = folder().join("info.yaml");
    fs::write(&path, data).expect("written");
    match CameraInfo::load(&path) {
        Ok(info) => {
            let [width, height] = info.image_size;
            for pixel in [[0.0, 0.0], [f64::from(width), f64::from(height)]] {
                if let Some(pixel) = info.lens.undistort(pixel.into()) {
                    assert!(pixel.u.is_finite() && pixel.v.is_finite());
                }
            }
        }
        Err(error) => one_line(&error),
    }
});
