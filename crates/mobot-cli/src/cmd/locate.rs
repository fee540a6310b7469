//! `mobot locate`: a frame, a camera, a floor plan and a prior give a pose, and what of it was measured.

use std::time::Instant;

use anyhow::{Context as _, bail};
use linefeat::{
    FloorFeatures, FloorParams, FloorView, Segment, SegmentParams, canny, floor_features, segments,
};
use monocal::{
    FixStatus, FloorCamera, FloorPlan, GroundPoint, LocateParams, Match, Observations, PixelPoint,
    PoseFix, Prior, locate,
};
use occgrid::{Point2, Pose2};
use serde::Serialize;

use super::lines::{EDGES, OVERLAY_SIDE_PX};
use crate::args::LocateArgs;
use crate::frame::Frame;
use crate::nav::observations;
use crate::output::{Outcome, Output};
use crate::picture::{Color, Overlay, Panel, save_overlay};

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
    /// Of a corner its place, of a wall the middle of the edge [px].
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
    if let Some(size) = camera.image_size.filter(|size| *size != frame.size()) {
        let ([w, h], [width, height]) = (size, frame.size());
        let name = args.image.display();
        bail!(
            "{name}: expected a frame of {w} x {h} as the camera file says, found {width} x {height}"
        );
    }
    let text = super::read_text(&args.plan, MOST_PLAN_BYTES)?;
    let plan =
        FloorPlan::from_geojson(&text).with_context(|| format!("{}", args.plan.display()))?;
    let geometry = camera.geometry();
    let geometry = geometry.with_context(|| format!("{}", args.camera.display()))?;
    let view = FloorView {
        pixel_to_floor: camera.homography.pixel_to_floor(),
        nadir: geometry.nadir,
    };
    output.stage("locating");
    let gray = frame.to_gray();
    let start = Instant::now();
    let lines = segments(&gray, &canny(&gray, &EDGES), &SegmentParams::default());
    let features = floor_features(&gray, &lines, &view, &FloorParams::default());
    let seen = observations(&lines, &features);
    let fix = locate(&seen, &plan, &camera, &prior, &LocateParams::default());
    let elapsed_ms = start.elapsed().as_secs_f64() * 1e3;
    if let Some(path) = &args.overlay {
        let picture = drawn(&frame, &lines, &features, &camera, &plan, &fix);
        save_overlay(&picture, path)?;
    }
    let counts = FeatureCounts {
        segments: lines.len(),
        floor_edges: features.edges.len(),
        door_edges: features.door_edges.len(),
        corners: features.corners.len(),
    };
    let answer = described(&fix, &seen, counts, elapsed_ms);
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

fn described(
    fix: &PoseFix,
    seen: &Observations,
    features: FeatureCounts,
    elapsed_ms: f64,
) -> Answer {
    let matched = fix.matched.iter().map(|m| match *m {
        Match::Edge { edge, wall } => {
            let e = &seen.edges[edge];
            MatchAnswer {
                kind: "wall",
                plan: wall,
                pixel: [0, 1].map(|i| 0.5 * (e.start[i] + e.end[i])),
            }
        }
        Match::Corner {
            corner,
            door_corner,
        } => MatchAnswer {
            kind: "door_corner",
            plan: door_corner,
            pixel: seen.corners[corner].pixel,
        },
    });
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

const FLOOR_EDGE: Color = Color(0, 200, 80);
const DOOR_EDGE: Color = Color(40, 120, 255);
const OTHER: Color = Color(250, 190, 0);
const USED: Color = Color(255, 0, 200);
const SEEN: Color = Color(0, 220, 230);
const PLAN: Color = Color(255, 90, 40);
const GRID: Color = Color(170, 170, 190);

/// Grid lines on the floor are this far apart, and reach this far [m].
const GRID_STEP: f64 = 0.5;
const GRID_REACH: f64 = 8.0;

/// Lines by kind, corners with their 95 % ellipses (three times enlarged), a grid on the floor, and the plan
/// as it should be seen from the fix.
fn drawn(
    frame: &Frame,
    lines: &[Segment],
    features: &FloorFeatures,
    camera: &FloorCamera,
    plan: &FloorPlan,
    fix: &PoseFix,
) -> Overlay {
    let mut panel = Panel::new(frame.to_rgb(), OVERLAY_SIDE_PX);
    let nodding = camera.nodding(fix.pitch).unwrap_or_else(|| camera.clone());
    grid(&mut panel, &nodding);
    let base = fix.pose.inverse();
    for [a, b] in &plan.walls {
        let along = |t: f64| Point2::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y));
        let steps = (a.distance(*b) / 0.1).clamp(1.0, 2000.0) as u32;
        let points =
            (0..=steps).map(|k| base.transform_from(along(f64::from(k) / f64::from(steps))));
        on_floor(&mut panel, &nodding, points, PLAN, 1.0);
    }
    for (index, line) in lines.iter().enumerate() {
        let color = if features.edges.iter().any(|e| e.segment == index) {
            FLOOR_EDGE
        } else if features.door_edges.iter().any(|e| e.segment == index) {
            DOOR_EDGE
        } else {
            OTHER
        };
        panel.line(&[line.start, line.end], color, 2.0);
    }
    for m in &fix.matched {
        if let Match::Edge { edge, .. } = *m {
            let line = &lines[features.edges[edge].segment];
            for end in [line.start, line.end] {
                panel.dot(end, USED, 4.0);
            }
        }
    }
    for (index, corner) in features.corners.iter().enumerate() {
        let used = fix
            .matched
            .iter()
            .any(|m| matches!(m, Match::Corner { corner, .. } if *corner == index));
        let color = if used { USED } else { SEEN };
        panel.ellipse(corner.pixel, corner.covariance, 3.0, color);
        panel.dot(corner.pixel, color, 3.0);
    }
    let mut overlay = Overlay::new(vec![panel]);
    for (color, note) in [
        (FLOOR_EDGE, "floor edges"),
        (DOOR_EDGE, "verticals"),
        (OTHER, "other lines"),
        (
            USED,
            "matched: ends of edges, corners with 95 % ellipses, three times enlarged",
        ),
        (SEEN, "corners not matched"),
        (PLAN, "walls of the plan, seen from the fix"),
        (GRID, "grid on the floor, 0.5 m"),
    ] {
        overlay.note(color, note);
    }
    overlay
}

fn grid(panel: &mut Panel, camera: &FloorCamera) {
    let count = (GRID_REACH / GRID_STEP) as i32;
    let steps = 8 * count;
    let fine = |k: i32| f64::from(k) * GRID_REACH / f64::from(steps);
    for k in 0..=count {
        let x = f64::from(k) * GRID_STEP;
        let across = (-steps..=steps).map(|j| Point2::new(x, fine(j)));
        on_floor(panel, camera, across, GRID, 1.0);
    }
    for k in -count..=count {
        let y = f64::from(k) * GRID_STEP;
        let along = (0..=steps).map(|j| Point2::new(fine(j), y));
        on_floor(panel, camera, along, GRID, 1.0);
    }
}

/// A line through floor points (base axes), as far as the camera sees them.
fn on_floor(
    panel: &mut Panel,
    camera: &FloorCamera,
    points: impl Iterator<Item = Point2>,
    color: Color,
    width_px: f64,
) {
    let pixel = |p: Point2| camera.pixel_of(GroundPoint::new(p.x, p.y));
    let mut run: Vec<[f64; 2]> = Vec::new();
    for point in points {
        match pixel(point).map(|PixelPoint { u, v }| [u, v]) {
            Some(place) if place[0].abs() < 1e5 && place[1].abs() < 1e5 => run.push(place),
            _ => panel.line(&std::mem::take(&mut run), color, width_px),
        }
    }
    panel.line(&run, color, width_px);
}
