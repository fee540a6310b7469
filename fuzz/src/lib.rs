//! What the fuzz targets share.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// A folder of this process, in memory where the system has one.
pub fn folder() -> &'static Path {
    static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
        let memory = PathBuf::from("/dev/shm");
        let folder = if memory.is_dir() {
            tempfile::tempdir_in(memory)
        } else {
            tempfile::tempdir()
        };
        folder.expect("a temporary folder")
    });
    FOLDER.path()
}

/// A refusal is one line, whatever was refused.
///
/// # Panics
/// If it is not.
pub fn one_line(error: &impl std::fmt::Display) {
    let line = error.to_string();
    assert!(!line.chars().any(char::is_control), "{line:?}");
}
