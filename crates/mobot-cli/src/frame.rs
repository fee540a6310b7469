//! Camera frames from files: PNG, JPEG or PNM with 8 bits a channel, gray or colour, within bounds.

use std::path::Path;

use anyhow::{Context as _, bail};
use image::{
    ColorType, DynamicImage, GrayImage, ImageDecoder as _, ImageReader, Limits, Luma, RgbImage,
};

/// The largest file [bytes].
const MOST_BYTES: u64 = 64 << 20;
/// The largest side of a frame [px].
const MOST_SIDE: u32 = 8192;
/// The smallest side of a frame [px].
const LEAST_SIDE: u32 = 8;
/// The largest frame [px].
const MOST_PIXELS: u64 = 32_000_000;

/// A frame.
#[derive(Debug, Clone)]
pub struct Frame(DynamicImage);

impl Frame {
    /// Reads a frame; its size and kind are looked at before its pixels.
    ///
    /// # Errors
    /// For files that are no such picture; the message names the file.
    pub fn load(path: &Path) -> anyhow::Result<Self> {
        Self::read(path).with_context(|| format!("{}", path.display()))
    }

    fn read(path: &Path) -> anyhow::Result<Self> {
        let meta = std::fs::metadata(path)?;
        if !meta.is_file() {
            bail!("expected a file, found something else");
        }
        if meta.len() > MOST_BYTES {
            bail!(
                "expected a picture of at most {MOST_BYTES} bytes, found {}",
                meta.len()
            );
        }
        let reader = ImageReader::open(path)?.with_guessed_format()?;
        if reader.format().is_none() {
            bail!("expected a PNG, JPEG or PNM picture, found something else");
        }
        let mut decoder = reader.into_decoder().map_err(one_line)?;
        let (width, height) = decoder.dimensions();
        let sides = LEAST_SIDE..=MOST_SIDE;
        let pixels = u64::from(width) * u64::from(height);
        if !sides.contains(&width) || !sides.contains(&height) || pixels > MOST_PIXELS {
            bail!(
                "expected {LEAST_SIDE} to {MOST_SIDE} pixels a side and at most {MOST_PIXELS} in all, found {width} x {height}"
            );
        }
        match decoder.color_type() {
            ColorType::L8 | ColorType::Rgb8 => {}
            other => {
                bail!("expected 8 bits a channel, gray or colour, without alpha, found {other:?}")
            }
        }
        let mut limits = Limits::default();
        limits.max_alloc = Some(16 * MOST_PIXELS);
        decoder.set_limits(limits).map_err(one_line)?;
        Ok(Self(DynamicImage::from_decoder(decoder).map_err(one_line)?))
    }

    /// Width and height [px].
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [self.0.width(), self.0.height()]
    }

    /// In gray: ITU-R 601 luma of colours, rounded as OpenCV does.
    #[must_use]
    pub fn to_gray(&self) -> GrayImage {
        let DynamicImage::ImageRgb8(colours) = &self.0 else {
            return self.0.to_luma8();
        };
        GrayImage::from_fn(colours.width(), colours.height(), |column, row| {
            let [r, g, b] = colours.get_pixel(column, row).0.map(u32::from);
            Luma([((4899 * r + 9617 * g + 1868 * b + 8192) >> 14) as u8])
        })
    }

    /// In colour.
    #[must_use]
    pub fn to_rgb(&self) -> RgbImage {
        self.0.to_rgb8()
    }
}

/// The decoder's complaint in one line.
fn one_line(error: image::ImageError) -> anyhow::Error {
    anyhow::anyhow!(
        "expected a whole picture, found: {}",
        error.to_string().replace(['\n', '\r'], " ")
    )
}
