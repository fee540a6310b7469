//! Pixels as cameras send them, and their luma.

use std::fmt;

use image::GrayImage;

use crate::FrameFault;
use crate::stream::jpeg;

/// A format that grey levels are taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum PixelFormat {
    /// A byte a pixel.
    Grey,
    /// Luma, then chroma of half the size.
    Nv12,
    /// Luma and chroma in turn.
    Yuyv,
    /// Red, green, blue.
    Rgb24,
    /// A JPEG picture a frame.
    Mjpeg,
}

impl PixelFormat {
    /// All, those first that lose least and cost least.
    pub const ALL: [Self; 5] = [Self::Grey, Self::Nv12, Self::Yuyv, Self::Rgb24, Self::Mjpeg];

    pub(super) const fn fourcc(self) -> [u8; 4] {
        *match self {
            Self::Grey => b"GREY",
            Self::Nv12 => b"NV12",
            Self::Yuyv => b"YUYV",
            Self::Rgb24 => b"RGB3",
            Self::Mjpeg => b"MJPG",
        }
    }

    pub(super) fn of(fourcc: [u8; 4]) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.fourcc() == fourcc)
    }

    /// Bytes of a pixel in the rows that luma is taken from; none if there are no rows.
    const fn pixel_bytes(self) -> usize {
        match self {
            Self::Grey | Self::Nv12 => 1,
            Self::Yuyv => 2,
            Self::Rgb24 => 3,
            Self::Mjpeg => 0,
        }
    }
}

impl fmt::Display for PixelFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&name(self.fourcc()))
    }
}

/// A code of four letters; the last one's highest bit says that bytes are swapped.
pub(super) fn name(fourcc: [u8; 4]) -> String {
    let [a, b, c, d] = fourcc;
    let letters = [a, b, c, d & 0x7F].escape_ascii().to_string();
    let swapped = if d & 0x80 == 0 { "" } else { "-BE" };
    format!("{}{swapped}", letters.trim_end())
}

/// What one frame is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Layout {
    pub(super) format: PixelFormat,
    pub(super) width: u32,
    pub(super) height: u32,
    /// From one row to the next [bytes], as the driver says; too few means that rows follow without a gap.
    pub(super) stride: u32,
}

impl Layout {
    /// The luma of a frame, each level as the camera sends it.
    pub(super) fn grey(&self, bytes: &[u8]) -> Result<GrayImage, FrameFault> {
        let image = if self.format == PixelFormat::Mjpeg {
            jpeg::grey_of_buffer(bytes)?
        } else {
            self.grey_of_rows(bytes)?
        };
        let (expected, found) = ([self.width, self.height], image.dimensions().into());
        if expected == found {
            Ok(image)
        } else {
            Err(FrameFault::Size { expected, found })
        }
    }

    fn grey_of_rows(&self, bytes: &[u8]) -> Result<GrayImage, FrameFault> {
        let (width, height) = (self.width as usize, self.height as usize);
        let row = width * self.format.pixel_bytes();
        let stride = row.max(self.stride as usize);
        let expected = stride * height.saturating_sub(1) + row;
        let found = bytes.len();
        if found < expected {
            return Err(FrameFault::TooShort { expected, found });
        }
        let mut grey = Vec::with_capacity(width * height);
        for row in bytes.chunks(stride.max(1)).take(height).map(|r| &r[..row]) {
            match self.format {
                PixelFormat::Yuyv => grey.extend(row.as_chunks().0.iter().map(|[luma, _]| luma)),
                PixelFormat::Rgb24 => grey.extend(row.as_chunks().0.iter().map(luma_of_rgb)),
                _ => grey.extend_from_slice(row),
            }
        }
        GrayImage::from_raw(self.width, self.height, grey).ok_or(FrameFault::TooShort {
            expected: width * height,
            found,
        })
    }
}

/// The luma of ITU-R BT.601, rounded.
fn luma_of_rgb([red, green, blue]: &[u8; 3]) -> u8 {
    let sum = 299 * u32::from(*red) + 587 * u32::from(*green) + 114 * u32::from(*blue);
    ((sum + 500) / 1000) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(format: PixelFormat, stride: u32) -> Layout {
        Layout {
            format,
            width: 4,
            height: 3,
            stride,
        }
    }

    /// Luma n at pixel n, everything else 200 and more.
    fn frame(format: PixelFormat, stride: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        for row in 0..3 {
            let begin = bytes.len();
            for n in row * 4..row * 4 + 4 {
                match format {
                    PixelFormat::Yuyv => bytes.extend([n, 200 + n]),
                    PixelFormat::Rgb24 => bytes.extend([n; 3]),
                    _ => bytes.push(n),
                }
            }
            bytes.resize(begin + stride, 201);
        }
        bytes
    }

    #[test]
    fn luma_is_found_whatever_the_stride() {
        for format in PixelFormat::ALL {
            let row = 4 * format.pixel_bytes();
            if row == 0 {
                continue;
            }
            for stride in [row, row + 1, row + 7, 64] {
                let mut bytes = frame(format, stride);
                bytes.truncate(2 * stride + row); // the last row needs no gap after it
                // a stride below a row is nonsense, and means none
                let strides = if stride == row {
                    vec![stride, 0, 1]
                } else {
                    vec![stride]
                };
                for told in strides {
                    let layout = layout(format, told as u32);
                    let grey = layout.grey(&bytes).expect("a picture");
                    assert_eq!(grey.dimensions(), (4, 3));
                    assert!(
                        (0..12).eq(grey.as_raw().iter().copied()),
                        "{format} {grey:?}"
                    );
                    let longer = [&bytes[..], &[9; 40]].concat();
                    assert_eq!(layout.grey(&longer).expect("a picture"), grey);
                    for found in 0..bytes.len() {
                        let fault = layout.grey(&bytes[..found]).expect_err("too short");
                        let expected = bytes.len();
                        assert_eq!(fault, FrameFault::TooShort { expected, found });
                    }
                }
            }
        }
    }

    #[test]
    fn jpeg_has_the_size_agreed_on() {
        let mut jpeg = Vec::new();
        image::codecs::jpeg::JpegEncoder::new(&mut jpeg)
            .encode_image(&GrayImage::from_pixel(4, 3, image::Luma([90])))
            .expect("a JPEG");
        jpeg.extend([0; 100]); // padding
        let grey = layout(PixelFormat::Mjpeg, 0)
            .grey(&jpeg)
            .expect("a picture");
        assert!(grey.as_raw().iter().all(|level| level.abs_diff(90) <= 1));
        let other = Layout {
            width: 5,
            ..layout(PixelFormat::Mjpeg, 0)
        };
        assert!(matches!(other.grey(&jpeg), Err(FrameFault::Size { .. })));
        assert_eq!(other.grey(&jpeg[..200]), Err(FrameFault::CutShort));
        assert_eq!(other.grey(&[]), Err(FrameFault::CutShort));
    }

    #[test]
    fn grey_of_colours_is_opencvs_but_for_its_rounding() {
        for line in include_str!("../../../../testdata/golden/rgb_grey.csv").lines() {
            let fields: Vec<u8> = line
                .split(',')
                .map(|f| f.parse().expect("a level"))
                .collect();
            let [red, green, blue, grey] = fields[..] else {
                panic!("{line}");
            };
            let ours = luma_of_rgb(&[red, green, blue]);
            assert!(ours.abs_diff(grey) <= 1, "{line} {ours}");
        }
    }
}
