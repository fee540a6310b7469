//! Hough transforms and segments on real frames.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use linefeat::{Detector, DetectorParams, Hough, HoughParams, Voting};
use mobot_benches::frames::Frame;

fn bench(criterion: &mut Criterion) {
    for Frame { name, image: frame } in Frame::all() {
        let mut detector = Detector::new(DetectorParams::default());
        assert!(detector.detect(&frame).len() > 10);
        let edges = detector.edges().clone();
        let mut hough = Hough::new();
        let mut lines = Vec::new();
        let modified = HoughParams::default();
        let standard = HoughParams {
            voting: Voting::AllDirections,
            votes: 100,
            ..modified
        };
        for (work, params) in [("hough_standard", standard), ("hough_modified", modified)] {
            criterion.bench_function(&format!("{work}/{name}"), |bencher| {
                bencher.iter(|| hough.detect(&edges, black_box(&params), &mut lines));
            });
            assert!(!lines.is_empty());
        }
        criterion.bench_function(&format!("segments/{name}"), |bencher| {
            bencher.iter(|| black_box(detector.detect(black_box(&frame)).len()));
        });
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
