//! Pictures of what a command did: a map in grey, lines and marks on it, as SVG or PNG.

mod calibration;
mod canvas;
mod fix;
mod overlay;
mod raster;
mod scene;
mod svg;

use std::path::Path;

use anyhow::{Context, bail};

pub use calibration::calibration;
pub use fix::fix_overlay;
pub use overlay::{OVERLAY_SIDE_PX, Overlay, Panel};
pub use scene::{Color, Mark, Scene, Stroke, clearance_color};
pub(crate) use svg::{escape, render as svg};

/// The formats that a picture's file name may ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Opens in a browser at any zoom.
    Svg,
    /// For a quick look.
    Png,
}

/// The format that a file name asks for.
///
/// # Errors
/// If the name ends neither in `.svg` nor in `.png`.
pub fn format_of(path: &Path) -> anyhow::Result<Format> {
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .map(str::to_ascii_lowercase);
    match extension.as_deref() {
        Some("svg") => Ok(Format::Svg),
        Some("png") => Ok(Format::Png),
        _ => bail!(
            "{}: expected a picture name ending in .svg or .png",
            path.display()
        ),
    }
}

/// Draws a scene into a file; the file appears whole or not at all.
///
/// # Errors
/// If the name's ending is unknown, or the file cannot be written.
pub fn save(scene: &Scene, path: &Path) -> anyhow::Result<()> {
    let bytes = match format_of(path)? {
        Format::Svg => svg::render(scene)?.into_bytes(),
        Format::Png => raster::render(scene)?,
    };
    crate::output::write_whole(path, &bytes).with_context(|| format!("{}", path.display()))
}

/// Draws an overlay into a file; the file appears whole or not at all.
///
/// # Errors
/// If the name's ending is unknown, or the file cannot be written.
pub fn save_overlay(overlay: &Overlay, path: &Path) -> anyhow::Result<()> {
    let bytes = match format_of(path)? {
        Format::Svg => overlay.to_svg()?.into_bytes(),
        Format::Png => overlay.to_png()?,
    };
    crate::output::write_whole(path, &bytes).with_context(|| format!("{}", path.display()))
}

/// An overlay as PNG bytes.
pub(crate) fn overlay_png(overlay: &Overlay) -> anyhow::Result<Vec<u8>> {
    overlay.to_png()
}

/// A colour image as PNG bytes.
///
/// # Errors
/// If the encoder fails.
pub fn rgb_png(picture: &image::RgbImage) -> anyhow::Result<Vec<u8>> {
    let (width, height) = picture.dimensions();
    raster::encode(width, height, picture, image::ExtendedColorType::Rgb8)
}

/// A grey image as PNG bytes.
///
/// # Errors
/// If the encoder fails.
pub fn gray_png(width: u32, height: u32, pixels: &[u8]) -> anyhow::Result<Vec<u8>> {
    raster::encode(width, height, pixels, image::ExtendedColorType::L8)
}
