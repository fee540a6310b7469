//! The grid: growth, order, footprint, bounds.

use occgrid::{
    Cell, MapFrame, OccupancyGrid, Pose2, Profile, Reading, Shot, SonarModel, reference,
};

fn shot(x: f64, y: f64, theta: f64, reading: Reading) -> Shot {
    Shot {
        stamp: 0.0,
        map_from_base: Pose2::new(x, y, theta),
        bearing: 0.0,
        reading,
    }
}

#[test]
fn an_echo_marks_its_place_and_clears_the_way() {
    let mut grid = OccupancyGrid::new(0.25).expect("a valid resolution");
    grid.update(
        &SonarModel::default(),
        &shot(0.125, 0.125, 0.0, Reading::Echo { range: 2.0 }),
    )
    .expect("a valid shot");
    let at = |x: f64| {
        let cell = grid
            .frame()
            .cell_at(occgrid::Point2::new(x, 0.125))
            .expect("inside");
        grid.probability(cell)
    };
    assert!((at(0.625) - 0.4).abs() < 1e-3);
    assert!(at(2.125) > 0.8);
    assert!((at(3.125) - 0.5).abs() < 1e-6);
}

/// A small repeatable source of numbers in 0..1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

fn random_model(random: &mut Random) -> SonarModel {
    SonarModel {
        beam_width: 0.01 * 200_f64.powf(random.next()),
        sigma: 0.02 * 15_f64.powf(random.next()),
        p_min: random.between(0.2, 0.45),
        p_max: random.between(0.6, 0.95),
        max_range: random.between(1.0, 5.0),
        blanking: if random.next() < 0.5 {
            0.0
        } else {
            random.between(0.0, 0.5)
        },
        mount: Pose2::new(
            random.between(-0.3, 0.3),
            random.between(-0.3, 0.3),
            random.between(-3.0, 3.0),
        ),
        profile: if random.next() < 0.5 {
            Profile::Smooth
        } else {
            Profile::Literal
        },
    }
}

fn random_shot(random: &mut Random, spread: f64) -> Shot {
    let kind = random.next();
    let range = if random.next() < 0.05 {
        0.0
    } else {
        random.between(0.0, 5.5)
    };
    Shot {
        stamp: 0.0,
        map_from_base: Pose2::new(
            random.between(-spread, spread),
            random.between(-spread, spread),
            random.between(-10.0, 10.0),
        ),
        bearing: random.between(-4.0, 4.0),
        reading: match kind {
            k if k < 0.6 => Reading::Echo { range },
            k if k < 0.9 => Reading::NoEcho { listened: range },
            k if k < 0.95 => Reading::TooClose,
            _ => Reading::Fault,
        },
    }
}

/// Cells whose centre lies so near to the cone's edge that rounding decides.
fn on_the_edge(frame: &MapFrame, model: &SonarModel, shot: &Shot, index: usize) -> bool {
    let width = frame.width() as usize;
    let center = frame.center_of(Cell::new((index % width) as u32, (index / width) as u32));
    let beam = model.map_from_beam(shot);
    let seen = beam.inverse().transform_from(center);
    let off = seen.y.atan2(seen.x).abs() - 0.5 * model.beam_width;
    off.abs() < 1e-9
}

#[test]
fn the_fast_update_is_the_plain_one() {
    let long = std::env::var_os("MOBOT_LONG").is_some();
    let mut random = Random(7);
    let mut compared = 0;
    for case in 0..if long { 60_000 } else { 3_000 } {
        let resolution = [0.03, 0.05, 0.1, 0.25, 1.0, 3.0][case % 6];
        let model = random_model(&mut random);
        let shot = random_shot(&mut random, 4.0);
        let mut grid = OccupancyGrid::new(resolution).expect("a valid resolution");
        grid.update(&model, &shot).expect("a valid shot");
        let mut plain = vec![0.0; grid.frame().cell_count()];
        reference::update(grid.frame(), &mut plain, &model, &shot);
        for (index, (fast, plain)) in grid.log_odds().iter().zip(&plain).enumerate() {
            assert!(
                fast.to_bits() == plain.to_bits()
                    || on_the_edge(grid.frame(), &model, &shot, index),
                "case {case}, cell {index} of {:?}: {fast} for {plain}\n{model:?}\n{shot:?}",
                grid.frame()
            );
            compared += usize::from(*plain != 0.0);
        }
    }
    assert!(compared > 100_000, "only {compared} cells had evidence");
}

#[test]
#[ignore = "timing: cargo test --release -p occgrid --test it -- --ignored --nocapture speed"]
fn speed() {
    let mut random = Random(3);
    let model = SonarModel::default();
    let shots: Vec<Shot> = (0..2_000)
        .map(|_| {
            let range = random.between(3.0, 5.0);
            let reading = if random.next() < 0.7 {
                Reading::Echo { range }
            } else {
                Reading::NoEcho { listened: range }
            };
            shot(
                random.between(-5.0, 5.0),
                random.between(-5.0, 5.0),
                random.between(-3.0, 3.0),
                reading,
            )
        })
        .collect();
    let mut grid = OccupancyGrid::new(0.05).expect("a valid resolution");
    grid.integrate(&model, &shots).expect("valid shots");
    let frame = *grid.frame();
    let mut ones = vec![0.0; frame.cell_count()];
    let mut touched = 0;
    for shot in &shots {
        ones.fill(0.0);
        reference::update(&frame, &mut ones, &model, shot);
        touched += ones.iter().filter(|v| **v != 0.0).count();
    }
    let mut plain = vec![0.0; frame.cell_count()];
    let (mut fast_times, mut plain_times) = (vec![], vec![]);
    for _ in 0..15 {
        let start = std::time::Instant::now();
        grid.integrate(&model, &shots).expect("valid shots");
        fast_times.push(start.elapsed().as_secs_f64());
        let start = std::time::Instant::now();
        for shot in &shots {
            reference::update(&frame, &mut plain, &model, shot);
        }
        plain_times.push(start.elapsed().as_secs_f64());
    }
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    let (fast, plain) = (median(&mut fast_times), median(&mut plain_times));
    println!(
        "{} shots, {touched} cells touched: {:.2} ns a cell, {:.1} us a shot; plain {:.1} ns a cell; ratio {:.1}",
        shots.len(),
        fast * 1e9 / touched as f64,
        fast * 1e6 / shots.len() as f64,
        plain * 1e9 / touched as f64,
        plain / fast
    );
}
