//! Any bytes as a camera_info YAML: refused in one line, or a lens whose pixels are numbers.
#![no_main]

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use monocal::CameraInfo;

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
    let path = FOLDER.path().join("info.yaml");
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
        Err(error) => {
            let line = error.to_string();
            assert!(!line.chars().any(char::is_control), "{line:?}");
        }
    }
});
