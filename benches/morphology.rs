//! Morphology, filling, labelling and distance on real maps. Every kernel is compared with its plain twin
//! on the small map before it is timed.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use mobot_benches::{BuildingMap, FREE_FROM};
use morpho::{
    BitImage, Border, Components, Connectivity, Element, FillWorkspace, Workspace, distance,
    reference,
};

type Operation = fn(&BitImage, &Element, Border, &mut Workspace, &mut BitImage);
type Twin = fn(&BitImage, &Element, Border) -> BitImage;

fn elements() -> [(&'static str, Element); 3] {
    [
        ("3x3", Element::square(3)),
        ("15x15", Element::square(15)),
        ("disk7", Element::disk(7)),
    ]
}

fn operations(c: &mut Criterion) {
    let all: [(&str, Operation, Twin); 4] = [
        ("erode", morpho::erode_into, reference::ops::erode),
        ("dilate", morpho::dilate_into, reference::ops::dilate),
        ("open", morpho::open_into, reference::ops::open),
        ("close", morpho::close_into, reference::ops::close),
    ];
    let small = BuildingMap::small().bits();
    for (name, operation, twin) in all {
        let mut group = c.benchmark_group(name);
        for (element_name, element) in elements() {
            let mut workspace = Workspace::new();
            let mut out = BitImage::new(0, 0);
            operation(&small, &element, Border::Neutral, &mut workspace, &mut out);
            assert_eq!(
                out,
                twin(&small, &element, Border::Neutral),
                "{name} {element_name}"
            );
            for map in maps() {
                let image = map.bits();
                group.bench_function(BenchmarkId::new(element_name, map.name), |b| {
                    b.iter(|| {
                        operation(&image, &element, Border::Neutral, &mut workspace, &mut out);
                    });
                });
            }
        }
    }
}

fn regions(c: &mut Criterion) {
    for map in maps() {
        let image = map.bits();
        let mut components = Components::label(&image, Connectivity::Eight);
        let seed = components.largest().expect("free cells").first;
        let mut workspace = FillWorkspace::new();
        let mut out = BitImage::new(0, 0);
        morpho::seed_fill_into(&image, seed, Connectivity::Eight, &mut workspace, &mut out);
        let area = components.largest().map(|largest| largest.area);
        assert_eq!(Some(out.count_ones()), area, "fill and labels agree");
        c.bench_function(&format!("threshold/{}", map.name), |b| {
            b.iter(|| {
                morpho::threshold_into(&map.gray, map.width, map.height, FREE_FROM, &mut out)
            });
        });
        assert_eq!(out, image);
        c.bench_function(&format!("seed_fill/{}", map.name), |b| {
            b.iter(|| {
                morpho::seed_fill_into(&image, seed, Connectivity::Eight, &mut workspace, &mut out);
            });
        });
        c.bench_function(&format!("components/{}", map.name), |b| {
            b.iter(|| components.relabel(&image, Connectivity::Eight));
        });
    }
}

fn distances(c: &mut Criterion) {
    let small = BuildingMap::small().bits();
    assert_eq!(
        distance::squared(&small, Border::Background),
        reference::distance::squared(&small, Border::Background)
    );
    for map in maps() {
        let image = map.bits();
        let mut workspace = distance::Workspace::default();
        let mut out = Vec::new();
        c.bench_function(&format!("distance/{}", map.name), |b| {
            b.iter(|| {
                distance::squared_into(&image, Border::Background, &mut workspace, &mut out);
            });
        });
    }
}

fn maps() -> [BuildingMap; 3] {
    [
        BuildingMap::small(),
        BuildingMap::medium(),
        BuildingMap::large(),
    ]
}

criterion_group!(benches, operations, regions, distances);
criterion_main!(benches);
