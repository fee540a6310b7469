//! Any bytes as a camera file: refused in one line, or a camera that survives writing.
#![no_main]

use std::fs;

use libfuzzer_sys::fuzz_target;
use mobot_fuzz::{folder, one_line};
use monocal::{FloorCamera, Rectifier};

/// A small frame: more pixels only take longer.
const FRAME: [u32; 2] = [24, 16];

fuzz_target!(|data: &[u8]| {
    let path = folder().join("camera.json");
    fs::write(&path, data).expect("written");
    match FloorCamera::load(&path) {
        Ok(camera) => {
            if let Some(point) = camera.floor_point([10.0, 200.0].into()) {
                assert!(point.x.is_finite() && point.y.is_finite());
            }
            if let Some(rectifier) = camera.lens.and_then(|lens| Rectifier::new(&lens, FRAME)) {
                let frame = image::GrayImage::new(FRAME[0], FRAME[1]);
                rectifier.rectify(&frame, &mut image::GrayImage::default());
            }
            let _ = camera.geometry();
            fs::write(&path, camera.to_json()).expect("written");
            FloorCamera::load(&path).expect("its own file");
        }
        Err(error) => one_line(&error),
    }
});
