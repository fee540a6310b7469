//! Sonar logs as CSV: `stamp,x,y,theta,bearing,kind,range`, one shot a line.

use std::io::{self, BufRead, BufReader, Read, Write};

use thiserror::Error;

use crate::{Pose2, Reading, Shot};

/// The header line of a sonar log.
pub const LOG_HEADER: &str = "stamp,x,y,theta,bearing,kind,range";

const COLUMNS: [&str; 7] = ["stamp", "x", "y", "theta", "bearing", "kind", "range"];

/// A line of seven numbers never needs more [bytes].
const MAX_LINE_BYTES: usize = 1024;

/// How much of a log is read before it is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogLimits {
    /// Size of the file [bytes]. Default 64 MiB.
    pub max_bytes: u64,
    /// Shots. Default 500 000: seven hours at 20 shots a second, and 32 MB of memory.
    pub max_shots: usize,
}

impl Default for LogLimits {
    fn default() -> Self {
        Self {
            max_bytes: 64 << 20,
            max_shots: 500_000,
        }
    }
}

/// Why a sonar log was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LogError {
    /// The source failed.
    #[error("line {line}: cannot read: {source}")]
    Io {
        /// 1-based.
        line: usize,
        /// What the source said.
        source: io::Error,
    },
    /// The first line is not [`LOG_HEADER`].
    #[error("line 1: expected the header {LOG_HEADER}, found {found:?}")]
    Header {
        /// The line, shortened.
        found: String,
    },
    /// A line has too few or too many fields.
    #[error("line {line}: expected 7 fields ({LOG_HEADER}), found {found}")]
    Fields {
        /// 1-based.
        line: usize,
        /// How many there are.
        found: usize,
    },
    /// A field is not what its column holds.
    #[error("line {line}, column {column}: expected {expected}, found {found:?}")]
    Field {
        /// 1-based.
        line: usize,
        /// Name of the column.
        column: &'static str,
        /// What may stand there.
        expected: &'static str,
        /// The field, shortened.
        found: String,
    },
    /// The log is longer than the caller allows.
    #[error("line {line}: expected at most {expected}")]
    TooLong {
        /// 1-based.
        line: usize,
        /// The limit that was passed.
        expected: String,
    },
}

/// Reads a sonar log with the default [`LogLimits`].
///
/// A byte order mark, CRLF and empty lines are tolerated. `range` is the measured range for `echo`, the
/// range listened to for `no_echo`, and empty or ignored for `too_close` and `fault`.
///
/// # Errors
/// [`LogError`], which names the line, the column, what was expected and what was found.
pub fn read_log(source: impl Read) -> Result<Vec<Shot>, LogError> {
    read_log_within(source, LogLimits::default())
}

/// Reads a sonar log, at most as much as the limits say; memory is 64 bytes a shot, doubled while the
/// list grows.
///
/// # Errors
/// As [`read_log`].
pub fn read_log_within(source: impl Read, limits: LogLimits) -> Result<Vec<Shot>, LogError> {
    let mut source = BufReader::new(source.take(limits.max_bytes.saturating_add(1)));
    let mut bytes_left = limits.max_bytes;
    let mut shots = Vec::new();
    let mut line = Vec::new();
    let mut number = 0;
    let mut header_seen = false;
    loop {
        number += 1;
        line.clear();
        let read = source
            .by_ref()
            .take(MAX_LINE_BYTES as u64 + 1)
            .read_until(b'\n', &mut line)
            .map_err(|source| LogError::Io {
                line: number,
                source,
            })?;
        if read == 0 && header_seen {
            return Ok(shots);
        }
        let too_long = |expected: String| LogError::TooLong {
            line: number,
            expected,
        };
        bytes_left = bytes_left
            .checked_sub(read as u64)
            .ok_or_else(|| too_long(format!("{} bytes", limits.max_bytes)))?;
        if !header_seen {
            check_header(&line)?;
            header_seen = true;
            continue;
        }
        if read > MAX_LINE_BYTES {
            return Err(too_long(format!("{MAX_LINE_BYTES} bytes a line")));
        }
        let text = line.trim_ascii();
        if text.is_empty() {
            continue;
        }
        if shots.len() >= limits.max_shots {
            return Err(too_long(format!("{} shots", limits.max_shots)));
        }
        shots.push(parse_line(text, number)?);
    }
}

/// Writes a sonar log; [`read_log`] gives back the same shots, bit for bit.
///
/// # Errors
/// What the sink says.
pub fn write_log(mut sink: impl Write, shots: &[Shot]) -> io::Result<()> {
    writeln!(sink, "{LOG_HEADER}")?;
    for shot in shots {
        let Pose2 { x, y, theta } = shot.map_from_base;
        let (kind, range) = match shot.reading {
            Reading::Echo { range } => ("echo", range),
            Reading::NoEcho { listened } => ("no_echo", listened),
            Reading::TooClose => ("too_close", 0.0),
            Reading::Fault => ("fault", 0.0),
        };
        let (stamp, bearing) = (shot.stamp, shot.bearing);
        // Debug: the shortest digits that read back exactly, with an exponent where it is shorter
        writeln!(
            sink,
            "{stamp:?},{x:?},{y:?},{theta:?},{bearing:?},{kind},{range:?}"
        )?;
    }
    sink.flush()
}

fn check_header(line: &[u8]) -> Result<(), LogError> {
    let text = line
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(line)
        .trim_ascii();
    let same = text
        .split(|&b| b == b',')
        .map(<[u8]>::trim_ascii)
        .eq(COLUMNS.iter().map(|c| c.as_bytes()));
    same.then_some(()).ok_or_else(|| LogError::Header {
        found: shortened(text),
    })
}

fn parse_line(text: &[u8], line: usize) -> Result<Shot, LogError> {
    let mut fields = [&b""[..]; COLUMNS.len()];
    let mut found = 0;
    for field in text.split(|&b| b == b',') {
        if let Some(slot) = fields.get_mut(found) {
            *slot = field.trim_ascii();
        }
        found += 1;
    }
    if found != COLUMNS.len() {
        return Err(LogError::Fields { line, found });
    }
    let refuse = |column: usize, expected| LogError::Field {
        line,
        column: COLUMNS[column],
        expected,
        found: shortened(fields[column]),
    };
    let number =
        |column: usize| finite(fields[column]).ok_or_else(|| refuse(column, "a finite number"));
    let range = || {
        let range = finite(fields[6]).filter(|r| *r >= 0.0);
        range.ok_or_else(|| refuse(6, "a finite number of metres, 0 or more"))
    };
    let unmeasured = |reading| {
        if fields[6].is_empty() {
            Ok(reading)
        } else {
            range().map(|_| reading)
        }
    };
    Ok(Shot {
        stamp: number(0)?,
        map_from_base: Pose2::new(number(1)?, number(2)?, number(3)?),
        bearing: number(4)?,
        reading: match fields[5] {
            b"echo" => Reading::Echo { range: range()? },
            b"no_echo" => Reading::NoEcho { listened: range()? },
            b"too_close" => unmeasured(Reading::TooClose)?,
            b"fault" => unmeasured(Reading::Fault)?,
            _ => return Err(refuse(5, "echo, no_echo, too_close or fault")),
        },
    })
}

fn finite(field: &[u8]) -> Option<f64> {
    let value: f64 = std::str::from_utf8(field).ok()?.parse().ok()?;
    value.is_finite().then_some(value)
}

fn shortened(field: &[u8]) -> String {
    const KEEP: usize = 60;
    let mut text = String::from_utf8_lossy(&field[..field.len().min(KEEP)]).into_owned();
    if field.len() > KEEP {
        text.push_str("...");
    }
    text
}
