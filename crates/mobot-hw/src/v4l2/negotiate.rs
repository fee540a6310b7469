//! Format, size and rate: asked for, and read back, since drivers change what they are given.

use rustix::io::{Errno, Result};

use super::V4l2Params;
use super::format::{self, Layout, PixelFormat};
use super::layout::{Format, FormatDescription, PixFormat, StreamParm};
use super::requests::Requests;

/// `V4L2_FIELD_NONE`: whole pictures.
const PROGRESSIVE: u32 = 1;
/// Fields of half the lines, one by one or above each other.
const SPLIT: [u32; 5] = [2, 3, 5, 6, 7];
/// `V4L2_CAP_TIMEPERFRAME`.
const RATE_CAN_BE_SET: u32 = 0x1000;
/// Formats asked for: a driver may go on for ever.
const FORMATS: u32 = 256;

/// What the driver has agreed to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Agreed {
    pub(super) layout: Layout,
    /// [1/s]; none if the driver does not say.
    pub(super) rate: Option<f64>,
    whole: bool,
}

/// Codes of all formats that the camera has.
pub(super) fn formats(camera: &impl Requests) -> Result<Vec<[u8; 4]>> {
    let mut found = Vec::new();
    for index in 0..FORMATS {
        let mut description = FormatDescription::at(index);
        match camera.describe_format(&mut description) {
            Ok(()) => found.push(description.fourcc),
            Err(Errno::INVAL) => break,
            Err(error) => return Err(error),
        }
    }
    Ok(found)
}

/// Why nothing was agreed.
#[derive(Debug)]
pub(super) enum Disagreed {
    Format { expected: String, found: String },
    Size { expected: String, found: String },
    Failed(Errno),
}

impl From<Errno> for Disagreed {
    fn from(error: Errno) -> Self {
        Self::Failed(error)
    }
}

/// Sets the first format in which the camera gives the size and comes nearest to the rate.
pub(super) fn agree(
    camera: &impl Requests,
    params: &V4l2Params,
) -> std::result::Result<Agreed, Disagreed> {
    let has = formats(camera)?;
    // without a wish it stays as quick as it stands: raw pixels may be slow
    let params = &V4l2Params {
        rate_hz: params.rate_hz.or(rate(camera, None)?),
        ..*params
    };
    let wanted: Vec<PixelFormat> = params.format.map_or(PixelFormat::ALL.into(), |f| vec![f]);
    let mut best: Option<(Merit, PixelFormat)> = None;
    for format in wanted.iter().copied() {
        if !has.contains(&format.fourcc()) {
            continue;
        }
        let agreed = set(camera, params, format)?;
        let merit = agreed.and_then(|agreed| agreed.merit(params));
        if let Some(merit) = merit
            && best.is_none_or(|(best, _)| merit.beats(best))
        {
            best = Some((merit, format));
        }
    }
    let agreed = match best {
        Some((_, format)) => set(camera, params, format)?,
        None => None,
    };
    let names = |codes: Vec<[u8; 4]>| {
        codes
            .into_iter()
            .map(format::name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let agreed = agreed.ok_or_else(|| Disagreed::Format {
        expected: names(wanted.into_iter().map(PixelFormat::fourcc).collect()),
        found: names(has),
    })?;
    let size = [agreed.layout.width, agreed.layout.height];
    if let Some(expected) = params.size_px
        && expected != size
    {
        return Err(Disagreed::Size {
            expected: format!("{expected:?} px"),
            found: format!("{size:?} px"),
        });
    }
    Ok(agreed)
}

#[derive(Clone, Copy)]
struct Merit {
    sized: bool,
    /// Up to the one wanted [1/s].
    rate: f64,
}

impl Merit {
    fn beats(self, other: Self) -> bool {
        match (self.sized, other.sized) {
            (true, false) => true,
            (false, true) => false,
            _ => self.rate > 1.05 * other.rate,
        }
    }
}

impl Agreed {
    /// `None` where it is of no use.
    fn merit(&self, params: &V4l2Params) -> Option<Merit> {
        let size = [self.layout.width, self.layout.height];
        let usable = self.whole && size.iter().all(|side| (1..=4096).contains(side));
        usable.then(|| Merit {
            sized: params.size_px.is_none_or(|wanted| wanted == size),
            rate: params.rate_hz.map_or(0.0, |wanted| {
                self.rate.map_or(wanted, |found| found.min(wanted))
            }),
        })
    }
}

/// `None` if the driver does not take the format after all.
fn set(camera: &impl Requests, params: &V4l2Params, wanted: PixelFormat) -> Result<Option<Agreed>> {
    let mut current = Format::of(PixFormat::default());
    camera.read_format(&mut current)?;
    let [width, height] = params
        .size_px
        .unwrap_or([current.pix.width, current.pix.height]);
    let mut asked = Format::of(PixFormat {
        width,
        height,
        fourcc: wanted.fourcc(),
        field: PROGRESSIVE,
        ..PixFormat::default()
    });
    camera.set_format(&mut asked)?;
    let pix = asked.pix;
    if PixelFormat::of(pix.fourcc) != Some(wanted) {
        return Ok(None);
    }
    Ok(Some(Agreed {
        layout: Layout {
            format: wanted,
            width: pix.width,
            height: pix.height,
            stride: pix.bytes_per_line,
        },
        rate: rate(camera, params.rate_hz)?,
        whole: !SPLIT.contains(&pix.field),
    }))
}

/// Sets the rate, where the driver can, and reads it.
fn rate(camera: &impl Requests, wanted: Option<f64>) -> Result<Option<f64>> {
    let mut parm = StreamParm::time_per_frame(0, 0);
    match camera.read_parm(&mut parm) {
        Ok(()) => {}
        Err(Errno::NOTTY | Errno::INVAL) => return Ok(None),
        Err(error) => return Err(error),
    }
    if let Some(wanted) = wanted
        && parm.capability & RATE_CAN_BE_SET != 0
    {
        // whole rates come out exact: a hair above one, and some drivers take the next
        let thousandths = (1e3 * wanted).clamp(1.0, 1e9).round() as u32;
        parm = StreamParm::time_per_frame(1000, thousandths);
        camera.set_parm(&mut parm)?;
    }
    let known = parm.numerator > 0 && parm.denominator > 0;
    Ok(known.then(|| f64::from(parm.denominator) / f64::from(parm.numerator)))
}
