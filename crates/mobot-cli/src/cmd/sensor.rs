//! Sensor parameters and sonar logs, as files.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};
use occgrid::{Profile, Shot, SonarModel, read_log};

use crate::args::ProfileArg;

/// A sensor file is a handful of lines.
const MOST_BYTES: u64 = 64 * 1024;

/// Reads a sensor file and applies the profile asked for on the command line.
pub(super) fn read(path: &Path, profile: Option<ProfileArg>) -> anyhow::Result<SonarModel> {
    let name = path.display();
    let text = super::read_text(path, MOST_BYTES)?;
    let mut model: SonarModel = toml::from_str(&text).map_err(|e| {
        let line = e
            .span()
            .map_or(1, |span| text[..span.start].matches('\n').count() + 1);
        anyhow!("{name}: line {line}: {}", e.message().replace('\n', " "))
    })?;
    match profile {
        Some(ProfileArg::Smooth) => model.profile = Profile::Smooth,
        Some(ProfileArg::Literal) => model.profile = Profile::Literal,
        None => {}
    }
    model.validate().with_context(|| format!("{name}"))?;
    Ok(model)
}

/// Reads a sonar log.
pub(super) fn shots(path: &Path) -> anyhow::Result<Vec<Shot>> {
    let name = path.display();
    let meta = std::fs::metadata(path).with_context(|| format!("{name}"))?;
    if !meta.is_file() {
        anyhow::bail!("{name}: expected a file, found something else");
    }
    let file = std::fs::File::open(path).with_context(|| format!("{name}"))?;
    read_log(file).with_context(|| format!("{name}"))
}

/// Where `mobot map` keeps a copy of the sensor file, for `mobot why`.
pub(super) fn copy_beside(map: &Path) -> PathBuf {
    map.with_extension("sensor.toml")
}
