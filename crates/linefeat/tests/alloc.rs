//! No frame but the first allocates. A binary of its own: its allocator counts.

use std::alloc::System;
use std::sync::Mutex;

use image::{GrayImage, Luma};
use linefeat::{
    CannyParams, Detector, DetectorParams, FloorState, FloorView, Hough, HoughParams,
    ModifiedCannyParams, ObstacleParams, ObstacleTracker, SegmentParams, Voting,
};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Stripes that move and turn with the number of the frame.
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

/// The tests take turns: all threads' allocations are counted.
static TURN: Mutex<()> = Mutex::new(());

/// Whatever is worst for each step: noise for edges, stripes for segments and votes.
fn rich_frame(number: u32) -> GrayImage {
    GrayImage::from_fn(320, 240, |u, v| {
        let mut mixed = (u * 240 + v + number * 76_801).wrapping_mul(2_654_435_761);
        mixed ^= mixed >> 15;
        Luma([match number % 3 {
            0 => (mixed.wrapping_mul(0x85EB_CA6B) >> 24) as u8,
            1 => 255 * u8::from((u / (12 + number) + v / 14).is_multiple_of(2)),
            _ => 255 * u8::from((u + v * (number % 4)) % 8 < 4),
        }])
    })
}

/// The first frame shows nothing, and no later one needs more room.
#[test]
fn no_frame_after_the_first_allocates() {
    let _turn = TURN.lock();
    let params = DetectorParams {
        canny: CannyParams {
            low: 1.0,
            high: 2.0,
            ..CannyParams::default()
        },
        segments: SegmentParams {
            length_px: 0,
            ..SegmentParams::default()
        },
    };
    let mut detector = Detector::new(params);
    let mut hough = Hough::new();
    let mut lines = Vec::new();
    let votings = [Voting::AllDirections, HoughParams::default().voting];
    let mut work = |frame: &GrayImage| {
        detector.detect_modified(frame, &ModifiedCannyParams::default());
        let found = detector.detect(frame).len();
        for voting in votings {
            let params = HoughParams {
                voting,
                votes: 10,
                ..HoughParams::default()
            };
            hough
                .detect(detector.edges(), &params, &mut lines)
                .expect("bins");
        }
        [detector.edges().pixels().len(), found, lines.len()]
    };
    let poor = GrayImage::from_pixel(320, 240, Luma([90]));
    assert_eq!(work(&poor), [0, 0, 0]);
    let frames: Vec<_> = (0..30).map(frame).chain((0..12).map(rich_frame)).collect();
    let region = Region::new(ALLOCATOR);
    let mut most = [0; 3];
    for frame in &frames {
        most = [0, 1, 2].map(|i| most[i].max(work(frame)[i]));
    }
    let change = region.change();
    assert!(
        most[0] > 20_000 && most[1] > 300 && most[2] == 500,
        "{most:?}"
    );
    assert_eq!(change.allocations + change.reallocations, 0, "{change:?}");
}

/// A box that crosses the floor, or boxes that are everywhere but for a moment.
fn floor_frame(number: u32, crowded: bool) -> GrayImage {
    let mixed = |seed: u32| {
        let mixed = seed.wrapping_mul(2_654_435_761);
        (mixed ^ mixed >> 15).wrapping_mul(0x85EB_CA6B) >> 24
    };
    GrayImage::from_fn(320, 240, |u, v| {
        let noise = mixed(u * 240 + v + number * 76_801) % 4;
        let inside = if crowded {
            mixed(u / 20 + v / 12 * 16 + number * 401) < 50
        } else {
            (4 * number..4 * number + 40).contains(&u) && v < 130
        };
        Luma([(if inside { 30 } else { 120 } + noise) as u8])
    })
}

#[test]
fn what_moves_is_followed_without_allocating() {
    let _turn = TURN.lock();
    // 1 m above the floor, 30 degrees down, focal length 300 px
    let view = FloorView {
        pixel_to_floor: [[0.0, -0.5, 319.8], [-1.0, 0.0, 159.5], [0.0, 0.866, 46.5]],
        nadir: [79.75, 319.56, 0.5],
    };
    let mut tracker = ObstacleTracker::new(view, ObstacleParams::default());
    let unknown = |_: [f64; 2]| FloorState::Unknown;
    let (mut followed, mut known) = (0, 0);
    for number in 0..60 {
        // poor frames first, then rich ones
        let frame = floor_frame(number, number >= 40);
        let region = Region::new(ALLOCATOR);
        tracker.update(&frame, f64::from(number) * 0.1, [0.0; 3], &unknown);
        let change = region.change();
        if number >= 4 {
            assert_eq!(
                change.allocations + change.reallocations,
                0,
                "frame {number}: {change:?}"
            );
        }
        followed = followed.max(tracker.tracks().len());
        known += tracker.moving().count();
    }
    assert!(followed >= 2 && known >= 20, "{followed}, {known}");
}
