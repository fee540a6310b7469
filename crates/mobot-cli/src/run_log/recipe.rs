//! What a run was told to do, so that it can be done again: a subcommand, its options, and the files that
//! they name.

use std::ffi::OsString;
use std::io::{self, Read};
use std::path::Path;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::read::{LogError, LogReader, Message};
use super::write::LogWriter;

/// The name of the recipe among a log's inputs.
const NAME: &str = "command.json";

/// A subcommand with its options. Options that name files hold the files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// The subcommand.
    pub command: String,
    /// Its options in order.
    pub options: Vec<RecipeOption>,
    #[serde(skip)]
    files: Vec<(String, Vec<u8>)>,
}

/// An option and its value.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecipeOption {
    /// With its dashes.
    pub name: String,
    /// What was typed, or the name of a file among the log's inputs.
    pub value: String,
    /// Whether the value names a file.
    pub file: bool,
}

/// Why a log cannot be run again.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecipeError {
    /// The log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// There is no recipe at its start.
    #[error("expected the log of a mission, found no command in it")]
    Missing,
    /// It is no recipe.
    #[error("{NAME} in the log: {0}")]
    Json(String),
    /// A file's name that leads elsewhere, or a file that is not there.
    #[error("{NAME} in the log: expected a file of the log, found {found:?}")]
    File {
        /// Its name.
        found: String,
    },
    /// The folder for its files.
    #[error("{0}")]
    Io(#[from] io::Error),
}

impl Recipe {
    /// Of a subcommand.
    #[must_use]
    pub fn of(command: &str) -> Self {
        Self {
            command: command.into(),
            options: Vec::new(),
            files: Vec::new(),
        }
    }

    /// With an option. Numbers print so that they read back to the bit.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl std::fmt::Display) -> Self {
        self.options.push(RecipeOption {
            name: name.into(),
            value: value.to_string(),
            file: false,
        });
        self
    }

    /// With an option that names a file: `value` is the name it gets, of letters, digits, `.`, `-` and `_`.
    #[must_use]
    pub fn with_file(mut self, name: &str, value: &str, bytes: Vec<u8>) -> Self {
        self.options.push(RecipeOption {
            name: name.into(),
            value: value.into(),
            file: true,
        });
        self.beside(value, bytes)
    }

    /// With a file that another file names.
    #[must_use]
    pub fn beside(mut self, name: &str, bytes: Vec<u8>) -> Self {
        self.files.push((name.into(), bytes));
        self
    }

    /// Puts it into a log, before anything else.
    pub fn write(&self, log: &LogWriter) {
        let json = serde_json::to_vec(self).unwrap_or_default();
        log.input(NAME, &json);
        for (name, bytes) in &self.files {
            log.input(name, bytes);
        }
    }

    /// The recipe at the start of a log.
    ///
    /// # Errors
    /// [`RecipeError`]
    pub fn read<R: Read>(log: LogReader<R>) -> Result<Self, RecipeError> {
        let mut recipe: Option<Self> = None;
        for entry in log {
            match (entry?.message, &mut recipe) {
                (Message::Input(input), None) if input.name == NAME => {
                    let read = serde_json::from_slice(&input.data);
                    recipe = Some(read.map_err(|e| RecipeError::Json(e.to_string()))?);
                }
                (Message::Input(input), Some(recipe)) => {
                    recipe.files.push((input.name, input.data));
                }
                (Message::Event(_), _) => {}
                _ => break,
            }
        }
        recipe.ok_or(RecipeError::Missing)
    }

    /// Puts its files into a folder; gives the options as they are typed.
    ///
    /// # Errors
    /// [`RecipeError::File`], [`RecipeError::Io`]
    pub fn unpack(&self, folder: &Path) -> Result<Vec<OsString>, RecipeError> {
        let refused = |name: &str| RecipeError::File { found: name.into() };
        for (name, bytes) in &self.files {
            if !is_plain(name) {
                return Err(refused(name));
            }
            std::fs::write(folder.join(name), bytes)?;
        }
        let mut typed = Vec::new();
        for option in &self.options {
            let value = if option.file {
                let known = self.files.iter().any(|(name, _)| *name == option.value);
                if !known {
                    return Err(refused(&option.value));
                }
                folder.join(&option.value).into_os_string()
            } else {
                OsString::from(&option.value)
            };
            let mut word = OsString::from(&option.name);
            word.push("=");
            word.push(value);
            typed.push(word);
        }
        Ok(typed)
    }
}

/// Whether a name is a file's in the folder at hand.
fn is_plain(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    !name.is_empty() && name.len() < 256 && !name.starts_with('.') && name.chars().all(plain)
}
