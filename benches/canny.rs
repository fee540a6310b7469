//! Edges of real and drawn frames of 640 x 480. Each is compared with its plain twin before it is timed.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use image::GrayImage;
use linefeat::{
    Canny, CannyParams, EdgeMap, ModifiedCannyParams, Norm, Region, reference::canny as twin,
};
use mobot_benches::frames::Frame;

fn edges(c: &mut Criterion) {
    let frames = Frame::all();
    for norm in [Norm::L1, Norm::L2] {
        let params = CannyParams {
            norm,
            ..CannyParams::default()
        };
        let mut group = c.benchmark_group(format!("canny {norm:?}"));
        for Frame { name, image } in &frames {
            let mut canny = Canny::new();
            let (mut edges, mut picture) = (EdgeMap::new(), GrayImage::default());
            canny.detect(image, &params, &mut edges);
            assert_eq!(edges.to_gray(), twin::canny(image, &params), "{name}");
            group.bench_function(BenchmarkId::new("edges", name), |b| {
                b.iter(|| canny.detect(image, &params, &mut edges));
            });
            group.bench_function(BenchmarkId::new("edges and picture", name), |b| {
                b.iter(|| {
                    canny.detect(image, &params, &mut edges);
                    edges.write_gray(&mut picture);
                });
            });
        }
    }
}

fn modified(c: &mut Criterion) {
    let mut group = c.benchmark_group("canny modified");
    let regions = [
        ("whole", Region::Whole),
        ("lower", Region::HalfPlane([0.0, 1.0, -180.5])),
    ];
    for (region_name, region) in regions {
        let params = ModifiedCannyParams {
            region,
            ..ModifiedCannyParams::default()
        };
        for Frame { name, image } in Frame::all() {
            let mut canny = Canny::new();
            let mut edges = EdgeMap::new();
            canny.detect_modified(&image, &params, &mut edges);
            assert_eq!(
                edges.to_gray(),
                twin::canny_modified(&image, &params),
                "{name}"
            );
            group.bench_function(BenchmarkId::new(region_name, name), |b| {
                b.iter(|| canny.detect_modified(&image, &params, &mut edges));
            });
        }
    }
}

criterion_group!(benches, edges, modified);
criterion_main!(benches);
