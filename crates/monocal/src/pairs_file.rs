//! Pixel-to-floor pairs as CSV.

use std::io::{BufRead as _, BufReader, Read};

use thiserror::Error;

use crate::{MOST_PAIRS, Pair};

/// The header of a file of pairs: pixel [px], floor point [m].
pub const PAIRS_HEADER: &str = "u,v,x,y";

/// Why a file of pairs could not be read. Lines are numbered from 1.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PairsError {
    /// The operating system refused, or the text is not UTF-8.
    #[error("line {line}: {source}")]
    Io {
        /// The line.
        line: usize,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The header is another.
    #[error("line 1: expected the header {PAIRS_HEADER}, found {found:?}")]
    Header {
        /// The first line, cut.
        found: String,
    },
    /// A line has more or fewer values than the header.
    #[error("line {line}: expected 4 values, found {found}")]
    Values {
        /// The line.
        line: usize,
        /// Number of values.
        found: usize,
    },
    /// A value is no finite number.
    #[error("line {line}, {column}: expected a finite number, found {found:?}")]
    Number {
        /// The line.
        line: usize,
        /// Its column.
        column: &'static str,
        /// The text, cut.
        found: String,
    },
    /// The file is longer than pairs can be.
    #[error(
        "line {line}: expected at most {MOST_LINES} lines of at most {LONGEST_LINE} bytes, found more"
    )]
    TooLong {
        /// The line.
        line: usize,
    },
}

/// The longest line [bytes].
const LONGEST_LINE: u64 = 200;

/// The most lines, empty ones counted.
const MOST_LINES: usize = 2 * MOST_PAIRS;

/// Reads pairs from CSV with the header [`PAIRS_HEADER`]; empty lines are skipped.
///
/// # Errors
/// [`PairsError`], with the line.
pub fn read_pairs(source: impl Read) -> Result<Vec<Pair>, PairsError> {
    let mut source = BufReader::new(source);
    let mut pairs = Vec::new();
    let mut text = String::new();
    for line in 1.. {
        text.clear();
        let read = (&mut source)
            .take(LONGEST_LINE + 1)
            .read_line(&mut text)
            .map_err(|source| PairsError::Io { line, source })?;
        if read as u64 > LONGEST_LINE || line > MOST_LINES {
            return Err(PairsError::TooLong { line });
        }
        if read == 0 && line > 1 {
            break;
        }
        let content = text.trim_start_matches('\u{feff}').trim();
        if line == 1 {
            let names: Vec<&str> = content.split(',').map(str::trim).collect();
            if names.join(",") != PAIRS_HEADER {
                return Err(PairsError::Header {
                    found: cut(content),
                });
            }
        } else if !content.is_empty() {
            pairs.push(pair(content, line)?);
        }
    }
    Ok(pairs)
}

fn pair(content: &str, line: usize) -> Result<Pair, PairsError> {
    let values: Vec<&str> = content.split(',').map(str::trim).collect();
    let &[u, v, x, y] = values.as_slice() else {
        return Err(PairsError::Values {
            line,
            found: values.len(),
        });
    };
    let number = |text: &str, column: &'static str| match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(PairsError::Number {
            line,
            column,
            found: cut(text),
        }),
    };
    Ok(Pair::new(
        [number(u, "u")?, number(v, "v")?],
        [number(x, "x")?, number(y, "y")?],
    ))
}

fn cut(text: &str) -> String {
    text.chars().take(60).collect()
}
