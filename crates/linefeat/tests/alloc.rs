//! Frames no richer than those before allocate nothing. A binary of its own: its allocator counts.

use std::alloc::System;

use image::{GrayImage, Luma};
use linefeat::{Detector, DetectorParams, Hough, HoughParams, Voting};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Stripes that move and turn with the number of the frame, no more of them in later frames.
fn frame(number: u32) -> GrayImage {
    GrayImage::from_fn(320, 240, |u, v| {
        let across = u * (8 + number % 3) + v * (number % 5) + 3 * number;
        Luma([if (across / 256).is_multiple_of(2) {
            60
        } else {
            180
        }])
    })
}

#[test]
fn known_frames_allocate_nothing() {
    let mut detector = Detector::new(DetectorParams::default());
    let mut hough = Hough::new();
    let mut lines = Vec::new();
    let votings = [Voting::AllDirections, HoughParams::default().voting];
    let mut work = |frame: &GrayImage| {
        let found = detector.detect(frame).len();
        for voting in votings {
            let params = HoughParams {
                voting,
                ..HoughParams::default()
            };
            hough
                .detect(detector.edges(), &params, &mut lines)
                .expect("bins");
        }
        found + lines.len()
    };
    let frames: Vec<_> = (0..30).map(frame).collect();
    // the first round meets the frame richest in edges, and that richest in segments
    let first: usize = frames.iter().map(&mut work).sum();
    let region = Region::new(ALLOCATOR);
    let found: usize = frames.iter().map(&mut work).sum();
    let change = region.change();
    assert!(found > 100 && found == first, "{found}, {first}");
    assert_eq!(change.allocations + change.reallocations, 0, "{change:?}");
}
