//! Saving a map so that a crash, a full disk or a failing one leaves the old map or the new map, whole.
//!
//! The picture and the log-odds are written under names of their own (`NAME.000012.pgm`,
//! `NAME.000012.npy`), each made durable before the next step; then the YAML that names them and
//! carries their SHA-256 replaces the old YAML in one rename. That rename is the commit. After it,
//! `NAME.npy` is published and older generations are removed.

mod names;

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use atomic_write_file::{AtomicWriteFile, OpenOptions};

use self::names::Names;
use crate::map_server::sum_of;
use crate::map_yaml::{FileSum, MapYaml};
use crate::{CellState, MapFileError, MapFrame, MapMode, OccupancyMap, npy};

/// How a map is saved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SaveOptions {
    /// How the picture stores the values. Trinary keeps only free, occupied and unknown; scale and
    /// raw keep every value -1..=100, raw also the map's class limits. Default trinary.
    pub mode: MapMode,
    /// Name the files `NAME.pgm` and `NAME.npy` instead of giving each save its own. Default false.
    /// What it loses: a save interrupted between its renames leaves a new picture beside an old YAML.
    /// [`load_map`](crate::load_map) then refuses the pair by its sums; other programs do not notice.
    pub plain_names: bool,
}

/// What [`save_map`] wrote.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SavedMap {
    /// The YAML.
    pub yaml: PathBuf,
    /// The picture that it names.
    pub image: PathBuf,
    /// The log-odds that it names.
    pub log_odds: Option<PathBuf>,
    /// What could not be done after the map was safely in place, one line each: publishing `NAME.npy`
    /// or removing older files. The next save tries again.
    pub notes: Vec<String>,
}

/// Saves a map, and log-odds (one a cell, row 0 = top, unknown = 0) where given, so that Nav2 reads
/// back the same grid and [`load_map`](crate::load_map) the same map.
///
/// `path` is the YAML's; the other files go into its folder. On `Ok` the new map is on the disk; on
/// an error the old map or the new one is, whole. Older generations of the same name
/// (`NAME.NNNNNN.pgm`, `.png`, `.npy`) are removed.
///
/// # Errors
/// [`MapFileError`] where `path` is no file name for a YAML, a log-odds value is not finite, or the
/// operating system refuses. Scale mode needs the feature `image`.
///
/// # Panics
/// If `log_odds` has not one value a cell.
pub fn save_map(
    path: impl AsRef<Path>,
    map: &OccupancyMap,
    log_odds: Option<&[f32]>,
    options: &SaveOptions,
) -> Result<SavedMap, MapFileError> {
    let names = Names::new(path.as_ref())?;
    if let Some(values) = log_odds {
        assert_eq!(values.len(), map.frame().cell_count(), "one value a cell");
        if let Some((place, found)) = npy::first_not_finite(values, map.frame()) {
            return Err(MapFileError::content(
                &names.yaml,
                place,
                "a finite number",
                found,
            ));
        }
    }
    let image = encode(&names.yaml, map, options.mode)?;
    let array = log_odds.map(|values| npy_bytes(map.frame(), values));

    let _lock = lock(&names.folder)?;
    let generation = if options.plain_names {
        None
    } else {
        Some(names.newest_generation()? + 1)
    };
    let image_name = names.file(generation, extension(options.mode));
    let array_name = array.as_ref().map(|_| names.file(generation, "npy"));
    let mut yaml = yaml_of(map, options.mode, image_name.clone(), sum_of(&image));
    if let (Some(name), Some(bytes)) = (&array_name, &array) {
        yaml.sums.push(FileSum {
            sum: sum_of(bytes),
            name: name.clone(),
        });
    }

    let had_log_odds = names.had_log_odds();
    let image_path = names.folder.join(&image_name);
    let array_path = array_name.map(|name| names.folder.join(name));
    // a full or failing disk shows here, before any name changes
    let mut staged = vec![Staged::new(&image_path, &image)?];
    if let (Some(path), Some(bytes)) = (&array_path, &array) {
        staged.push(Staged::new(path, bytes)?);
    }
    let yaml_file = Staged::new(&names.yaml, yaml.text().as_bytes())?;
    let mut unnamed = Unnamed(Vec::new());
    for file in staged {
        if generation.is_some() {
            unnamed.0.push(file.path.clone());
        }
        file.commit()?;
    }
    // from here on the new files may be the map, whatever happens
    unnamed.0.clear();
    yaml_file.commit()?;

    let mut notes = Vec::new();
    names.publish(
        array_path.as_deref(),
        array.as_deref(),
        had_log_odds,
        &mut notes,
    );
    names.tidy(generation, &mut notes);
    Ok(SavedMap {
        yaml: names.yaml,
        image: image_path,
        log_odds: array_path,
        notes,
    })
}

/// Files that no YAML names yet: removed again if the save fails before its commit.
struct Unnamed(Vec<PathBuf>);

impl Drop for Unnamed {
    fn drop(&mut self) {
        for path in &self.0 {
            // the next save removes what stays
            let _ = fs::remove_file(path);
        }
    }
}

/// A file whose bytes are on the disk under a temporary name beside its own.
struct Staged {
    path: PathBuf,
    file: AtomicWriteFile,
}

impl Staged {
    fn new(path: &Path, bytes: &[u8]) -> Result<Self, MapFileError> {
        let mut options = OpenOptions::new();
        #[cfg(unix)]
        {
            use atomic_write_file::unix::OpenOptionsExt as _;
            // file systems without owners refuse it, and a map needs none
            options.preserve_owner(false);
        }
        let write = || {
            let mut file = options.open(path)?;
            file.write_all(bytes)?;
            file.sync_all()?;
            Ok(file)
        };
        let file = write().map_err(|e| MapFileError::io(path, "write", e))?;
        Ok(Self {
            path: path.to_path_buf(),
            file,
        })
    }

    /// Gives the file its name, and makes that durable too.
    fn commit(self) -> Result<(), MapFileError> {
        self.file
            .commit()
            .map_err(|e| MapFileError::io(&self.path, "rename", e))
    }
}

/// Time between two tries for the lock: shorter than a save, so that one that saves again and again starves
/// nobody.
const LOCK_POLL: Duration = Duration::from_micros(500);

/// Longest wait for another save into the same folder.
const LOCK_PATIENCE: Duration = Duration::from_secs(10);

/// Keeps other saves out of the folder while it lives; nothing where the system cannot lock folders.
fn lock(folder: &Path) -> Result<Option<File>, MapFileError> {
    let Ok(opened) = File::open(folder) else {
        return Ok(None);
    };
    let start = Instant::now();
    loop {
        match opened.try_lock() {
            Ok(()) => return Ok(Some(opened)),
            Err(TryLockError::WouldBlock) if start.elapsed() < LOCK_PATIENCE => {
                std::thread::sleep(LOCK_POLL);
            }
            Err(TryLockError::WouldBlock) => {
                let e = io::Error::new(io::ErrorKind::WouldBlock, "another save holds the folder");
                return Err(MapFileError::io(folder, "lock", e));
            }
            Err(TryLockError::Error(_)) => return Ok(None),
        }
    }
}

fn extension(mode: MapMode) -> &'static str {
    match mode {
        MapMode::Trinary | MapMode::Raw => "pgm",
        MapMode::Scale => "png",
    }
}

fn npy_bytes(frame: &MapFrame, values: &[f32]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(128 + 4 * values.len());
    npy::write(&mut bytes, frame.height(), frame.width(), values).expect("a Vec takes every byte");
    bytes
}

/// The YAML with thresholds that make the picture read back as the same values.
fn yaml_of(map: &OccupancyMap, mode: MapMode, image: String, sum: String) -> MapYaml {
    let (free_thresh, occupied_thresh) = match mode {
        // 205 is p = 0.19608, just above 0.196: what Nav2's own saver writes
        MapMode::Trinary => (0.196, 0.65),
        MapMode::Scale => (0.0, 1.0),
        MapMode::Raw => {
            let free = map.free_at_most().clamp(0, 99);
            let occupied = map.occupied_at_least().clamp(free + 1, 100);
            (f64::from(free) / 100.0, f64::from(occupied) / 100.0)
        }
    };
    let name = image.clone();
    MapYaml {
        image,
        mode,
        resolution: map.frame().resolution(),
        origin: map.frame().origin(),
        negate: false,
        occupied_thresh,
        free_thresh,
        sums: vec![FileSum { sum, name }],
    }
}

fn encode(file: &Path, map: &OccupancyMap, mode: MapMode) -> Result<Vec<u8>, MapFileError> {
    match mode {
        MapMode::Trinary => Ok(pgm(map, |value| match map.classify(value) {
            _ if !(0..=100).contains(&value) => 205,
            CellState::Free => 254,
            CellState::Occupied => 0,
            CellState::Unknown => 205,
        })),
        MapMode::Raw => Ok(pgm(map, |value| match value {
            0..=100 => value as u8,
            _ => 255,
        })),
        #[cfg(feature = "image")]
        MapMode::Scale => crate::map_png::encode_scale(map)
            .map_err(|e| MapFileError::io(file, "encode PNG", io::Error::other(e))),
        #[cfg(not(feature = "image"))]
        MapMode::Scale => {
            let expected = "trinary or raw (scale writes PNG, which needs the feature `image`)";
            Err(MapFileError::content(file, "mode", expected, "scale"))
        }
    }
}

/// A P5 picture of the map.
fn pgm(map: &OccupancyMap, grey_of: impl Fn(i8) -> u8) -> Vec<u8> {
    let frame = map.frame();
    let table: [u8; 256] = std::array::from_fn(|v| grey_of(v as u8 as i8));
    let mut bytes = format!("P5\n{} {}\n255\n", frame.width(), frame.height()).into_bytes();
    bytes.extend(map.values().iter().map(|&v| table[usize::from(v as u8)]));
    bytes
}
