//! Portable grey maps (PGM): P2 and P5, 8 and 16 bit, read with bounds and written.
//!
//! Source: the netpbm manual, `pgm(5)`. Comments are accepted wherever white space is, in P2 also
//! between samples.

mod reader;

use std::io::{self, BufRead, Write};

use thiserror::Error;

pub(crate) use self::reader::{PgmHeader, PgmReader};

/// How the samples of a PGM are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PgmEncoding {
    /// P2: decimal numbers.
    Ascii,
    /// P5: one byte a sample up to a maximum of 255, else two, the high one first.
    Binary,
}

/// Bounds on what [`read_pgm`] accepts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PgmLimits {
    /// Largest width or height [px]. Default 32,767.
    pub max_side: u32,
    /// Largest number of pixels; each costs two bytes of memory. Default 2^26.
    pub max_pixels: u64,
    /// Most bytes in comments. Default 65,536.
    pub max_comment_bytes: u64,
}

impl Default for PgmLimits {
    fn default() -> Self {
        Self {
            max_side: crate::frame::MAX_SIDE_CELLS,
            max_pixels: 1 << 26,
            max_comment_bytes: 1 << 16,
        }
    }
}

/// Why a PGM was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PgmError {
    /// Reading failed.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Not a PGM, or damaged.
    #[error("{place}: expected {expected}, found {found}")]
    Content {
        /// Byte offset or header field.
        place: String,
        /// What would have been right.
        expected: String,
        /// What is there.
        found: String,
    },
    /// Larger than [`PgmLimits`] allow.
    #[error("{place}: expected at most {limit}, found {found}")]
    Limit {
        /// What is counted.
        place: String,
        /// The largest value allowed.
        limit: u64,
        /// What is there.
        found: u64,
    },
}

fn content(
    place: impl Into<String>,
    expected: impl Into<String>,
    found: impl Into<String>,
) -> PgmError {
    PgmError::Content {
        place: place.into(),
        expected: expected.into(),
        found: found.into(),
    }
}

/// A grey picture with samples `0..=max_value`, row 0 = top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PgmImage {
    /// [px]
    pub width: u32,
    /// [px]
    pub height: u32,
    /// The sample that means white, 1 to 65,535.
    pub max_value: u16,
    /// `width * height` samples, row by row.
    pub samples: Vec<u16>,
}

impl PgmImage {
    /// Writes the picture.
    ///
    /// # Errors
    /// What the writer reports.
    pub fn write(&self, encoding: PgmEncoding, mut writer: impl Write) -> io::Result<()> {
        let magic = match encoding {
            PgmEncoding::Ascii => "P2",
            PgmEncoding::Binary => "P5",
        };
        writeln!(
            writer,
            "{magic}\n{} {}\n{}",
            self.width, self.height, self.max_value
        )?;
        for row in self.samples.chunks(self.width.max(1) as usize) {
            let mut bytes = Vec::with_capacity(row.len() * 2);
            match encoding {
                PgmEncoding::Ascii => {
                    for sample in row {
                        writeln!(bytes, "{sample}")?;
                    }
                }
                PgmEncoding::Binary if self.max_value < 256 => {
                    bytes.extend(row.iter().map(|&s| s as u8));
                }
                PgmEncoding::Binary => bytes.extend(row.iter().flat_map(|s| s.to_be_bytes())),
            }
            writer.write_all(&bytes)?;
        }
        Ok(())
    }
}

/// Reads a PGM; what follows the last sample is left unread.
///
/// # Errors
/// [`PgmError`] where the bytes are no whole PGM within the limits, or reading fails.
pub fn read_pgm(reader: impl BufRead, limits: &PgmLimits) -> Result<PgmImage, PgmError> {
    let pgm = PgmReader::new(reader, limits)?;
    let PgmHeader {
        width,
        height,
        max_value,
        ..
    } = pgm.header;
    Ok(PgmImage {
        width,
        height,
        max_value,
        samples: pgm.decode(None, |sample| sample)?,
    })
}
