//! Sonar updates. The fast update and the plain loop give the same grid before they are timed.

use criterion::{Criterion, criterion_group, criterion_main};
use occgrid::{MapFrame, OccupancyGrid, Pose2, Reading, Shot, SonarModel, reference};

fn updates(c: &mut Criterion) {
    let model = SonarModel {
        sigma: 0.05,
        max_range: 5.0,
        ..SonarModel::default()
    };
    let shots = full_turn();
    for (name, resolution) in [("0.25 m", 0.25), ("0.05 m", 0.05), ("0.02 m", 0.02)] {
        let side = (16.0 / resolution) as u32;
        let frame = MapFrame::new(side, side, resolution, Pose2::new(-8.0, -8.0, 0.0))
            .expect("a valid frame");
        let blank = vec![0.0; frame.cell_count()];
        let mut grid = OccupancyGrid::from_log_odds(frame, blank.clone()).expect("a grid");
        let mut plain = blank;
        grid.integrate(&model, &shots).expect("inside the grid");
        for shot in &shots {
            reference::update(&frame, &mut plain, &model, shot);
        }
        assert_eq!(grid.log_odds(), plain, "{name}");
        c.bench_function(&format!("sonar_update/{name}"), |b| {
            b.iter(|| grid.integrate(&model, &shots));
        });
        c.bench_function(&format!("sonar_update_plain/{name}"), |b| {
            b.iter(|| {
                for shot in &shots {
                    reference::update(&frame, &mut plain, &model, shot);
                }
            });
        });
    }
}

/// Twenty shots all round, as the paper's robot takes them at every stop.
fn full_turn() -> Vec<Shot> {
    (0..20)
        .map(|k| Shot {
            stamp: f64::from(k),
            map_from_base: Pose2::new(0.01, 0.02, 0.3),
            bearing: (18.0 * f64::from(k)).to_radians(),
            reading: if k % 4 == 3 {
                Reading::NoEcho { listened: 5.0 }
            } else {
                Reading::Echo {
                    range: 0.5 + 0.22 * f64::from(k),
                }
            },
        })
        .collect()
}

criterion_group!(benches, updates);
criterion_main!(benches);
