//! Any bytes as a map's YAML beside a good picture: refused in one line, or a map that survives saving.
#![no_main]

use std::fs;

use libfuzzer_sys::fuzz_target;
use mobot_fuzz::{folder, one_line};
use occgrid::{LoadOptions, load_map};

fuzz_target!(|data: &[u8]| {
    let path = folder().join("map.yaml");
    fs::write(&path, data).expect("written");
    let picture = b"P5 3 1 255\n\xfe\xcd\x00";
    fs::write(folder().join("map.pgm"), picture).expect("written");
    match load_map(&path, &LoadOptions::default()) {
        Ok(loaded) => {
            let resolution = loaded.map.frame().resolution();
            assert!(resolution.is_finite() && resolution > 0.0);
        }
        Err(error) => one_line(&error),
    }
});
