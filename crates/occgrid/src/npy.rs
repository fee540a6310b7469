//! Log-odds as a NumPy file: float32, shape (rows, columns), row 0 = top of the picture.
//!
//! Source: the NumPy format specification, NEP 1 (versions 1.0, 2.0 and 3.0 are read, 1.0 is written).

use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::Path;

use crate::map_file_error::quoted;
use crate::map_server::{folder_of, open_regular, resolve, verify};
use crate::map_yaml::MapYaml;
use crate::{LoadOptions, MapFileError, MapFrame};

const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// A header is padded so that the data start at a multiple of this [byte].
const ALIGNMENT: usize = 64;

/// Longer headers than this are refused [byte]; NumPy writes 118 for such an array.
const MAX_HEADER: usize = 4096;

/// Largest header with everything before it [byte].
const MAX_PREFIX: u64 = MAX_HEADER as u64 + 12;

/// Writes `values` as an array of shape (rows, columns).
pub(crate) fn write(
    mut writer: impl Write,
    rows: u32,
    columns: u32,
    values: &[f32],
) -> io::Result<()> {
    let mut header =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    let unpadded = MAGIC.len() + 4 + header.len() + 1;
    header.extend(std::iter::repeat_n(
        ' ',
        unpadded.next_multiple_of(ALIGNMENT) - unpadded,
    ));
    header.push('\n');
    writer.write_all(MAGIC)?;
    writer.write_all(&[1, 0])?;
    writer.write_all(&(header.len() as u16).to_le_bytes())?;
    writer.write_all(header.as_bytes())?;
    let mut bytes = Vec::with_capacity(1 << 16);
    for chunk in values.chunks(1 << 14) {
        bytes.clear();
        bytes.extend(chunk.iter().flat_map(|v| v.to_le_bytes()));
        writer.write_all(&bytes)?;
    }
    Ok(())
}

/// The log-odds that belong to a map, if there are any: the file with a sum in the YAML, else, for a
/// YAML without sums, `NAME.npy`.
pub(crate) fn load_beside(
    yaml_path: &Path,
    yaml: &MapYaml,
    frame: &MapFrame,
    options: &LoadOptions,
) -> Result<Option<Vec<f32>>, MapFileError> {
    let folder = folder_of(yaml_path);
    let stem = yaml_path.file_stem().unwrap_or_default().to_string_lossy();
    let published = format!("{stem}.npy");
    let max_bytes = MAX_PREFIX + 4 * frame.cell_count() as u64;
    let exists = |name: &&str| folder.join(name).exists();
    let open = |name: &str| {
        let file = resolve(yaml_path, name, options)?;
        let opened = open_regular(&file, max_bytes)?;
        Ok((file, opened))
    };
    let Some(saved) = yaml.log_odds_file() else {
        let foreign = Some(published.as_str()).filter(|_| yaml.sums.is_empty());
        return foreign.filter(exists).map_or(Ok(None), |name| {
            let (file, opened) = open(name)?;
            read(&file, opened, frame).map(Some)
        });
    };
    let mut refusal = None;
    for name in [saved.name.as_str(), &published]
        .iter()
        .filter(|n| exists(n))
    {
        let read = open(name).and_then(|(file, mut opened)| {
            verify(yaml_path, &file, &mut opened, &saved.sum)?;
            read(&file, opened, frame)
        });
        match read {
            Ok(values) => return Ok(Some(values)),
            Err(e) => refusal = refusal.or(Some(e)),
        }
    }
    // copied without its log-odds: the map itself is whole
    refusal.map_or(Ok(None), Err)
}

fn read(file: &Path, opened: File, frame: &MapFrame) -> Result<Vec<f32>, MapFileError> {
    let mut reader = BufReader::with_capacity(1 << 16, opened);
    let io = |e| MapFileError::io(file, "read", e);
    let header = read_header(file, &mut reader)?;
    let expected = (u64::from(frame.height()), u64::from(frame.width()));
    if header != expected {
        let found = format!("({}, {})", header.0, header.1);
        let expected = format!("({}, {}) as the picture", expected.0, expected.1);
        return Err(MapFileError::content(file, "shape", expected, found));
    }
    let cells = frame.cell_count();
    let mut values: Vec<f32> = Vec::new();
    values
        .try_reserve_exact(cells)
        .map_err(|e| io(io::Error::new(io::ErrorKind::OutOfMemory, e)))?;
    let mut chunk = vec![0; (1 << 16).min(4 * cells)];
    while values.len() < cells {
        let wanted = chunk.len().min(4 * (cells - values.len()));
        let bytes = &mut chunk[..wanted];
        reader.read_exact(bytes).map_err(|e| match e.kind() {
            io::ErrorKind::UnexpectedEof => {
                let found = format!("the end after value {} or soon after", values.len());
                MapFileError::content(file, "data", format!("{cells} values"), found)
            }
            _ => io(e),
        })?;
        let words = bytes.chunks_exact(4);
        values.extend(words.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
    }
    if reader.read(&mut [0]).map_err(io)? != 0 {
        let expected = format!("the end after {cells} values");
        return Err(MapFileError::content(file, "data", expected, "more bytes"));
    }
    match first_not_finite(&values, frame) {
        Some((place, found)) => Err(MapFileError::content(file, place, "a finite number", found)),
        None => Ok(values),
    }
}

/// The place and text of the first value that is no log-odds.
pub(crate) fn first_not_finite(values: &[f32], frame: &MapFrame) -> Option<(String, String)> {
    let i = values.iter().position(|v| !v.is_finite())?;
    let (row, column) = (i / frame.width() as usize, i % frame.width() as usize);
    let place = format!("log-odds of row {row}, column {column}");
    Some((place, values[i].to_string()))
}

/// The shape (rows, columns) of a float32 array in C order.
fn read_header(file: &Path, reader: &mut impl Read) -> Result<(u64, u64), MapFileError> {
    let wrong = |place: &str, expected: &str, found: String| {
        MapFileError::content(file, place, expected, found)
    };
    let end = |e: io::Error| match e.kind() {
        io::ErrorKind::UnexpectedEof => wrong("header", "a NumPy file", "the end".to_owned()),
        _ => MapFileError::io(file, "read", e),
    };
    let mut start = [0; 8];
    reader.read_exact(&mut start).map_err(end)?;
    if !start.starts_with(MAGIC) {
        let found = quoted(&String::from_utf8_lossy(&start[..6]));
        return Err(wrong("byte 0", "a NumPy file", found));
    }
    let length = match start[6] {
        1 => {
            let mut bytes = [0; 2];
            reader.read_exact(&mut bytes).map_err(end)?;
            usize::from(u16::from_le_bytes(bytes))
        }
        2 | 3 => {
            let mut bytes = [0; 4];
            reader.read_exact(&mut bytes).map_err(end)?;
            usize::try_from(u32::from_le_bytes(bytes)).unwrap_or(usize::MAX)
        }
        other => {
            return Err(wrong(
                "byte 6",
                "format version 1, 2 or 3",
                other.to_string(),
            ));
        }
    };
    if length > MAX_HEADER {
        return Err(MapFileError::limit(
            file,
            "header bytes",
            MAX_HEADER,
            length,
        ));
    }
    let mut header = vec![0; length];
    reader.read_exact(&mut header).map_err(end)?;
    let header = String::from_utf8_lossy(&header);
    parse_header(&header).ok_or_else(|| {
        let expected = "{'descr': '<f4', 'fortran_order': False, 'shape': (rows, columns)}";
        wrong("header", expected, quoted(header.trim_end()))
    })
}

/// Reads the one kind of header that fits a map; the keys may stand in any order.
fn parse_header(header: &str) -> Option<(u64, u64)> {
    let body = header.trim().strip_prefix('{')?.strip_suffix('}')?;
    let (before, rest) = body.split_once('(')?;
    let (shape, after) = rest.split_once(')')?;
    let mut keys: Vec<&str> = before
        .split(',')
        .chain(after.split(','))
        .map(str::trim)
        .filter(|part| !part.is_empty())
        .collect();
    keys.sort_unstable();
    let plain: Vec<String> = keys
        .iter()
        .map(|key| key.chars().filter(|c| !c.is_whitespace()).collect())
        .map(|key: String| key.replace('"', "'"))
        .collect();
    if plain != ["'descr':'<f4'", "'fortran_order':False", "'shape':"] {
        return None;
    }
    let (rows, columns) = shape.split_once(',')?;
    let columns = columns.trim().trim_end_matches(',');
    Some((rows.trim().parse().ok()?, columns.trim().parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_in_any_order_and_nothing_else() {
        let good = [
            "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }   \n",
            "{'shape': (3,4), 'descr': '<f4', 'fortran_order': False}",
            "{\"fortran_order\": False, \"descr\": \"<f4\", \"shape\": (3, 4)}",
        ];
        for header in good {
            assert_eq!(parse_header(header), Some((3, 4)), "{header}");
        }
        let bad = [
            "",
            "{}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (3, 4), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4, 5), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-3, 4), }",
            "{'descr': '<f4', 'shape': (3, 4), }",
        ];
        for header in bad {
            assert_eq!(parse_header(header), None, "{header}");
        }
    }
}
