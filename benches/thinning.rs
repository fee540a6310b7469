//! Thinning of real maps. Zhang-Suen and Guo-Hall are compared with their plain twins, ours by what it
//! keeps, before they are timed.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use mobot_benches::BuildingMap;
use morpho::{BitImage, Components, Connectivity, holes, reference, thin};

type Thinning = fn(&BitImage) -> BitImage;

fn thinnings(c: &mut Criterion) {
    let all: [(&str, Thinning); 3] = [
        ("zhang_suen", thin::zhang_suen),
        ("guo_hall", thin::guo_hall),
        ("homotopic", thin::homotopic),
    ];
    let small = BuildingMap::small().bits();
    assert_eq!(
        thin::zhang_suen(&small),
        reference::thin::zhang_suen(&small)
    );
    assert_eq!(thin::guo_hall(&small), reference::thin::guo_hall(&small));
    assert_eq!(topology(&thin::homotopic(&small)), topology(&small));
    let mut group = c.benchmark_group("thin");
    group.sample_size(20);
    for map in [
        BuildingMap::small(),
        BuildingMap::medium(),
        BuildingMap::large(),
    ] {
        let image = map.bits();
        for (name, thinning) in all {
            group.bench_function(BenchmarkId::new(name, map.name), |b| {
                b.iter(|| thinning(&image));
            });
        }
    }
}

/// Components of the foreground and holes.
fn topology(image: &BitImage) -> (usize, usize) {
    let components = Components::label(image, Connectivity::Eight).count();
    (components, holes(image, Connectivity::Eight))
}

criterion_group!(benches, thinnings);
criterion_main!(benches);
