//! `mobot floor`: the floor point that a pixel sees, with its error bars.

use anyhow::bail;
use monocal::{FloorCamera, PixelPoint};
use serde::Serialize;

use crate::args::FloorArgs;
use crate::output::{Outcome, Output};

#[derive(Serialize)]
struct Answer {
    x: Option<f64>,
    y: Option<f64>,
    covariance: Option<[[f64; 2]; 2]>,
    resolution: Option<ResolutionAnswer>,
    pixel_sigma_px: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'static str>,
}

#[derive(Serialize)]
struct ResolutionAnswer {
    dx: f64,
    dy: f64,
}

pub(super) fn run(args: &FloorArgs, output: &Output) -> anyhow::Result<Outcome> {
    let camera = FloorCamera::load(&args.camera)?;
    for (name, value) in [("U", args.u), ("V", args.v)] {
        if !value.is_finite() {
            bail!("{name}: expected a finite number, found {value}");
        }
    }
    let sigma = args.pixel_sigma.unwrap_or(camera.pixel_sigma_px);
    if !(sigma.is_finite() && sigma >= 0.0) {
        bail!("--pixel-sigma: expected 0 px or more, found {sigma}");
    }
    let pixel = PixelPoint::new(args.u, args.v);
    let noise = [[sigma * sigma, 0.0], [0.0, sigma * sigma]];
    let Some(found) = camera.floor_estimate(pixel, noise) else {
        let reason = match camera.floor_point(pixel) {
            Some(_) => "too near the horizon to say where",
            None => "no floor: on or above the horizon, or outside the lens",
        };
        let answer = Answer {
            x: None,
            y: None,
            covariance: None,
            resolution: None,
            pixel_sigma_px: sigma,
            reason: Some(reason),
        };
        output.answer(&answer, || reason.to_owned())?;
        return Ok(Outcome::No);
    };
    let answer = Answer {
        x: Some(found.point.x),
        y: Some(found.point.y),
        covariance: Some(found.covariance),
        resolution: found
            .resolution
            .map(|r| ResolutionAnswer { dx: r.dx, dy: r.dy }),
        pixel_sigma_px: sigma,
        reason: None,
    };
    output.answer(&answer, || {
        let [sx, sy] = [found.covariance[0][0].sqrt(), found.covariance[1][1].sqrt()];
        let mut text = format!(
            "x {:.4} m, y {:.4} m; one sigma {sx:.4} m, {sy:.4} m (pixel read to {sigma:.2} px)",
            found.point.x, found.point.y
        );
        if let Some(r) = found.resolution {
            text += &format!("; a pixel covers {:.4} m ahead, {:.4} m across", r.dx, r.dy);
        }
        text
    })?;
    Ok(Outcome::Done)
}
