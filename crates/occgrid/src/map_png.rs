//! PNG and BMP maps: decoded by the `image` crate within limits, then turned into values in place.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{
    ColorType, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, ImageFormat, ImageReader,
    Limits,
};

use crate::map_file_error::quoted;
use crate::map_image::MapImage;
use crate::map_values::{UNKNOWN, ValueRule, level8, luma8, luma16};
use crate::{LoadOptions, MapFileError, MapMode, OccupancyMap, ThresholdRule};

/// What a decoder may hold beside the picture [byte]: a colour profile can be a bomb, too.
const DECODER_BYTES: u64 = 32 << 20;

pub(crate) fn decode(
    file: &Path,
    opened: File,
    format: ImageFormat,
    rule: &ValueRule,
    options: &LoadOptions,
) -> Result<MapImage, MapFileError> {
    let refused = |e| image_error(file, e);
    let mut reader = ImageReader::with_format(BufReader::with_capacity(1 << 16, opened), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(options.max_side_cells);
    limits.max_image_height = Some(options.max_side_cells);
    limits.max_alloc = Some(DECODER_BYTES);
    reader.limits(limits);
    // memory for the picture is asked for below, after the checks: the decoder's own constructors
    // that allocate do not look at the limits
    let decoder = reader.into_decoder().map_err(refused)?;
    let (width, height) = decoder.dimensions();
    let cells = u64::from(width) * u64::from(height);
    for (place, side) in [("width", width), ("height", height)] {
        if side == 0 {
            return Err(MapFileError::content(file, place, "at least 1 px", "0"));
        }
        if side > options.max_side_cells {
            return Err(MapFileError::limit(
                file,
                place,
                options.max_side_cells,
                side,
            ));
        }
    }
    if cells > options.max_cells {
        return Err(MapFileError::limit(
            file,
            "pixels",
            options.max_cells,
            cells,
        ));
    }
    let bytes = decoder.total_bytes();
    if bytes > options.max_image_bytes {
        let place = "decoded bytes";
        return Err(MapFileError::limit(
            file,
            place,
            options.max_image_bytes,
            bytes,
        ));
    }
    let color = decoder.color_type();
    let length = usize::try_from(bytes).unwrap_or(usize::MAX);
    let mut probe: Vec<u8> = Vec::new();
    probe.try_reserve_exact(length).map_err(|e| {
        let e = std::io::Error::new(std::io::ErrorKind::OutOfMemory, e);
        MapFileError::io(file, "memory", e)
    })?;
    drop(probe);
    // zeroed by the system page by page: a picture cut short does not cost its whole size
    let mut pixels = vec![0; length];
    decoder.read_image(&mut pixels).map_err(refused)?;
    let values = values_of(file, pixels, color, rule)?;
    Ok(MapImage {
        width,
        height,
        values,
    })
}

/// Turns pixels into values inside the same memory, so that a large map costs no second buffer.
fn values_of(
    file: &Path,
    mut pixels: Vec<u8>,
    color: ColorType,
    rule: &ValueRule,
) -> Result<Vec<i8>, MapFileError> {
    let cells = pixels.len() / usize::from(color.bytes_per_pixel());
    let to_value = PixelRule::new(rule);
    let wide = |p: &[u8], i: usize| u16::from_ne_bytes([p[2 * i], p[2 * i + 1]]);
    match color {
        ColorType::L8 => {
            for pixel in &mut pixels {
                *pixel = to_value.table[usize::from(*pixel)] as u8;
            }
        }
        ColorType::La8 => in_place::<2>(&mut pixels, |p| to_value.of8(&[p[0]], Some(p[1]))),
        ColorType::Rgb8 => in_place::<3>(&mut pixels, |p| to_value.of8(&p[..3], None)),
        ColorType::Rgba8 => in_place::<4>(&mut pixels, |p| to_value.of8(&p[..3], Some(p[3]))),
        ColorType::L16 => in_place::<2>(&mut pixels, |p| to_value.of(&[wide(p, 0)], None)),
        ColorType::La16 => in_place::<4>(&mut pixels, |p| {
            to_value.of(&[wide(p, 0)], Some(wide(p, 1)))
        }),
        ColorType::Rgb16 => in_place::<6>(&mut pixels, |p| {
            to_value.of(&[wide(p, 0), wide(p, 1), wide(p, 2)], None)
        }),
        ColorType::Rgba16 => in_place::<8>(&mut pixels, |p| {
            to_value.of(&[wide(p, 0), wide(p, 1), wide(p, 2)], Some(wide(p, 3)))
        }),
        other => {
            let found = format!("{other:?}");
            let expected = "8 or 16 bit grey or RGB, with or without alpha";
            return Err(MapFileError::content(file, "colour type", expected, found));
        }
    }
    pixels.truncate(cells);
    pixels.shrink_to_fit();
    // same size and alignment: the standard library collects this in place
    Ok(pixels.into_iter().map(|v| v as i8).collect())
}

/// Writes the value of pixel i (`N` bytes each) over byte i, which no later pixel reads.
fn in_place<const N: usize>(bytes: &mut [u8], value_of: impl Fn(&[u8]) -> i8) {
    for i in 0..bytes.len() / N {
        bytes[i] = value_of(&bytes[i * N..(i + 1) * N]) as u8;
    }
}

struct PixelRule<'a> {
    rule: &'a ValueRule,
    table: [i8; 256],
}

impl<'a> PixelRule<'a> {
    fn new(rule: &'a ValueRule) -> Self {
        Self {
            rule,
            table: rule.table(),
        }
    }

    /// The value of a pixel given as 16-bit levels: one (grey) or three (colour), and alpha.
    fn of(&self, levels: &[u16], alpha: Option<u16>) -> i8 {
        match (self.rule.rule, levels) {
            (ThresholdRule::Nav2, &[red, green, blue]) => {
                self.nav2(level8(luma16(red, green, blue)), alpha.map(level8))
            }
            (ThresholdRule::Nav2, _) => self.nav2(level8(levels[0]), alpha.map(level8)),
            (ThresholdRule::Ros1, _) => {
                let narrow: [u8; 3] =
                    std::array::from_fn(|i| levels.get(i).map_or(0, |&v| level8(v)));
                self.ros1(&narrow[..levels.len()], alpha.map(level8))
            }
        }
    }

    /// The same for 8-bit levels.
    #[inline]
    fn of8(&self, levels: &[u8], alpha: Option<u8>) -> i8 {
        match (self.rule.rule, levels) {
            (ThresholdRule::Nav2, &[red, green, blue]) => self.nav2(luma8(red, green, blue), alpha),
            (ThresholdRule::Nav2, _) => self.nav2(levels[0], alpha),
            (ThresholdRule::Ros1, _) => self.ros1(levels, alpha),
        }
    }

    #[inline]
    fn nav2(&self, grey: u8, alpha: Option<u8>) -> i8 {
        if alpha.is_some_and(|alpha| alpha < 255) && self.rule.mode != MapMode::Raw {
            UNKNOWN
        } else {
            self.table[usize::from(grey)]
        }
    }

    fn ros1(&self, levels: &[u8], alpha: Option<u8>) -> i8 {
        // trinary mode averages alpha in, as it always did there
        let counted = alpha.filter(|_| self.rule.mode == MapMode::Trinary);
        let sum: u32 = levels.iter().chain(&counted).map(|&v| u32::from(v)).sum();
        let count = levels.len() + usize::from(counted.is_some());
        let mean = f64::from(sum) / count as f64;
        self.rule.ros1(mean, alpha.unwrap_or(1))
    }
}

fn image_error(file: &Path, error: ImageError) -> MapFileError {
    match error {
        ImageError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => {
            MapFileError::io(file, "read", e)
        }
        ImageError::Limits(e) => MapFileError::content(
            file,
            "picture",
            "a size within the limits",
            quoted(&e.to_string()),
        ),
        other => MapFileError::content(
            file,
            "picture",
            "a whole, undamaged picture",
            quoted(&other.to_string()),
        ),
    }
}

/// An RGBA picture of the map, as scale mode has it: darker is more occupied, transparent is unknown.
pub(crate) fn encode_scale(map: &OccupancyMap) -> Result<Vec<u8>, ImageError> {
    let frame = map.frame();
    let table: [[u8; 4]; 256] = std::array::from_fn(|v| match v as u8 as i8 {
        value @ 0..=100 => {
            let grey = (f64::from(100 - value) / 100.0 * 255.0).round() as u8;
            [grey, grey, grey, 255]
        }
        // Nav2's saver: half grey, transparent
        _ => [128, 128, 128, 0],
    });
    let pixels: Vec<u8> = map
        .values()
        .iter()
        .flat_map(|&v| table[usize::from(v as u8)])
        .collect();
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new(&mut bytes);
    encoder.write_image(
        &pixels,
        frame.width(),
        frame.height(),
        ExtendedColorType::Rgba8,
    )?;
    Ok(bytes)
}
