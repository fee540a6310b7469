//! The picture half of a map: decoded within bounds, straight into occupancy values.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use crate::map_file_error::quoted;
use crate::map_values::{ValueRule, level8, level16};
use crate::pgm::{PgmError, PgmLimits, PgmReader};
use crate::{LoadOptions, MapFileError};

/// A decoded picture: occupancy values, row 0 = top.
pub(crate) struct MapImage {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) values: Vec<i8>,
}

/// Decodes `opened`, whose format is known by its first bytes; `file` is named in messages.
pub(crate) fn decode(
    file: &Path,
    mut opened: File,
    rule: &ValueRule,
    options: &LoadOptions,
) -> Result<MapImage, MapFileError> {
    let io = |e| MapFileError::io(file, "read", e);
    let length = opened.metadata().map_err(io)?.len();
    let mut magic = Vec::with_capacity(8);
    (&mut opened).take(8).read_to_end(&mut magic).map_err(io)?;
    opened.seek(SeekFrom::Start(0)).map_err(io)?;
    match magic.as_slice() {
        [b'P', b'2' | b'5', ..] => decode_pgm(file, opened, length, rule, options),
        #[cfg(feature = "image")]
        b"\x89PNG\r\n\x1a\n" => {
            crate::map_png::decode(file, opened, image::ImageFormat::Png, rule, options)
        }
        #[cfg(feature = "image")]
        [b'B', b'M', ..] => {
            crate::map_png::decode(file, opened, image::ImageFormat::Bmp, rule, options)
        }
        other => {
            let formats = if cfg!(feature = "image") {
                "a PGM (P2, P5), PNG or BMP picture"
            } else {
                "a PGM (P2, P5) picture; PNG and BMP need the feature `image`"
            };
            let found = quoted(&String::from_utf8_lossy(other));
            Err(MapFileError::content(file, "byte 0", formats, found))
        }
    }
}

fn decode_pgm(
    file: &Path,
    opened: File,
    length: u64,
    rule: &ValueRule,
    options: &LoadOptions,
) -> Result<MapImage, MapFileError> {
    let limits = PgmLimits {
        max_side: options.max_side_cells,
        max_pixels: options.max_cells,
        max_comment_bytes: options.max_comment_bytes,
    };
    let reader = BufReader::with_capacity(1 << 16, opened);
    let pgm = PgmReader::new(reader, &limits).map_err(|e| pgm_error(file, e))?;
    let (width, height) = (pgm.header.width, pgm.header.height);
    let max_value = pgm.header.max_value;
    let table = rule.table();
    let values = pgm
        .decode(Some(length), |sample| {
            let grey = match max_value {
                255 => sample as u8,
                _ => level8(level16(sample, max_value)),
            };
            table[usize::from(grey)]
        })
        .map_err(|e| pgm_error(file, e))?;
    Ok(MapImage {
        width,
        height,
        values,
    })
}

fn pgm_error(file: &Path, error: PgmError) -> MapFileError {
    match error {
        PgmError::Io(e) => MapFileError::io(file, "read", e),
        PgmError::Content {
            place,
            expected,
            found,
        } => MapFileError::content(file, place, expected, found),
        PgmError::Limit {
            place,
            limit,
            found,
        } => MapFileError::limit(file, place, limit, found),
    }
}
