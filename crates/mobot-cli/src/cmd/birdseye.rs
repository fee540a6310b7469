//! `mobot birdseye`: the floor of a frame as seen from above.

use std::path::Path;

use anyhow::{Context as _, bail};
use monocal::{BirdseyeParams, FloorCamera, birdseye};
use serde::Serialize;

use crate::args::BirdseyeArgs;
use crate::frame::Frame;
use crate::output::{Outcome, Output, write_whole};
use crate::picture::{Format, format_of, rgb_png};

/// The longer side of the picture where its scale is not given [px].
const LONG_SIDE_PX: u32 = 1600;

#[derive(Serialize)]
struct Answer {
    metres_per_pixel: Option<f64>,
    /// Floor point of the centre of the picture's pixel (0, 0) [m].
    origin: Option<[f64; 2]>,
    width: u32,
    height: u32,
}

pub(super) fn run(args: &BirdseyeArgs, output: &Output) -> anyhow::Result<Outcome> {
    if format_of(&args.output)? != Format::Png {
        bail!(
            "{}: expected a picture name ending in .png",
            args.output.display()
        );
    }
    for (name, value) in [
        ("--coarsest", Some(args.coarsest)),
        ("--metres-per-pixel", args.metres_per_pixel),
    ] {
        if let Some(value) = value
            && !(value.is_finite() && value > 0.0)
        {
            bail!("{name}: expected a length above 0 m, found {value}");
        }
    }
    let camera = FloorCamera::load(&args.camera)?;
    output.stage(format!("reading {}", args.image.display()));
    let frame = Frame::load(&args.image)?;
    check_size(&camera, &args.camera, &frame, &args.image)?;
    output.stage("drawing");
    let Some(mut params) =
        BirdseyeParams::of_view(&camera, frame.size(), args.coarsest, LONG_SIDE_PX)
    else {
        let answer = Answer {
            metres_per_pixel: None,
            origin: None,
            width: 0,
            height: 0,
        };
        output.answer(&answer, || {
            format!("no floor where a pixel covers {} m or less", args.coarsest)
        })?;
        return Ok(Outcome::No);
    };
    params.metres_per_pixel = args.metres_per_pixel.unwrap_or(params.metres_per_pixel);
    let above = birdseye(&frame.to_rgb(), &camera, &params).context("--metres-per-pixel")?;
    write_whole(&args.output, &rgb_png(&above.picture)?)
        .with_context(|| format!("{}", args.output.display()))?;
    let (width, height) = above.picture.dimensions();
    let answer = Answer {
        metres_per_pixel: Some(above.metres_per_pixel),
        origin: Some(above.origin.into()),
        width,
        height,
    };
    output.answer(&answer, || {
        format!(
            "{width} x {height} pixels of {:.4} m; pixel (0, 0) is x {:.3} m, y {:.3} m; x is up, y to the left",
            above.metres_per_pixel, above.origin.x, above.origin.y
        )
    })?;
    Ok(Outcome::Done)
}

/// Refuses a frame of another size than the camera was calibrated with.
pub(super) fn check_size(
    camera: &FloorCamera,
    camera_file: &Path,
    frame: &Frame,
    frame_file: &Path,
) -> anyhow::Result<()> {
    let [width, height] = frame.size();
    match camera.image_size {
        Some([w, h]) if [w, h] != [width, height] => bail!(
            "{}: expected {w} x {h} pixels as {} was calibrated for, found {width} x {height}",
            frame_file.display(),
            camera_file.display()
        ),
        _ => Ok(()),
    }
}
