//! The YAML half of a map: parsed within bounds, checked value by value, written.

use std::fmt::Write as _;
use std::path::Path;

use serde::Deserialize;
use serde::de::{Deserializer, Visitor};
use serde_saphyr::Spanned;

use crate::map_file_error::quoted;
use crate::{LoadOptions, MapFileError, MapMode, Pose2};

/// What a map's YAML says, checked.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MapYaml {
    pub(crate) image: String,
    pub(crate) mode: MapMode,
    pub(crate) resolution: f64,
    pub(crate) origin: Pose2,
    pub(crate) negate: bool,
    pub(crate) occupied_thresh: f64,
    pub(crate) free_thresh: f64,
    /// The files that were saved with it, from the comments.
    pub(crate) sums: Vec<FileSum>,
}

/// A comment line `# sha256: SUM NAME`: a file that the map was saved with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FileSum {
    /// 64 lower-case hexadecimal digits.
    pub(crate) sum: String,
    pub(crate) name: String,
}

/// The start of the comment lines that name files and their sums.
const SUM_COMMENT: &str = "# sha256: ";

#[derive(Deserialize)]
struct Document {
    image: Option<Spanned<String>>,
    mode: Option<Spanned<String>>,
    resolution: Option<Spanned<f64>>,
    origin: Option<Spanned<Vec<f64>>>,
    negate: Option<Spanned<Flag>>,
    occupied_thresh: Option<Spanned<f64>>,
    free_thresh: Option<Spanned<f64>>,
}

/// `negate`: a number or a truth value, as yaml-cpp reads either.
struct Flag(bool);

impl<'de> Deserialize<'de> for Flag {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(FlagVisitor)
    }
}

struct FlagVisitor;

impl Visitor<'_> for FlagVisitor {
    type Value = Flag;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("an integer or a truth value")
    }

    fn visit_bool<E>(self, value: bool) -> Result<Flag, E> {
        Ok(Flag(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Flag, E> {
        Ok(Flag(value != 0))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Flag, E> {
        Ok(Flag(value != 0))
    }

    fn visit_str<E: serde::de::Error>(self, value: &str) -> Result<Flag, E> {
        if let Ok(number) = value.parse::<i32>() {
            return Ok(Flag(number != 0));
        }
        match value.to_ascii_lowercase().as_str() {
            "y" | "yes" | "true" | "on" => Ok(Flag(true)),
            "n" | "no" | "false" | "off" => Ok(Flag(false)),
            _ => Err(E::custom(format!(
                "expected an integer or a truth value for negate, found {}",
                quoted(value)
            ))),
        }
    }
}

impl MapYaml {
    /// Reads the YAML in `bytes`; `file` is named in messages.
    pub(crate) fn parse(
        file: &Path,
        bytes: &[u8],
        options: &LoadOptions,
    ) -> Result<Self, MapFileError> {
        let text = std::str::from_utf8(bytes).map_err(|e| {
            let place = format!("byte {}", e.valid_up_to());
            MapFileError::content(file, place, "UTF-8 text", "other bytes")
        })?;
        let document = parse_document(file, text, options)?;
        let check = Check { file };
        let yaml = Self {
            image: check.image(&document)?,
            mode: check.mode(&document)?,
            resolution: check.resolution(&document)?,
            origin: check.origin(&document)?,
            negate: check.present("negate", document.negate.as_ref())?.value.0,
            occupied_thresh: check.threshold("occupied_thresh", &document.occupied_thresh)?,
            free_thresh: check.threshold("free_thresh", &document.free_thresh)?,
            sums: FileSum::all_of(text).collect(),
        };
        if yaml.free_thresh >= yaml.occupied_thresh {
            return Err(MapFileError::content(
                file,
                place_of("free_thresh", document.free_thresh.as_ref()),
                format!("less than occupied_thresh ({})", yaml.occupied_thresh),
                yaml.free_thresh.to_string(),
            ));
        }
        Ok(yaml)
    }

    /// The text of the file, with every number in the fewest digits that read back as the same.
    pub(crate) fn text(&self) -> String {
        let mut out = String::new();
        let Pose2 { x, y, theta } = self.origin;
        let _ = write!(
            out,
            "image: {}\nmode: {}\nresolution: {}\norigin: [{}, {}, {}]\n\
             negate: {}\noccupied_thresh: {}\nfree_thresh: {}\n",
            in_double_quotes(&self.image),
            self.mode.name(),
            decimal(self.resolution),
            decimal(x),
            decimal(y),
            decimal(theta),
            u8::from(self.negate),
            decimal(self.occupied_thresh),
            decimal(self.free_thresh),
        );
        for FileSum { sum, name } in &self.sums {
            let _ = writeln!(out, "{SUM_COMMENT}{sum} {name}");
        }
        out
    }
}

impl MapYaml {
    /// The sum of a file that the map was saved with.
    pub(crate) fn sum_of(&self, name: &str) -> Option<&str> {
        let file = self.sums.iter().find(|file| file.name == name)?;
        Some(&file.sum)
    }

    /// The log-odds that the map was saved with.
    pub(crate) fn log_odds_file(&self) -> Option<&FileSum> {
        self.sums.iter().find(|file| file.name.ends_with(".npy"))
    }
}

impl FileSum {
    /// Those in the comments of a YAML.
    pub(crate) fn all_of(text: &str) -> impl Iterator<Item = Self> {
        text.lines().filter_map(Self::of_comment)
    }

    fn of_comment(line: &str) -> Option<Self> {
        let (sum, name) = line.strip_prefix(SUM_COMMENT)?.split_once(' ')?;
        let is_sum = sum.len() == 64 && sum.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
        let name = name.trim_end();
        // a name in the map's own folder
        let is_name = !name.is_empty() && !name.contains(['/', '\\']);
        (is_sum && is_name).then(|| Self {
            sum: sum.to_owned(),
            name: name.to_owned(),
        })
    }
}

/// The shortest decimal that reads back as the same number; never with an exponent, which YAML 1.1
/// readers take for text where there is no point before it.
fn decimal(value: f64) -> String {
    let mut text = value.to_string();
    if !text.contains('.') {
        text.push_str(".0");
    }
    text
}

/// A plain word as it is, anything else as a double-quoted YAML scalar.
fn in_double_quotes(text: &str) -> String {
    let plain = text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-'));
    // file names end in .pgm or .png here, so a plain one is never a number or a truth value
    if plain {
        return text.to_owned();
    }
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04x}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

fn parse_document(
    file: &Path,
    text: &str,
    options: &LoadOptions,
) -> Result<Document, MapFileError> {
    let parser = serde_saphyr::options! {
        budget: serde_saphyr::budget! {
            max_depth: options.max_yaml_depth,
            flow_nesting_limit: options.max_yaml_depth,
            max_nodes: options.max_yaml_nodes,
            max_events: options.max_yaml_nodes.saturating_mul(4),
            max_aliases: 0,
            max_documents: 1,
        },
        duplicate_keys: serde_saphyr::options::DuplicateKeyPolicy::Error,
    };
    serde_saphyr::from_str_with_options(text, parser).map_err(|e| {
        let place = e.location().map_or_else(
            || "YAML".to_owned(),
            |at| format!("line {}, column {}", at.line(), at.column()),
        );
        let rendered = e.render_with_options(serde_saphyr::render_options! {
            snippets: serde_saphyr::SnippetMode::Off,
        });
        MapFileError::content(file, place, "a map_server YAML", quoted(&rendered))
    })
}

fn place_of<T>(key: &str, value: Option<&Spanned<T>>) -> String {
    value.map_or_else(
        || key.to_owned(),
        |v| {
            let at = v.referenced;
            format!("line {}, column {} ({key})", at.line(), at.column())
        },
    )
}

/// The checks of single values.
struct Check<'a> {
    file: &'a Path,
}

impl Check<'_> {
    fn present<'v, T>(
        &self,
        key: &str,
        value: Option<&'v Spanned<T>>,
    ) -> Result<&'v Spanned<T>, MapFileError> {
        value.ok_or_else(|| {
            MapFileError::content(self.file, "keys", format!("a value for {key}"), "none")
        })
    }

    fn wrong<T>(
        &self,
        key: &str,
        value: &Spanned<T>,
        expected: &str,
        found: impl Into<String>,
    ) -> MapFileError {
        MapFileError::content(self.file, place_of(key, Some(value)), expected, found)
    }

    fn image(&self, document: &Document) -> Result<String, MapFileError> {
        let image = self.present("image", document.image.as_ref())?;
        if image.value.is_empty() || image.value.contains('\0') {
            let found = quoted(&image.value);
            return Err(self.wrong("image", image, "the name of a file", found));
        }
        Ok(image.value.clone())
    }

    fn mode(&self, document: &Document) -> Result<MapMode, MapFileError> {
        let Some(mode) = &document.mode else {
            return Ok(MapMode::Trinary);
        };
        match mode.value.to_ascii_lowercase().as_str() {
            "trinary" => Ok(MapMode::Trinary),
            "scale" => Ok(MapMode::Scale),
            "raw" => Ok(MapMode::Raw),
            _ => {
                let found = quoted(&mode.value);
                Err(self.wrong("mode", mode, "trinary, scale or raw", found))
            }
        }
    }

    fn resolution(&self, document: &Document) -> Result<f64, MapFileError> {
        let resolution = self.present("resolution", document.resolution.as_ref())?;
        if !(1e-6..=100.0).contains(&resolution.value) {
            let found = resolution.value.to_string();
            let expected = "0.000001 to 100 m a cell";
            return Err(self.wrong("resolution", resolution, expected, found));
        }
        Ok(resolution.value)
    }

    fn origin(&self, document: &Document) -> Result<Pose2, MapFileError> {
        let origin = self.present("origin", document.origin.as_ref())?;
        match origin.value.as_slice() {
            &[x, y, theta] if [x, y, theta].iter().all(|v| v.is_finite()) => {
                Ok(Pose2::new(x, y, theta))
            }
            numbers => {
                let found = match numbers {
                    [_, _, _] => format!("{numbers:?}"),
                    _ => format!("{} numbers", numbers.len()),
                };
                let expected = "three finite numbers, x [m], y [m] and yaw [rad]";
                Err(self.wrong("origin", origin, expected, found))
            }
        }
    }

    fn threshold(&self, key: &str, value: &Option<Spanned<f64>>) -> Result<f64, MapFileError> {
        let threshold = self.present(key, value.as_ref())?;
        if !(0.0..=1.0).contains(&threshold.value) {
            let found = threshold.value.to_string();
            return Err(self.wrong(key, threshold, "0 to 1", found));
        }
        Ok(threshold.value)
    }
}
