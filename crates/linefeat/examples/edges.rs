//! Draws a dim corridor with a door and a floor, finds its edges twice, and prints them in characters:
//! with fixed thresholds, and below the horizon with thresholds chosen from the frame.
//!
//!   cargo run -p linefeat --example edges

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use image::{GrayImage, Luma};
use linefeat::{Canny, CannyParams, EdgeMap, ModifiedCannyParams, Region};

const HORIZON: f64 = 20.0;

fn main() {
    let frame = GrayImage::from_fn(100, 64, |u, v| Luma([corridor(f64::from(u), f64::from(v))]));
    let mut canny = Canny::new();
    let mut edges = EdgeMap::new();

    canny.detect(&frame, &CannyParams::default(), &mut edges);
    show("low 50, high 150: the frame is too dark", &edges);

    let params = ModifiedCannyParams {
        region: Region::HalfPlane([0.0, 1.0, -HORIZON]),
        ..ModifiedCannyParams::default()
    };
    let chosen = canny.detect_modified(&frame, &params, &mut edges);
    let title = format!(
        "below the horizon, low {:.0}, high {:.0}",
        chosen.low, chosen.high
    );
    show(&title, &edges);
}

/// Gray of the corridor at a pixel: floor, two walls, the end, a door on the left.
fn corridor(u: f64, v: f64) -> u8 {
    let (right, down) = ((u - 50.0) / 50.0, (v - HORIZON) / 50.0);
    let depth = 0.1_f64.max(right.abs() * 0.8);
    if down > depth.max(0.12) {
        30
    } else if right.abs() < 0.12 {
        22
    } else if (-0.6..-0.42).contains(&right) && down > -0.28 {
        12
    } else {
        40
    }
}

fn show(title: &str, edges: &EdgeMap) {
    println!("{title}");
    for v in (0..edges.height()).step_by(2) {
        let row =
            (0..edges.width()).map(|u| match (edges.contains(u, v), edges.contains(u, v + 1)) {
                (true, true) => ':',
                (true, false) => '\'',
                (false, true) => '.',
                (false, false) => ' ',
            });
        println!("|{}|", row.collect::<String>());
    }
}
