//! Saving a map so that a crash, a full disk or a failing one leaves the old map or the new map, whole.
//!
//! The picture and the log-odds are written under names of their own (`NAME.000012.pgm`,
//! `NAME.000012.npy`), each made durable before the next step; then the YAML that names them and
//! carries their SHA-256 replaces the old YAML in one rename. That rename is the commit. After it,
//! `NAME.npy` is published and older generations are removed.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use atomic_write_file::{AtomicWriteFile, OpenOptions};

use crate::map_file_error::quoted;
use crate::map_server::{folder_of, sum_of};
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
                std::thread::sleep(Duration::from_millis(5));
            }
            Err(TryLockError::WouldBlock) => {
                let e = io::Error::new(io::ErrorKind::WouldBlock, "another save holds the folder");
                return Err(MapFileError::io(folder, "lock", e));
            }
            Err(TryLockError::Error(_)) => return Ok(None),
        }
    }
}

/// The names that belong to one map.
struct Names {
    folder: PathBuf,
    yaml: PathBuf,
    /// `NAME` of `NAME.yaml`.
    stem: String,
}

/// The extensions of files that are written beside a YAML.
const BESIDE: [&str; 3] = ["pgm", "png", "npy"];

/// Digits of a generation, at least.
const DIGITS: usize = 6;

impl Names {
    fn new(yaml: &Path) -> Result<Self, MapFileError> {
        let refused = |found: &str| {
            let expected = "a name such as map.yaml";
            MapFileError::content(yaml, "file name", expected, quoted(found))
        };
        let name = yaml.file_name().unwrap_or_default();
        let Some(name) = name.to_str() else {
            return Err(refused(&name.to_string_lossy()));
        };
        let (stem, extension) = name.rsplit_once('.').unwrap_or((name, ""));
        let looks_like_ours = stem
            .rsplit_once('.')
            .is_some_and(|(_, digits)| generation_of(digits).is_some());
        let clash = BESIDE.contains(&extension) || extension == "bmp";
        if stem.is_empty() || clash || looks_like_ours || name.contains(char::is_control) {
            return Err(refused(name));
        }
        Ok(Self {
            folder: folder_of(yaml).to_path_buf(),
            yaml: yaml.to_path_buf(),
            stem: stem.to_owned(),
        })
    }

    fn file(&self, generation: Option<u64>, extension: &str) -> String {
        match generation {
            Some(number) => format!("{}.{number:0DIGITS$}.{extension}", self.stem),
            None => format!("{}.{extension}", self.stem),
        }
    }

    /// The generation of a file written beside this YAML.
    fn generation(&self, name: &str) -> Option<u64> {
        let rest = name.strip_prefix(&self.stem)?.strip_prefix('.')?;
        let (digits, extension) = rest.split_once('.')?;
        BESIDE.contains(&extension).then_some(())?;
        generation_of(digits)
    }

    /// Whether this is a temporary file of an interrupted save: `.FINAL.XXXXXX`.
    fn is_leftover(&self, name: &str) -> bool {
        let Some((target, random)) = name.strip_prefix('.').and_then(|n| n.rsplit_once('.')) else {
            return false;
        };
        let is_random = random.len() == 6 && random.bytes().all(|b| b.is_ascii_alphanumeric());
        let is_ours = self.yaml.file_name().is_some_and(|yaml| yaml == target)
            || self.generation(target).is_some()
            || BESIDE.iter().any(|e| self.file(None, e) == target);
        is_random && is_ours
    }

    fn names_in_folder(&self) -> io::Result<Vec<String>> {
        let mut names = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            names.extend(entry?.file_name().into_string());
        }
        Ok(names)
    }

    fn newest_generation(&self) -> Result<u64, MapFileError> {
        let names = self
            .names_in_folder()
            .map_err(|e| MapFileError::io(&self.folder, "list", e))?;
        let generations = names.iter().filter_map(|name| self.generation(name));
        Ok(generations.max().unwrap_or(0))
    }

    /// Whether the YAML in place was saved with log-odds.
    fn had_log_odds(&self) -> bool {
        fs::read_to_string(&self.yaml)
            .is_ok_and(|text| FileSum::all_of(&text).any(|file| file.name.ends_with(".npy")))
    }

    /// Makes `NAME.npy` the committed log-odds, or removes it where the map has none any more.
    fn publish(
        &self,
        array_path: Option<&Path>,
        array: Option<&[u8]>,
        had_log_odds: bool,
        notes: &mut Vec<String>,
    ) {
        let published = self.folder.join(self.file(None, "npy"));
        let result = match (array_path, array) {
            (Some(path), Some(_)) if path == published => Ok(()),
            (Some(path), Some(bytes)) => self.link(path, &published).or_else(|_| {
                // file systems without hard links get a copy
                let copy = Staged::new(&published, bytes).and_then(Staged::commit);
                copy.map_err(|e| e.to_string())
            }),
            _ if had_log_odds => match fs::remove_file(&published) {
                Err(e) if e.kind() != io::ErrorKind::NotFound => Err(e.to_string()),
                _ => Ok(()),
            },
            _ => Ok(()),
        };
        if let Err(e) = result {
            notes.push(format!("{}: {e}", crate::map_file_error::shown(&published)));
        }
    }

    fn link(&self, path: &Path, published: &Path) -> Result<(), String> {
        // the name of a leftover, so that an interrupted save's is removed by the next
        let between = self.folder.join(format!(".{}.npy.linked", self.stem));
        let linked = || {
            let _ = fs::remove_file(&between);
            fs::hard_link(path, &between)?;
            fs::rename(&between, published)
        };
        linked().map_err(|e: io::Error| e.to_string())
    }

    /// Removes older generations and what interrupted saves left.
    fn tidy(&self, current: Option<u64>, notes: &mut Vec<String>) {
        let names = match self.names_in_folder() {
            Ok(names) => names,
            Err(e) => {
                notes.push(format!(
                    "{}: {e}",
                    crate::map_file_error::shown(&self.folder)
                ));
                return;
            }
        };
        for name in names {
            let old = self.generation(&name).is_some_and(|g| Some(g) != current);
            if !old && !self.is_leftover(&name) {
                continue;
            }
            if let Err(e) = fs::remove_file(self.folder.join(&name)) {
                notes.push(format!("{}: {e}", quoted(&name)));
            }
        }
    }
}

fn generation_of(digits: &str) -> Option<u64> {
    let is_number = digits.len() >= DIGITS && digits.bytes().all(|b| b.is_ascii_digit());
    // far from the end, so that the next one exists
    is_number
        .then(|| digits.parse().ok())?
        .filter(|&n: &u64| n < u64::MAX / 2)
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
