//! What can be wrong with a camera's files, said in one line that names the file and the place in it.

use std::fmt::Write as _;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a camera's file could not be read. The message is one line; text that came from a file is escaped
/// and cut, so that it cannot drive a terminal.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CameraFileError {
    /// The operating system refused.
    #[error("{}: {source}", shown(file))]
    Io {
        /// The file.
        file: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file does not hold what it should.
    #[error("{}: {place}: expected {expected}, found {found}", shown(file))]
    Content {
        /// The file.
        file: PathBuf,
        /// Line and column, or name of the value.
        place: String,
        /// What would have been right.
        expected: String,
        /// What is there.
        found: String,
    },
}

/// The largest camera file [bytes].
const MOST_BYTES: u64 = 64 * 1024;

/// Reads a small text file.
pub(crate) fn read_small(file: &Path) -> Result<String, CameraFileError> {
    let io = |source| CameraFileError::Io {
        file: file.to_path_buf(),
        source,
    };
    let mut bytes = Vec::new();
    let opened = std::fs::File::open(file).map_err(io)?;
    if !opened.metadata().map_err(io)?.is_file() {
        return Err(content(file, "file", "a file", "something else"));
    }
    opened
        .take(MOST_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(io)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(content(
            file,
            "file",
            format!("at most {MOST_BYTES} bytes"),
            "more",
        ));
    }
    String::from_utf8(bytes).map_err(|e| {
        let place = format!("byte {}", e.utf8_error().valid_up_to());
        content(file, place, "UTF-8 text", "other bytes")
    })
}

pub(crate) fn content(
    file: &Path,
    place: impl Into<String>,
    expected: impl Into<String>,
    found: impl Into<String>,
) -> CameraFileError {
    CameraFileError::Content {
        file: file.to_path_buf(),
        place: place.into(),
        expected: expected.into(),
        found: found.into(),
    }
}

/// The longest piece of a file's text that a message repeats [characters].
const LONGEST_QUOTE: usize = 120;

fn shown(path: &Path) -> String {
    path.to_string_lossy().chars().flat_map(escaped).collect()
}

pub(crate) fn escaped(c: char) -> Vec<char> {
    // quotes stay as they are: escaping is against control and format characters
    if c == '"' || c == '\'' {
        vec![c]
    } else {
        c.escape_debug().collect()
    }
}

/// Text from a file, in quotes, cut to a length that fits a line.
pub(crate) fn quoted(text: &str) -> String {
    let mut out = String::from("`");
    out.extend(text.chars().take(LONGEST_QUOTE).flat_map(escaped));
    if text.chars().count() > LONGEST_QUOTE {
        let _ = write!(out, "... ({} bytes)", text.len());
    }
    out.push('`');
    out
}
