//! A YAML and a picture from the same bytes, split at the first NUL; what loads must save and load
//! again as the same map.
#![no_main]

use std::fs;

use libfuzzer_sys::fuzz_target;
use mobot_fuzz::folder;
use occgrid::{LoadOptions, SaveOptions, load_map, save_map};

fuzz_target!(|data: &[u8]| {
    let at = data.iter().position(|&b| b == 0).unwrap_or(data.len());
    let (yaml, picture) = data.split_at(at);
    let path = folder().join("map.yaml");
    fs::write(&path, yaml).expect("written");
    fs::write(
        folder().join("map.pgm"),
        picture.get(1..).unwrap_or_default(),
    )
    .expect("written");
    let options = LoadOptions {
        max_cells: 1 << 16,
        ..LoadOptions::default()
    };
    let Ok(loaded) = load_map(&path, &options) else {
        return;
    };
    let saved = SaveOptions {
        mode: loaded.mode,
        ..SaveOptions::default()
    };
    let copy = folder().join("copy.yaml");
    save_map(&copy, &loaded.map, loaded.log_odds.as_deref(), &saved).expect("saved");
    let again = load_map(&copy, &options).expect("loaded again");
    assert_eq!(again.map, loaded.map);
});
