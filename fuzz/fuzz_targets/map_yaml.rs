//! Any bytes as a map's YAML beside a good picture: refused in one line, or a map that survives saving.
#![no_main]

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use occgrid::{LoadOptions, load_map};

/// A folder in memory where the system has one.
static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() {
        tempfile::tempdir_in(memory)
    } else {
        tempfile::tempdir()
    };
    let folder = folder.expect("a temporary folder");
    fs::write(folder.path().join("map.pgm"), b"P5 3 1 255\n\xfe\xcd\x00").expect("written");
    folder
});

fuzz_target!(|data: &[u8]| {
    let path = FOLDER.path().join("map.yaml");
    fs::write(&path, data).expect("written");
    match load_map(&path, &LoadOptions::default()) {
        Ok(loaded) => {
            let resolution = loaded.map.frame().resolution();
            assert!(resolution.is_finite() && resolution > 0.0);
        }
        Err(error) => {
            let line = error.to_string();
            assert!(!line.chars().any(char::is_control), "{line:?}");
        }
    }
});
