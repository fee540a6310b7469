//! What can be wrong with a map's files, said in one line that names the file and the place in it.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a map could not be read or written. The message is one line; text that came from a file is
/// escaped and cut, so that it cannot drive a terminal.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MapFileError {
    /// The operating system refused.
    #[error("{}: {place}: {source}", shown(file))]
    Io {
        /// The file that was being read or written.
        file: PathBuf,
        /// What was being done.
        place: String,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file does not hold what it should.
    #[error("{}: {place}: expected {expected}, found {found}", shown(file))]
    Content {
        /// The file that is wrong.
        file: PathBuf,
        /// Line and column, byte, or name of the value.
        place: String,
        /// What would have been right.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The file is larger than [`LoadOptions`](crate::LoadOptions) allow.
    #[error("{}: {place}: expected at most {limit}, found {found}", shown(file))]
    Limit {
        /// The file that is too large.
        file: PathBuf,
        /// What is counted.
        place: String,
        /// The largest value allowed.
        limit: String,
        /// What is there.
        found: String,
    },
    /// The file is not the one that the YAML was saved with.
    #[error(
        "{}: sha256: expected {expected} as {} says, found {found} (changed on purpose? then remove that comment from the YAML)",
        shown(file),
        shown(yaml)
    )]
    Mismatch {
        /// The image or log-odds file.
        file: PathBuf,
        /// The YAML that names it.
        yaml: PathBuf,
        /// The first digits of the sum in the YAML.
        expected: String,
        /// The first digits of the file's sum.
        found: String,
    },
}

impl MapFileError {
    /// The file that is wrong.
    #[must_use]
    pub fn file(&self) -> &Path {
        match self {
            Self::Io { file, .. }
            | Self::Content { file, .. }
            | Self::Limit { file, .. }
            | Self::Mismatch { file, .. } => file,
        }
    }

    pub(crate) fn io(file: &Path, place: impl Into<String>, source: io::Error) -> Self {
        Self::Io {
            file: file.to_path_buf(),
            place: place.into(),
            source,
        }
    }

    pub(crate) fn content(
        file: &Path,
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        Self::Content {
            file: file.to_path_buf(),
            place: place.into(),
            expected: expected.into(),
            found: found.into(),
        }
    }

    pub(crate) fn limit(
        file: &Path,
        place: impl Into<String>,
        limit: impl ToString,
        found: impl ToString,
    ) -> Self {
        Self::Limit {
            file: file.to_path_buf(),
            place: place.into(),
            limit: limit.to_string(),
            found: found.to_string(),
        }
    }
}

/// The longest piece of a file's text that a message repeats [characters].
const LONGEST_QUOTE: usize = 120;

fn push_escaped(out: &mut String, c: char) {
    // quotes stay as they are: escaping is against control and format characters
    if c == '"' || c == '\'' {
        out.push(c);
    } else {
        out.extend(c.escape_debug());
    }
}

/// A path that cannot break the line or drive the terminal.
pub(crate) fn shown(path: &Path) -> String {
    let mut out = String::new();
    for c in path.to_string_lossy().chars() {
        push_escaped(&mut out, c);
    }
    out
}

/// Text from a file, in quotes, cut to a length that fits a line.
pub(crate) fn quoted(text: &str) -> String {
    let mut out = String::from("`");
    for (i, c) in text.chars().enumerate() {
        if i == LONGEST_QUOTE {
            let _ = write!(out, "... ({} bytes)", text.len());
            break;
        }
        push_escaped(&mut out, c);
    }
    out.push('`');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn untrusted_text_cannot_break_the_line() {
        let text = "a\u{1b}[31m\nb\u{202e}c\0\u{85}";
        assert_eq!(quoted(text), "`a\\u{1b}[31m\\nb\\u{202e}c\\0\\u{85}`",);
        assert_eq!(shown(Path::new("x\ny'z.pgm")), "x\\ny'z.pgm");
    }

    #[test]
    fn long_text_is_cut() {
        let shown = quoted(&"x".repeat(100_000));
        assert!(shown.len() < 200 && shown.contains("100000 bytes"));
    }
}
