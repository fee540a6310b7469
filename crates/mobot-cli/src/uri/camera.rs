//! `--camera none | sim: | v4l2:DEVICE | mjpeg:PATH | replay:FILE`

use std::path::PathBuf;

use super::{Parts, Role, UriError};

/// A camera.
#[derive(Debug, Clone, PartialEq)]
pub enum Camera {
    /// None.
    None,
    /// The simulated robot's.
    Sim,
    /// A Linux video device.
    V4l2 {
        /// As in /dev/video0.
        device: PathBuf,
        /// Width and height wanted [px].
        size: Option<[u32; 2]>,
    },
    /// A stream of JPEG pictures: a file, a FIFO, or `-` for stdin.
    Mjpeg {
        /// Where it comes from.
        path: PathBuf,
    },
    /// A recorded one.
    Replay(PathBuf),
}

impl Role for Camera {
    const EXPECTED: &'static str =
        "none, sim:, v4l2:DEVICE, mjpeg:PATH, replay:FILE or record:FILE,DEVICE";

    fn read(parts: &mut Parts<'_>) -> Result<Option<Self>, UriError> {
        Ok(Some(match parts.scheme {
            "none" => {
                parts.unnamed()?;
                Self::None
            }
            "sim" => {
                parts.unnamed()?;
                Self::Sim
            }
            "v4l2" => Self::V4l2 {
                device: parts.named("a device, as in /dev/video0")?.into(),
                size: parts
                    .options
                    .take("size", "WIDTHxHEIGHT in pixels", |text| {
                        let (width, height) = text.split_once('x')?;
                        let side =
                            |text: &str| text.parse().ok().filter(|s| (16..=8192).contains(s));
                        Some([side(width)?, side(height)?])
                    })?,
            },
            "mjpeg" => Self::Mjpeg {
                path: parts.named("a file, a FIFO or -")?.into(),
            },
            "replay" => Self::Replay(parts.named("a recorded FILE")?.into()),
            _ => return Ok(None),
        }))
    }
}
