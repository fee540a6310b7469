//! `mobot locate`: a frame, a camera, a floor plan and a prior give a pose, and what of it was measured.

use std::time::Instant;

use anyhow::{Context as _, bail};
use monocal::{
    FixStatus, FloorCamera, FloorPlan, LocateParams, Match, PixelPoint, PoseFix, Prior, locate,
};
use occgrid::Pose2;
use serde::Serialize;

use super::birdseye::check_size;
use crate::args::LocateArgs;
use crate::frame::Frame;
use crate::nav::{Eye, Thresholds};
use crate::output::{Outcome, Output};
use crate::picture::{fix_overlay, save_overlay};

/// The largest floor plan [bytes].
const MOST_PLAN_BYTES: u64 = 64 << 20;

#[derive(Serialize)]
struct Answer {
    status: &'static str,
    pose: [f64; 3],
    covariance: [[f64; 3]; 3],
    observed: ObservedAnswer,
    axes: Vec<AxisAnswer>,
    matched: Vec<MatchAnswer>,
    features: FeatureCounts,
    pitch: f64,
    elapsed_ms: f64,
}

#[derive(Serialize)]
struct ObservedAnswer {
    x: bool,
    y: bool,
    theta: bool,
}

/// A direction in the map and how well the frame alone measures the position along it.
#[derive(Serialize)]
struct AxisAnswer {
    direction: [f64; 2],
    sigma: f64,
    observed: bool,
}

#[derive(Serialize)]
struct MatchAnswer {
    kind: &'static str,
    /// Index in the plan, in its file's order.
    plan: usize,
    /// Of a corner its place, of a wall the middle of the edge, in the frame as it is [px].
    pixel: [f64; 2],
}

#[derive(Serialize)]
struct FeatureCounts {
    segments: usize,
    floor_edges: usize,
    door_edges: usize,
    corners: usize,
}

pub(super) fn run(args: &LocateArgs, output: &Output) -> anyhow::Result<Outcome> {
    if let Some(path) = &args.overlay {
        crate::picture::format_of(path)?;
    }
    let prior = prior(args)?;
    output.stage(format!("reading {}", args.image.display()));
    let frame = Frame::load(&args.image)?;
    let camera = FloorCamera::load(&args.camera)?;
    check_size(&camera, &args.camera, &frame, &args.image)?;
    let text = super::read_text(&args.plan, MOST_PLAN_BYTES)?;
    let plan =
        FloorPlan::from_geojson(&text).with_context(|| format!("{}", args.plan.display()))?;
    let mut eye = Eye::new(&camera, Thresholds::OfFrame)
        .with_context(|| format!("{}", args.camera.display()))?;
    output.stage("locating");
    let gray = frame.to_gray();
    let start = Instant::now();
    eye.look(&gray);
    let params = LocateParams::default();
    let fix = locate(eye.seen(), &plan, eye.camera(), &prior, &params);
    let elapsed_ms = start.elapsed().as_secs_f64() * 1e3;
    if let Some(path) = &args.overlay {
        save_overlay(&fix_overlay(&frame, &camera, &eye, &plan, &fix), path)?;
    }
    let answer = described(&fix, &camera, &eye, elapsed_ms);
    output.answer(&answer, || report(&answer))?;
    Ok(match fix.status {
        FixStatus::Ok | FixStatus::Partial => Outcome::Done,
        _ => Outcome::No,
    })
}

fn prior(args: &LocateArgs) -> anyhow::Result<Prior> {
    let [x, y, theta] = args.prior;
    let mut covariance = [[0.0; 3]; 3];
    for (k, sigma) in args.prior_sigma.iter().enumerate() {
        if *sigma <= 0.0 {
            bail!("--prior-sigma: expected three lengths above 0, found {sigma}");
        }
        covariance[k][k] = sigma * sigma;
    }
    Ok(Prior {
        pose: Pose2::new(x, y, theta),
        covariance,
    })
}

fn described(fix: &PoseFix, camera: &FloorCamera, eye: &Eye, elapsed_ms: f64) -> Answer {
    let in_frame = |[u, v]: [f64; 2]| {
        let ideal = PixelPoint::new(u, v);
        let seen = camera.lens.map_or(Some(ideal), |lens| lens.distort(ideal));
        let PixelPoint { u, v } = seen.unwrap_or(ideal);
        [u, v]
    };
    let seen = eye.seen();
    let matched = fix.matched.iter().map(|m| match *m {
        Match::Edge { edge, wall } => {
            let e = &seen.edges[edge];
            MatchAnswer {
                kind: "wall",
                plan: wall,
                pixel: in_frame([0, 1].map(|i| 0.5 * (e.start[i] + e.end[i]))),
            }
        }
        Match::Corner {
            corner,
            door_corner,
        } => MatchAnswer {
            kind: "door_corner",
            plan: door_corner,
            pixel: in_frame(seen.corners[corner].pixel),
        },
    });
    let features = eye.features();
    let features = FeatureCounts {
        segments: eye.segments().len(),
        floor_edges: features.edges.len(),
        door_edges: features.door_edges.len(),
        corners: features.corners.len(),
    };
    let axes = fix.axes.iter().map(|axis| AxisAnswer {
        direction: axis.direction,
        sigma: axis.sigma,
        observed: axis.observed,
    });
    Answer {
        status: fix.status.name(),
        pose: [fix.pose.x, fix.pose.y, fix.pose.theta],
        covariance: fix.covariance,
        observed: ObservedAnswer {
            x: fix.observed.x,
            y: fix.observed.y,
            theta: fix.observed.theta,
        },
        axes: axes.collect(),
        matched: matched.collect(),
        features,
        pitch: fix.pitch,
        elapsed_ms,
    }
}

fn report(answer: &Answer) -> String {
    let [x, y, theta] = answer.pose;
    let sigma = |k: usize| answer.covariance[k][k].max(0.0).sqrt();
    let seen = |observed: bool| {
        if observed {
            "measured"
        } else {
            "from the prior"
        }
    };
    let f = &answer.features;
    format!(
        "status   {}\n\
         x        {x:.4} m   +- {:.4}  {}\n\
         y        {y:.4} m   +- {:.4}  {}\n\
         theta    {theta:.5} rad +- {:.5}  {}\n\
         matched  {} of {} floor edges and {} corners ({} segments)\n\
         nod      {:.2} deg\n\
         time     {:.1} ms",
        answer.status,
        sigma(0),
        seen(answer.observed.x),
        sigma(1),
        seen(answer.observed.y),
        sigma(2),
        seen(answer.observed.theta),
        answer.matched.len(),
        f.floor_edges,
        f.corners,
        f.segments,
        answer.pitch.to_degrees(),
        answer.elapsed_ms
    )
}
