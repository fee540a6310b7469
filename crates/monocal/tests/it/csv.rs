//! Reads the tables of the test data.

use std::path::{Path, PathBuf};

pub(crate) fn testdata(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../testdata")
        .join(name)
}

/// The lines of a table, split at commas; without its header where it has one.
pub(crate) fn lines(name: &str, header: bool) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(testdata(name)).expect("by construction");
    let lines = text.lines().skip(usize::from(header));
    lines
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect()
}

pub(crate) fn numbers(fields: &[String]) -> Vec<f64> {
    fields
        .iter()
        .map(|f| f.parse().expect("by construction"))
        .collect()
}
