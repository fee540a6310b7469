//! Reading a map: ROS / Nav2 `map_server` YAML, the picture that it names, and the log-odds beside it.
//!
//! The meaning of every key and pixel is Nav2's (`nav2_map_server/src/map_io.cpp`); what is added is
//! suspicion: sizes are bounded before memory is asked for, and files that were saved together must
//! still belong together.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::frame::MAX_SIDE_CELLS;
use crate::map_file_error::quoted;
use crate::map_image::{self, MapImage};
use crate::map_values::ValueRule;
use crate::map_yaml::MapYaml;
use crate::{MapFileError, MapFrame, MapMode, OccupancyMap, ThresholdRule, npy};

/// How a map is read, and the bounds that keep a stranger's file from using up the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LoadOptions {
    /// What a pixel exactly on a threshold becomes. Default Nav2's rule.
    pub threshold_rule: ThresholdRule,
    /// Accept an `image:` outside the YAML's folder. Default false: a map from a stranger must not
    /// read other files of this machine.
    pub allow_outside: bool,
    /// Read the log-odds too, where there are any. Default true.
    pub log_odds: bool,
    /// Most cells. Default 2^26 (8,192 x 8,192).
    pub max_cells: u64,
    /// Largest width or height [cells]. Default 32,767, and never more.
    pub max_side_cells: u32,
    /// Largest picture [byte], in the file and decoded. Default 256 MiB.
    pub max_image_bytes: u64,
    /// Largest YAML [byte]. Default 64 KiB.
    pub max_yaml_bytes: u64,
    /// Deepest nesting in the YAML. Default 8.
    pub max_yaml_depth: usize,
    /// Most scalars, lists and tables in the YAML. Default 256.
    pub max_yaml_nodes: usize,
    /// Most bytes in comments of a PGM. Default 64 KiB.
    pub max_comment_bytes: u64,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            threshold_rule: ThresholdRule::Nav2,
            allow_outside: false,
            log_odds: true,
            max_cells: 1 << 26,
            max_side_cells: MAX_SIDE_CELLS,
            max_image_bytes: 256 << 20,
            max_yaml_bytes: 64 << 10,
            max_yaml_depth: 8,
            max_yaml_nodes: 256,
            max_comment_bytes: 64 << 10,
        }
    }
}

/// A map and what belongs to it.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedMap {
    /// The map.
    pub map: OccupancyMap,
    /// Log-odds of occupancy, row 0 = top, unknown = 0; one a cell.
    pub log_odds: Option<Vec<f32>>,
    /// How the picture stored the values.
    pub mode: MapMode,
    /// The picture that was read.
    pub image: PathBuf,
}

/// Reads the map whose YAML is at `path`.
///
/// Where the YAML carries `# sha256:` comments (as [`save_map`](crate::save_map) writes them), the
/// picture and the log-odds must have those sums. Log-odds come from the file named there, from
/// `NAME.npy` where that one is gone and `NAME.npy` has the sum, and for a YAML without such comments
/// from `NAME.npy` if it exists.
///
/// Time and memory are linear in the picture's bytes, within the bounds of `options`.
///
/// # Errors
/// [`MapFileError`] where a file cannot be read, is not what it should be, or is above a bound.
pub fn load_map(path: impl AsRef<Path>, options: &LoadOptions) -> Result<LoadedMap, MapFileError> {
    let path = path.as_ref();
    let mut bytes = read_yaml(path, options)?;
    // a save may replace the map between our reading of the YAML and of the picture: a failure
    // counts only if the YAML is still the same
    let mut tries = 0;
    loop {
        let loaded = load_named(path, &bytes, options);
        tries += 1;
        if loaded.is_ok() || tries == MOST_TRIES {
            return loaded;
        }
        let again = read_yaml(path, options)?;
        if again == bytes {
            return loaded;
        }
        bytes = again;
    }
}

/// How often a map that is being saved over is read again.
const MOST_TRIES: u32 = 100;

fn load_named(path: &Path, yaml: &[u8], options: &LoadOptions) -> Result<LoadedMap, MapFileError> {
    let options = &LoadOptions {
        max_side_cells: options.max_side_cells.min(MAX_SIDE_CELLS),
        ..*options
    };
    let yaml = MapYaml::parse(path, yaml, options)?;
    let rule = ValueRule {
        rule: options.threshold_rule,
        mode: yaml.mode,
        negate: yaml.negate,
        free_thresh: yaml.free_thresh,
        occupied_thresh: yaml.occupied_thresh,
    };
    let image = resolve(path, &yaml.image, options)?;
    let mut opened = open_regular(&image, options.max_image_bytes)?;
    if let Some(sum) = yaml.sum_of(&yaml.image) {
        verify(path, &image, &mut opened, sum)?;
    }
    let MapImage {
        width,
        height,
        values,
    } = map_image::decode(&image, opened, &rule, options)?;
    let frame = MapFrame::new(width, height, yaml.resolution, yaml.origin)
        .map_err(|e| MapFileError::content(path, "map frame", "a valid frame", e.to_string()))?;
    let log_odds = if options.log_odds {
        npy::load_beside(path, &yaml, &frame, options)?
    } else {
        None
    };
    let (free_at_most, occupied_at_least) = rule.class_limits();
    Ok(LoadedMap {
        map: OccupancyMap::new(frame, values, free_at_most, occupied_at_least),
        log_odds,
        mode: yaml.mode,
        image,
    })
}

fn read_yaml(path: &Path, options: &LoadOptions) -> Result<Vec<u8>, MapFileError> {
    let opened = open_regular(path, options.max_yaml_bytes)?;
    let mut bytes = Vec::new();
    opened
        .take(options.max_yaml_bytes.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(|e| MapFileError::io(path, "read", e))?;
    if bytes.len() as u64 > options.max_yaml_bytes {
        return Err(MapFileError::limit(
            path,
            "file size in bytes",
            options.max_yaml_bytes,
            "more",
        ));
    }
    Ok(bytes)
}

/// Opens a file that is a plain file of at most `max_bytes`; never waits, as opening a FIFO would.
pub(crate) fn open_regular(path: &Path, max_bytes: u64) -> Result<File, MapFileError> {
    let io = |e| MapFileError::io(path, "open", e);
    let metadata = std::fs::metadata(path).map_err(io)?;
    let opened = if metadata.is_file() {
        Some(File::open(path).map_err(io)?)
    } else {
        None
    };
    // what was opened counts, not what stood there a moment before
    let metadata = match &opened {
        Some(file) => file.metadata().map_err(io)?,
        None => metadata,
    };
    match opened {
        Some(file) if metadata.is_file() => {
            if metadata.len() > max_bytes {
                let place = "file size in bytes";
                return Err(MapFileError::limit(path, place, max_bytes, metadata.len()));
            }
            Ok(file)
        }
        _ => {
            let kind = if metadata.is_dir() {
                "a folder"
            } else {
                "a device, pipe or socket"
            };
            Err(MapFileError::content(path, "open", "a plain file", kind))
        }
    }
}

/// Where a file beside the YAML is; refused outside the YAML's folder, also through symbolic links.
pub(crate) fn resolve(
    yaml: &Path,
    name: &str,
    options: &LoadOptions,
) -> Result<PathBuf, MapFileError> {
    let folder = folder_of(yaml);
    let named = folder.join(name);
    if options.allow_outside {
        return Ok(named);
    }
    let real_folder = folder
        .canonicalize()
        .map_err(|e| MapFileError::io(folder, "open", e))?;
    let real = named
        .canonicalize()
        .map_err(|e| MapFileError::io(&named, "open, as the YAML says", e))?;
    if !real.starts_with(&real_folder) {
        return Err(MapFileError::content(
            yaml,
            "image",
            "a file in the map's own folder (allow_outside lifts this)",
            quoted(name),
        ));
    }
    Ok(real)
}

/// The folder that a file is in, also for a bare name.
pub(crate) fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Checks the sum of the whole file, and goes back to its start.
pub(crate) fn verify(
    yaml: &Path,
    file: &Path,
    opened: &mut File,
    expected: &str,
) -> Result<(), MapFileError> {
    let found = sum_of_file(opened).map_err(|e| MapFileError::io(file, "read", e))?;
    if found == expected {
        return Ok(());
    }
    Err(MapFileError::Mismatch {
        file: file.to_path_buf(),
        yaml: yaml.to_path_buf(),
        expected: expected.chars().take(12).collect(),
        found: found.chars().take(12).collect(),
    })
}

fn sum_of_file(opened: &mut File) -> io::Result<String> {
    let mut hasher = Sha256::new();
    let mut chunk = vec![0; 1 << 16];
    loop {
        match opened.read(&mut chunk)? {
            0 => break,
            n => hasher.update(&chunk[..n]),
        }
    }
    opened.seek(SeekFrom::Start(0))?;
    Ok(hex(&hasher.finalize()))
}

/// SHA-256 in lower-case hexadecimal.
pub(crate) fn sum_of(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

pub(crate) fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write as _;
    bytes.iter().fold(String::new(), |mut out, byte| {
        let _ = write!(out, "{byte:02x}");
        out
    })
}
