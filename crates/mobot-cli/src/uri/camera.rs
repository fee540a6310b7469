//! `--camera none | sim: | v4l2:DEVICE | mjpeg:PATH | replay:FILE`

use std::path::PathBuf;

#[cfg(target_os = "linux")]
use mobot_hw::v4l2::{PixelFormat, V4l2Params};

use super::{Parts, Role, UriError};

/// A camera.
#[derive(Debug, Clone, PartialEq)]
pub enum Camera {
    /// None.
    None,
    /// The simulated robot's.
    Sim,
    /// A Linux video device.
    #[cfg(target_os = "linux")]
    V4l2 {
        /// As in /dev/video0, best by its stable name.
        device: PathBuf,
        /// What it is set to.
        params: V4l2Params,
    },
    /// A stream of JPEG pictures: a file, a FIFO, or `-` for stdin.
    Mjpeg {
        /// Where it comes from.
        path: String,
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
            #[cfg(target_os = "linux")]
            "v4l2" => Self::V4l2 {
                device: parts.named("a device, as in /dev/video0")?.into(),
                params: v4l2_params(parts)?,
            },
            "mjpeg" => Self::Mjpeg {
                path: parts.named("a file, a FIFO or -")?,
            },
            "replay" => Self::Replay(parts.named("a recorded FILE")?.into()),
            _ => return Ok(None),
        }))
    }
}

#[cfg(target_os = "linux")]
fn v4l2_params(parts: &mut Parts<'_>) -> Result<V4l2Params, UriError> {
    let options = &mut parts.options;
    let size_px = options.take("size", "WIDTHxHEIGHT in pixels", |text| {
        let (width, height) = text.split_once('x')?;
        let side = |text: &str| text.parse().ok().filter(|s| (16..=4096).contains(s));
        Some([side(width)?, side(height)?])
    })?;
    let format = options.take("format", "grey, nv12, yuyv, rgb24 or mjpg", |text| {
        Some(match text {
            "grey" => PixelFormat::Grey,
            "nv12" => PixelFormat::Nv12,
            "yuyv" => PixelFormat::Yuyv,
            "rgb24" => PixelFormat::Rgb24,
            "mjpg" | "mjpeg" => PixelFormat::Mjpeg,
            _ => return None,
        })
    })?;
    let kelvin = options.take("white_balance", "1000 to 20000 K", |text| {
        text.parse().ok().filter(|k| (1000..=20_000).contains(k))
    })?;
    Ok(V4l2Params {
        size_px,
        format,
        rate_hz: options.number("rate", "1 to 1000 frames a second", [1.0, 1000.0])?,
        exposure: options.number("exposure", "0.0001 to 10 s", [1e-4, 10.0])?,
        white_balance_k: kelvin,
        ..V4l2Params::default()
    })
}
