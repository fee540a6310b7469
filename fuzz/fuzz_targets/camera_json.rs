//! Any bytes as a camera file: refused in one line, or a camera that survives writing.
#![no_main]

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use monocal::FloorCamera;

/// A folder in memory where the system has one.
static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() {
        tempfile::tempdir_in(memory)
    } else {
        tempfile::tempdir()
    };
    folder.expect("a temporary folder")
});

fuzz_target!(|data: &[u8]| {
    let path = FOLDER.path().join("camera.json");
    fs::write(&path, data).expect("written");
    match FloorCamera::load(&path) {
        Ok(camera) => {
            if let Some(point) = camera.floor_point([10.0, 200.0].into()) {
                assert!(point.x.is_finite() && point.y.is_finite());
            }
            fs::write(&path, camera.to_json()).expect("written");
            FloorCamera::load(&path).expect("its own file");
        }
        Err(error) => {
            let line = error.to_string();
            assert!(!line.chars().any(char::is_control), "{line:?}");
        }
    }
});
