//! A door frame on a wall: its edges, each with the standard deviations of its place and direction.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use image::{GrayImage, Luma};
use linefeat::{Detector, DetectorParams};

fn main() {
    let frame = GrayImage::from_fn(160, 120, |u, v| {
        let door = (50..100).contains(&u) && v > 30;
        // a little texture instead of noise
        Luma([if door { 90 } else { 170 } + ((u * 7 + v * 13) % 5) as u8])
    });
    let mut detector = Detector::new(DetectorParams::default());
    for segment in detector.detect(&frame) {
        let [[rho, _], [_, theta]] = segment.covariance;
        println!(
            "({:6.2}, {:6.2}) to ({:6.2}, {:6.2})  rho {:7.3} +- {:.3} px  theta {:6.2} +- {:.2} deg  \
             contrast {:4.0}",
            segment.start[0],
            segment.start[1],
            segment.end[0],
            segment.end[1],
            segment.rho,
            rho.sqrt(),
            segment.theta.to_degrees(),
            theta.sqrt().to_degrees(),
            segment.contrast,
        );
    }
}
