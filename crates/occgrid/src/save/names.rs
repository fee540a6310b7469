//! The names that belong to one map: its generations, what is published, what an interrupted save left.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::Staged;
use crate::MapFileError;
use crate::map_file_error::quoted;
use crate::map_server::folder_of;
use crate::map_yaml::FileSum;

/// The names that belong to one map.
pub(super) struct Names {
    pub(super) folder: PathBuf,
    pub(super) yaml: PathBuf,
    /// `NAME` of `NAME.yaml`.
    stem: String,
}

/// The extensions of files that are written beside a YAML.
const BESIDE: [&str; 3] = ["pgm", "png", "npy"];

/// Digits of a generation, at least.
const DIGITS: usize = 6;

impl Names {
    pub(super) fn new(yaml: &Path) -> Result<Self, MapFileError> {
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

    pub(super) fn file(&self, generation: Option<u64>, extension: &str) -> String {
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

    pub(super) fn newest_generation(&self) -> Result<u64, MapFileError> {
        let names = self
            .names_in_folder()
            .map_err(|e| MapFileError::io(&self.folder, "list", e))?;
        let generations = names.iter().filter_map(|name| self.generation(name));
        Ok(generations.max().unwrap_or(0))
    }

    /// Whether the YAML in place was saved with log-odds.
    pub(super) fn had_log_odds(&self) -> bool {
        fs::read_to_string(&self.yaml)
            .is_ok_and(|text| FileSum::all_of(&text).any(|file| file.name.ends_with(".npy")))
    }

    /// Makes `NAME.npy` the committed log-odds, or removes it where the map has none any more.
    pub(super) fn publish(
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
    pub(super) fn tidy(&self, current: Option<u64>, notes: &mut Vec<String>) {
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
