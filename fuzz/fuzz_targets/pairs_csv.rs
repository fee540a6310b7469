//! Any bytes as calibration pairs: refused in one line, or pairs that calibrate or say why not.
#![no_main]

use libfuzzer_sys::fuzz_target;
use mobot_fuzz::one_line;
use monocal::{CalibrateParams, Noise, calibrate, read_pairs};

/// More pairs only take longer.
const MOST: usize = 12;

fuzz_target!(|data: &[u8]| {
    match read_pairs(data) {
        Ok(mut pairs) => {
            pairs.truncate(MOST);
            for noise in [Noise::Pixel, Noise::Floor, Noise::Both] {
                let params = CalibrateParams {
                    noise,
                    ..CalibrateParams::default()
                };
                match calibrate(&pairs, &params) {
                    Ok(found) => {
                        let numbers = found.camera.homography.pixel_to_floor();
                        assert!(numbers.iter().flatten().all(|n| n.is_finite()));
                        assert!(
                            found
                                .camera
                                .covariance
                                .iter()
                                .flatten()
                                .all(|n| n.is_finite())
                        );
                    }
                    Err(error) => one_line(&error),
                }
            }
        }
        Err(error) => one_line(&error),
    }
});
