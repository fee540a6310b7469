//! `mobot calibrate`: pixel-to-floor pairs to a camera with error bars, and the sheet to take them with.

use std::path::Path;

use anyhow::{Context as _, bail};
use monocal::{
    CalibrateParams, Calibration, CameraGeometry, CameraInfo, ErrorSummary, Noise, Pair,
    Undetermined, calibrate, read_pairs,
};
use serde::Serialize;

use super::target_sheet;
use crate::args::{CalibrateArgs, NoiseArg};
use crate::frame::Frame;
use crate::output::{Outcome, Output, write_whole};
use crate::picture;

/// Pairs are a few lines.
const MOST_PAIRS_BYTES: u64 = 1 << 20;

#[derive(Serialize)]
struct Answer {
    pairs: usize,
    mean_m: f64,
    max_m: f64,
    held_out: Option<Errors>,
    outliers: Vec<usize>,
    camera: Option<CameraAnswer>,
    #[serde(skip_serializing_if = "Option::is_none")]
    camera_unknown: Option<String>,
    pixel_sigma_px: f64,
    floor_sigma_m: f64,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct Errors {
    mean_m: f64,
    max_m: f64,
}

#[derive(Serialize)]
struct CameraAnswer {
    focal_px: f64,
    focal_sigma_px: f64,
    height_m: f64,
    height_sigma_m: f64,
    tilt_rad: f64,
    tilt_sigma_rad: f64,
    roll_rad: f64,
    yaw_rad: f64,
}

pub(super) fn run(args: &CalibrateArgs, output: &Output) -> anyhow::Result<Outcome> {
    if let Some(sheet) = &args.target_sheet {
        target_sheet::write(sheet)?;
    }
    let (Some(pairs_file), Some(camera_file)) = (&args.pairs, &args.output) else {
        let Some(sheet) = &args.target_sheet else {
            bail!("expected PAIRS.csv and -o CAMERA.json, or --target-sheet SHEET.svg");
        };
        let answer = serde_json::json!({ "target_sheet": sheet });
        output.answer(&answer, || {
            format!("print {} at its true size", sheet.display())
        })?;
        return Ok(Outcome::Done);
    };
    super::checked_picture(args.picture.as_deref())?;
    let pairs = read(pairs_file)?;
    let frame = args.image.as_deref().map(Frame::load).transpose()?;
    let params = params(args, frame.as_ref())?;
    output.stage("calibrating");
    let found = calibrate(&pairs, &params).with_context(|| format!("{}", pairs_file.display()))?;
    let geometry = found.camera.geometry();
    if let Some(path) = &args.picture {
        output.stage("drawing");
        let drawn = picture::calibration(&found, &pairs, frame.as_ref().map(Frame::to_rgb));
        picture::save_overlay(&drawn, path)?;
    }
    let json = found.camera.to_json();
    write_whole(camera_file, json.as_bytes())
        .with_context(|| format!("{}", camera_file.display()))?;
    let answer = answer(&found, &geometry, pairs.len());
    output.answer(&answer, || text(&answer, camera_file))?;
    Ok(Outcome::Done)
}

fn read(path: &Path) -> anyhow::Result<Vec<Pair>> {
    let text = super::read_text(path, MOST_PAIRS_BYTES)?;
    read_pairs(text.as_bytes()).with_context(|| format!("{}", path.display()))
}

/// Lens and size of the picture from where they are given; all that are given must agree.
fn params(args: &CalibrateArgs, frame: Option<&Frame>) -> anyhow::Result<CalibrateParams> {
    for (name, sigma) in [
        ("--pixel-sigma", args.pixel_sigma),
        ("--floor-sigma", args.floor_sigma),
    ] {
        if !(sigma.is_finite() && sigma > 0.0) {
            bail!("{name}: expected a number above 0, found {sigma}");
        }
    }
    let info = args.lens.as_deref().map(CameraInfo::load).transpose()?;
    let sizes = [
        ("--image-size", args.image_size),
        ("--image", frame.map(Frame::size)),
        ("--lens", info.map(|i| i.image_size)),
    ];
    let mut given = sizes
        .into_iter()
        .filter_map(|(name, size)| Some((name, size?)));
    let first = given.next();
    if let Some((first_name, [w, h])) = first
        && let Some((name, [width, height])) = given.find(|(_, size)| *size != [w, h])
    {
        bail!("{name}: expected {w} x {h} pixels as {first_name} has, found {width} x {height}");
    }
    Ok(CalibrateParams {
        noise: match args.noise {
            NoiseArg::Pixel => Noise::Pixel,
            NoiseArg::Floor => Noise::Floor,
            NoiseArg::Both => Noise::Both,
        },
        pixel_sigma_px: args.pixel_sigma,
        floor_sigma: args.floor_sigma,
        estimate_sigma: !args.given_sigma,
        image_size: first.map(|(_, size)| size),
        lens: info.map(|i| i.lens),
    })
}

fn answer(
    found: &Calibration,
    geometry: &Result<CameraGeometry, Undetermined>,
    pairs: usize,
) -> Answer {
    let errors = |e: ErrorSummary| Errors {
        mean_m: e.mean,
        max_m: e.max,
    };
    Answer {
        pairs,
        mean_m: found.residual.mean,
        max_m: found.residual.max,
        held_out: found.held_out.map(errors),
        outliers: found.outliers.clone(),
        camera: geometry.as_ref().ok().map(|g| CameraAnswer {
            focal_px: g.focal_px,
            focal_sigma_px: g.focal_sigma_px,
            height_m: g.height,
            height_sigma_m: g.height_sigma,
            tilt_rad: g.tilt,
            tilt_sigma_rad: g.tilt_sigma,
            roll_rad: g.roll,
            yaw_rad: g.yaw,
        }),
        camera_unknown: geometry.as_ref().err().map(ToString::to_string),
        pixel_sigma_px: found.pixel_sigma_px,
        floor_sigma_m: found.floor_sigma,
        warnings: found.warnings.iter().map(ToString::to_string).collect(),
    }
}

fn text(answer: &Answer, camera_file: &Path) -> String {
    let mut text = format!(
        "{} pairs, {} of them do not fit; residual mean {:.4} m, max {:.4} m",
        answer.pairs,
        answer.outliers.len(),
        answer.mean_m,
        answer.max_m
    );
    if let Some(held_out) = &answer.held_out {
        text += &format!(
            "; each left out: mean {:.4} m, max {:.4} m",
            held_out.mean_m, held_out.max_m
        );
    }
    for index in &answer.outliers {
        text += &format!("\npair {index} does not fit (counted from 0)");
    }
    match (&answer.camera, &answer.camera_unknown) {
        (Some(c), _) => {
            text += &format!(
                "\nfocal length {:.1} +- {:.1} px, height {:.3} +- {:.3} m, tilt {:.2} +- {:.2} degrees down",
                c.focal_px,
                c.focal_sigma_px,
                c.height_m,
                c.height_sigma_m,
                c.tilt_rad.to_degrees(),
                c.tilt_sigma_rad.to_degrees()
            );
        }
        (None, Some(reason)) => {
            text += &format!("\nfocal length, height and tilt unknown: {reason}")
        }
        (None, None) => {}
    }
    for warning in &answer.warnings {
        text += &format!("\nwarning: {warning}");
    }
    text + &format!("\ncamera in {}", camera_file.display())
}
