//! What leaves the program: JSON and text on stdout, whole files, progress on stderr.

use std::io::{IsTerminal as _, Write as _};
use std::path::Path;
use std::time::Duration;

use anyhow::Context as _;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

/// How a command ended when nothing was wrong with its input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Exit status 0.
    Done,
    /// The answer is "no": exit status 1.
    No,
}

/// Where a command's answers and progress go.
#[derive(Debug)]
pub struct Output {
    json: bool,
    silent: bool,
    bar: Option<ProgressBar>,
}

impl Output {
    /// JSON or text; progress only where stderr is a terminal and it was not silenced.
    #[must_use]
    pub fn new(json: bool, quiet: bool) -> Self {
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        });
        Self {
            json,
            silent: false,
            bar,
        }
    }

    /// Neither answers nor progress: a command that runs inside another.
    #[must_use]
    pub const fn silent() -> Self {
        Self {
            json: false,
            silent: true,
            bar: None,
        }
    }

    /// Says on stderr what is being done now.
    pub fn stage(&self, what: impl Into<String>) {
        if let Some(bar) = &self.bar {
            bar.set_message(what.into());
        }
    }

    /// The answer: one JSON object, or the text.
    ///
    /// # Errors
    /// If stdout cannot be written.
    pub fn answer(
        &self,
        json: &impl Serialize,
        text: impl FnOnce() -> String,
    ) -> anyhow::Result<()> {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        if self.silent {
            return Ok(());
        }
        let line = if self.json {
            serde_json::to_string(json)?
        } else {
            text()
        };
        line_to_stdout(&line)
    }

    /// One JSON object of a batch, whether or not `--json` was given.
    ///
    /// # Errors
    /// If stdout cannot be written.
    pub fn batch_line(&self, json: &impl Serialize) -> anyhow::Result<()> {
        if self.silent {
            return Ok(());
        }
        line_to_stdout(&serde_json::to_string(json)?)
    }
}

/// A line on stdout; a reader that has gone away (`| head`) is no fault.
fn line_to_stdout(line: &str) -> anyhow::Result<()> {
    let mut stdout = std::io::stdout().lock();
    match writeln!(stdout, "{line}").and_then(|()| stdout.flush()) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => other.context("stdout"),
    }
}

/// Writes a file whole: under its final name there is the old content or the new, never a part.
///
/// # Errors
/// If the file or its folder cannot be written.
pub fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder)?;
    }
    let mut file = atomic_write_file::AtomicWriteFile::open(path)?;
    file.write_all(bytes)?;
    file.commit()
}
