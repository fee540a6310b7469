//! `mobot lines`: the edges and straight lines of a frame.

use std::time::Instant;

use anyhow::bail;
use image::GrayImage;
use linefeat::{
    Canny, CannyParams, EdgeMap, ModifiedCannyParams, Norm, Segment, SegmentParams, segments,
};
use serde::Serialize;

use crate::args::LinesArgs;
use crate::frame::Frame;
use crate::output::{Outcome, Output, write_whole};
use crate::picture::{Color, OVERLAY_SIDE_PX, Overlay, Panel, gray_png, save_overlay};

#[derive(Serialize)]
struct Answer {
    segments: Vec<SegmentAnswer>,
    /// Low and high: as asked for, or chosen from the frame.
    thresholds: [f64; 2],
    elapsed_ms: f64,
}

#[derive(Serialize)]
struct SegmentAnswer {
    x0: f64,
    y0: f64,
    x1: f64,
    y1: f64,
    rho: f64,
    theta: f64,
    sigma_rho: f64,
    sigma_theta: f64,
    contrast: f64,
}

pub(super) fn run(args: &LinesArgs, output: &Output) -> anyhow::Result<Outcome> {
    if let Some(path) = &args.overlay {
        crate::picture::format_of(path)?;
    }
    if args
        .canny
        .is_some_and(|[low, high]| low < 0.0 || high < 0.0)
    {
        bail!("--canny: expected two thresholds of 0 or more");
    }
    output.stage(format!("reading {}", args.image.display()));
    let frame = Frame::load(&args.image)?;
    let gray = frame.to_gray();
    let start = Instant::now();
    let mut edges = EdgeMap::new();
    let thresholds = found_edges(args, &gray, &mut edges);
    let lines = segments(&gray, &edges, &SegmentParams::default());
    let elapsed_ms = start.elapsed().as_secs_f64() * 1e3;
    if let Some(path) = &args.edges {
        let png = gray_png(gray.width(), gray.height(), &edge_picture(&edges))?;
        write_whole(path, &png)?;
    }
    if let Some(path) = &args.overlay {
        let mut panel = Panel::new(frame.to_rgb(), OVERLAY_SIDE_PX);
        for line in &lines {
            // the normal points to the brighter side of the warm ones
            let color = if line.contrast > 0.0 { WARM } else { COOL };
            panel.line(&[line.start, line.end], color, 2.0);
            for end in [line.start, line.end] {
                panel.dot(end, color, 2.5);
            }
        }
        let mut overlay = Overlay::new(vec![panel]);
        overlay.note(
            WARM,
            "brighter on the side that the line's normal points to",
        );
        overlay.note(COOL, "brighter on the other side");
        save_overlay(&overlay, path)?;
    }
    let answer = Answer {
        segments: lines.iter().map(described).collect(),
        thresholds: [thresholds.low, thresholds.high],
        elapsed_ms,
    };
    output.answer(&answer, || table(&answer))?;
    Ok(Outcome::Done)
}

/// Edges by the thresholds that were asked for, else by some chosen from the frame; which.
fn found_edges(args: &LinesArgs, gray: &GrayImage, edges: &mut EdgeMap) -> CannyParams {
    let mut canny = Canny::new();
    let Some([low, high]) = args.canny else {
        return canny.detect_modified(gray, &ModifiedCannyParams::default(), edges);
    };
    let norm = if args.l2 { Norm::L2 } else { Norm::L1 };
    let params = CannyParams { low, high, norm };
    canny.detect(gray, &params, edges);
    params
}

const WARM: Color = Color(230, 90, 0);
const COOL: Color = Color(0, 130, 230);

/// 255 at edge pixels, else 0.
fn edge_picture(edges: &EdgeMap) -> Vec<u8> {
    let mut picture = vec![0; edges.width() as usize * edges.height() as usize];
    for pixel in edges.pixels() {
        picture[pixel.v as usize * edges.width() as usize + pixel.u as usize] = 255;
    }
    picture
}

fn described(line: &Segment) -> SegmentAnswer {
    SegmentAnswer {
        x0: line.start[0],
        y0: line.start[1],
        x1: line.end[0],
        y1: line.end[1],
        rho: line.rho,
        theta: line.theta,
        sigma_rho: line.covariance[0][0].max(0.0).sqrt(),
        sigma_theta: line.covariance[1][1].max(0.0).sqrt(),
        contrast: line.contrast,
    }
}

fn table(answer: &Answer) -> String {
    let mut text = String::from(
        "     x0      y0      x1      y1       rho     theta  sigma_rho  sigma_theta\n",
    );
    for s in &answer.segments {
        text += &format!(
            "{:>7.2} {:>7.2} {:>7.2} {:>7.2} {:>9.3} {:>9.5} {:>10.3} {:>12.6}\n",
            s.x0, s.y0, s.x1, s.y1, s.rho, s.theta, s.sigma_rho, s.sigma_theta
        );
    }
    let count = answer.segments.len();
    let [low, high] = answer.thresholds;
    text + &format!(
        "{count} segments in {:.1} ms, edges by thresholds of {low:.0} and {high:.0}",
        answer.elapsed_ms
    )
}
