//! The grid: growth, order of readings, footprint, limits; the fast update against the plain one.

use std::f64::consts::{FRAC_PI_2, PI};

use occgrid::{
    Cell, CellState, FREE_AT_MOST, GridError, GridLimits, MapFrame, OCCUPIED_AT_LEAST,
    OccupancyGrid, Point2, Pose2, Profile, Reading, Shot, SonarModel, gray_level, reference,
};
use proptest::prelude::*;

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

/// The first cell in which a grid and the plain update of the same shots differ by a bit.
fn first_difference(grid: &OccupancyGrid, model: &SonarModel, shots: &[Shot]) -> Option<String> {
    let frame = grid.frame();
    let mut plain = vec![0.0; frame.cell_count()];
    for shot in shots {
        reference::update(frame, &mut plain, model, shot);
    }
    let index = grid
        .log_odds()
        .iter()
        .zip(&plain)
        .position(|(a, b)| a.to_bits() != b.to_bits())?;
    let (fast, plain) = (grid.log_odds()[index], plain[index]);
    let (col, row) = (
        index % frame.width() as usize,
        index / frame.width() as usize,
    );
    Some(format!(
        "cell ({col}, {row}): {fast} for {plain}\n{frame:?}\n{model:?}\n{shots:?}"
    ))
}

/// One of a few.
fn pick<T: Copy>(random: &mut Random, from: &[T]) -> T {
    from[(random.next() * from.len() as f64) as usize]
}

/// A coordinate [cells]: on a grid line, in the middle of a cell, or anywhere.
fn any_place(random: &mut Random) -> f64 {
    let place = random.between(-20.0, 20.0);
    match pick(random, &[0, 1, 2]) {
        0 => place.round(),
        1 => place.floor() + 0.5,
        _ => place,
    }
}

/// An angle: a multiple of a round one, or any [rad].
fn any_angle(random: &mut Random) -> f64 {
    let step = pick(random, &[0.0, 18.0, 45.0, 90.0]);
    if step == 0.0 {
        random.between(-10.0, 10.0)
    } else {
        (step * random.between(-20.0, 20.0).round()).to_radians()
    }
}

/// A shot from the neighbourhood of the origin, mostly so short that the plain update takes no time.
fn any_shot(random: &mut Random, resolution: f64) -> Shot {
    let cells = if random.next() < 0.01 { 400.0 } else { 50.0 };
    let range = random.between(0.0, cells * resolution).min(5.5);
    let range = pick(random, &[range, (range * 10.0).round() / 10.0]);
    let (x, y) = (any_place(random), any_place(random));
    Shot {
        stamp: 0.0,
        map_from_base: Pose2::new(x * resolution, y * resolution, any_angle(random)),
        bearing: any_angle(random),
        reading: if random.next() < 0.7 {
            Reading::Echo { range }
        } else {
            Reading::NoEcho { listened: range }
        },
    }
}

/// Four shots a model, so that the grid grows between them.
fn compare_random_shots(seed: u64, models: usize) {
    let mut random = Random(seed);
    let mut compared = 0;
    for _ in 0..models {
        let resolution = pick(&mut random, &[0.01, 0.02, 0.05, 0.07, 0.1, 0.25, 0.5]);
        let widths = [
            0.01 * 310_f64.powf(random.next()),
            18_f64.to_radians(),
            FRAC_PI_2,
            PI,
        ];
        let model = SonarModel {
            beam_width: pick(&mut random, &widths),
            sigma: 0.01 * 50_f64.powf(random.next()),
            mount: if random.next() < 0.7 {
                Pose2::default()
            } else {
                Pose2::new(random.next(), random.next(), 0.0)
            },
            ..random_model(&mut random)
        };
        let shots: Vec<Shot> = (0..4).map(|_| any_shot(&mut random, resolution)).collect();
        let mut grid = OccupancyGrid::new(resolution).expect("a valid resolution");
        grid.integrate(&model, &shots).expect("valid shots");
        let difference = first_difference(&grid, &model, &shots);
        assert!(difference.is_none(), "{}", difference.unwrap_or_default());
        compared += grid.log_odds().iter().filter(|v| **v != 0.0).count();
    }
    assert!(compared > 20 * models, "only {compared} cells had evidence");
}

#[test]
fn the_fast_update_is_the_plain_one() {
    compare_random_shots(7, if long() { 125_000 } else { 5_500 });
}

#[test]
fn they_agree_on_frames_that_are_turned_and_far_from_the_origin() {
    let mut random = Random(13);
    for _ in 0..if long() { 20_000 } else { 1_000 } {
        let origin = Pose2::new(
            random.between(-500.0, 500.0),
            random.between(-500.0, 500.0),
            any_angle(&mut random),
        );
        let model = random_model(&mut random);
        let resolution = random.between(0.04, 0.4);
        let frame = MapFrame::new(100, 80, resolution, origin).expect("a valid frame");
        let mut grid =
            OccupancyGrid::from_log_odds(frame, vec![0.0; frame.cell_count()]).expect("finite");
        let place = frame.center_of(Cell::new(50, 40));
        let mut shot = any_shot(&mut random, resolution);
        shot.map_from_base.x += place.x;
        shot.map_from_base.y += place.y;
        grid.update(&model, &shot).expect("a valid shot");
        let difference = first_difference(&grid, &model, &[shot]);
        assert!(difference.is_none(), "{}", difference.unwrap_or_default());
    }
}

/// Probability of a grid at a point; 0.5 outside.
fn probability_at(grid: &OccupancyGrid, x: f64, y: f64) -> f32 {
    let cell = grid.frame().cell_at(Point2::new(x, y));
    cell.map_or(0.5, |cell| grid.probability(cell))
}

#[test]
fn no_cell_on_the_axis_is_skipped() {
    let mut random = Random(11);
    for _ in 0..500 {
        let model = SonarModel {
            beam_width: 1e-3,
            sigma: 0.05,
            ..SonarModel::default()
        };
        let resolution = random.between(0.02, 0.5);
        let base = Pose2::new(random.next(), random.next(), random.between(-4.0, 4.0));
        let range = random.between(1.0, 4.0);
        let mut grid = OccupancyGrid::new(resolution).expect("a valid resolution");
        let reading = Reading::Echo { range };
        let shot = Shot {
            stamp: 0.0,
            map_from_base: base,
            bearing: 0.0,
            reading,
        };
        grid.update(&model, &shot).expect("a valid shot");
        // up to where the evidence changes its sign, less the depth of a cell
        let clear = range - 0.2 - 2.0 * resolution;
        for k in 0..1000 {
            let along = clear * f64::from(k) / 1000.0;
            let (x, y) = (
                base.x + along * base.theta.cos(),
                base.y + along * base.theta.sin(),
            );
            assert!(
                along > clear || clear < 0.0 || probability_at(&grid, x, y) < 0.5,
                "{along} of {shot:?}"
            );
        }
    }
}

#[test]
fn readings_that_are_no_evidence_change_nothing() {
    let model = SonarModel {
        blanking: 0.3,
        max_range: 4.0,
        ..SonarModel::default()
    };
    let mut grid = OccupancyGrid::new(0.1).expect("a valid resolution");
    for reading in [
        Reading::TooClose,
        Reading::Fault,
        Reading::Echo { range: 0.29 },
        Reading::Echo { range: 4.01 },
        Reading::NoEcho { listened: 0.3 },
    ] {
        grid.update(&model, &shot(0.0, 0.0, 0.0, reading))
            .expect("ignored");
        assert_eq!(
            (grid.frame().cell_count(), grid.log_odds()),
            (1, &[0.0][..]),
            "{reading:?}"
        );
    }
    grid.update(&model, &shot(0.0, 0.0, 0.1, Reading::Echo { range: 2.0 }))
        .expect("taken");
    assert!(
        (probability_at(&grid, 0.25, 0.05) - 0.5).abs() < 1e-6,
        "nearer than blanking"
    );
    assert!(probability_at(&grid, 0.45, 0.05) < 0.45);
}

#[test]
fn silence_never_says_more_than_p_min() {
    let model = SonarModel::default();
    let mut grid = OccupancyGrid::new(0.05).expect("a valid resolution");
    let silence = shot(0.01, 0.02, 0.0, Reading::NoEcho { listened: 4.0 });
    grid.update(&model, &silence).expect("a valid shot");
    let least = grid.log_odds().iter().copied().fold(0.0, f32::min);
    assert!(
        least >= (0.4_f32 / 0.6).ln() - 1e-3 && least < -0.35,
        "{least}"
    );
    assert!(grid.log_odds().iter().all(|l| *l <= 0.0));
    let (near, far) = (
        probability_at(&grid, 1.0, 0.02),
        probability_at(&grid, 3.0, 0.02),
    );
    assert!(
        (near - 0.425).abs() < 2e-3 && (far - 0.475).abs() < 2e-3,
        "{near} {far}"
    );
    assert!((probability_at(&grid, 4.1, 0.02) - 0.5).abs() < 1e-6);
}

#[test]
fn refusals_leave_the_grid_unchanged() {
    let model = SonarModel::default();
    let limits = GridLimits {
        max_cells: 192 * 192,
    };
    let mut grid = OccupancyGrid::new(0.1)
        .expect("a valid resolution")
        .with_limits(limits);
    let echo = Reading::Echo { range: 2.0 };
    grid.update(&model, &shot(1.0, 1.0, 0.0, echo))
        .expect("inside");
    let before = grid.clone();
    let bad_model = SonarModel {
        sigma: 0.0,
        ..model
    };
    let refused = [
        grid.update(&model, &shot(100.0, 1.0, 0.0, echo)),
        grid.update(&model, &shot(1e300, 1.0, 0.0, echo)),
        grid.update(&model, &shot(f64::NAN, 1.0, 0.0, echo)),
        grid.update(&model, &shot(1.0, 1.0, 0.0, Reading::Echo { range: -1.0 })),
        grid.update(
            &model,
            &shot(
                1.0,
                1.0,
                0.0,
                Reading::NoEcho {
                    listened: f64::INFINITY,
                },
            ),
        ),
        grid.update(&bad_model, &shot(1.0, 1.0, 0.0, echo)),
    ];
    assert!(matches!(refused[0], Err(GridError::TooLarge { .. })));
    assert!(matches!(refused[1], Err(GridError::TooLarge { .. })));
    assert!(matches!(refused[2], Err(GridError::Shot { .. })));
    assert!(matches!(refused[3], Err(GridError::Shot { .. })));
    assert!(matches!(refused[4], Err(GridError::Shot { .. })));
    assert!(matches!(refused[5], Err(GridError::Model(_))));
    assert_eq!(grid.frame(), before.frame());
    assert_eq!(grid.log_odds(), before.log_odds());
    let frame = *grid.frame();
    let short = OccupancyGrid::from_log_odds(frame, vec![0.0; 3]);
    assert!(matches!(short, Err(GridError::Length { found: 3, .. })));
    let nan = OccupancyGrid::from_log_odds(frame, vec![f32::NAN; frame.cell_count()]);
    assert!(matches!(nan, Err(GridError::Value { index: 0, .. })));
}

#[test]
fn a_billion_updates_stay_finite() {
    // From where f32 stops counting single echoes, and at the largest evidence that a model allows.
    let model = SonarModel {
        p_min: 1e-6,
        p_max: 1.0 - 1e-6,
        ..SonarModel::default()
    };
    let mut grid = OccupancyGrid::new(0.25).expect("a valid resolution");
    let echo = shot(0.0, 0.0, 0.0, Reading::Echo { range: 2.0 });
    grid.update(&model, &echo).expect("a valid shot");
    let start: Vec<f32> = grid.log_odds().iter().map(|l| l * 1e9).collect();
    let mut grid = OccupancyGrid::from_log_odds(*grid.frame(), start.clone()).expect("finite");
    for _ in 0..1000 {
        grid.update(&model, &echo).expect("a valid shot");
    }
    assert!(grid.log_odds().iter().all(|l| l.is_finite()));
    assert_eq!(
        grid.log_odds(),
        start,
        "far out, single echoes no longer count"
    );
    assert!(grid.to_gray().iter().all(|g| [0, 127, 255].contains(g)));
}

#[test]
fn a_loaded_grid_grows_on_its_own_lattice() {
    let frame = MapFrame::new(70, 50, 0.1, Pose2::new(3.0, -2.0, 0.5)).expect("a valid frame");
    let values: Vec<f32> = (0..frame.cell_count()).map(|k| k as f32).collect();
    let mut grid = OccupancyGrid::from_log_odds(frame, values).expect("finite");
    let model = SonarModel::default();
    let inside = shot(5.0, 2.0, 0.5, Reading::Echo { range: 1.0 });
    grid.update(&model, &inside).expect("a valid shot");
    assert_eq!(
        *grid.frame(),
        frame,
        "a beam inside the frame needs no growth"
    );
    let before = grid.clone();
    grid.update(&model, &shot(-9.0, -7.0, 2.0, Reading::Echo { range: 2.0 }))
        .expect("valid");
    assert!(grid.frame().cell_count() > frame.cell_count());
    for col in 0..frame.width() {
        for row in 0..frame.height() {
            let old = Cell::new(col, row);
            let new = grid
                .frame()
                .cell_at(frame.center_of(old))
                .expect("still covered");
            let (was, is) = (
                before.log_odds()[frame.index(old)],
                grid.log_odds()[grid.frame().index(new)],
            );
            assert!(was.to_bits() == is.to_bits(), "{old:?}: {is} for {was}");
        }
    }
}

#[test]
fn evidence_of_a_cell_is_what_the_update_adds() {
    let mut random = Random(23);
    for _ in 0..200 {
        let model = random_model(&mut random);
        let shot = random_shot(&mut random, 2.0);
        let mut grid = OccupancyGrid::new(0.1).expect("a valid resolution");
        grid.update(&model, &shot).expect("a valid shot");
        for row in 0..grid.frame().height() {
            for col in 0..grid.frame().width() {
                let cell = Cell::new(col, row);
                let alone = grid.evidence(&model, &shot, cell).expect("a valid shot");
                let added = grid.log_odds()[grid.frame().index(cell)];
                assert!(
                    (alone - added).abs() < 1e-9,
                    "{cell:?}: {alone} for {added}"
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: if long() { 2000 } else { 60 }, ..ProptestConfig::default() })]

    /// Bit for bit, with growth in every direction.
    #[test]
    fn the_order_of_readings_is_irrelevant(seed in any::<u64>(), count in 1_usize..40, yaw in -3.0..3.0) {
        let mut random = Random(seed);
        let model = random_model(&mut random);
        let resolution = random.between(0.04, 0.4);
        let mut shots: Vec<Shot> = (0..count).map(|_| random_shot(&mut random, 20.0)).collect();
        let frame = MapFrame::new(10, 20, resolution, Pose2::new(1.0, 2.0, yaw)).expect("valid");
        for start in [
            OccupancyGrid::new(resolution).expect("valid"),
            OccupancyGrid::from_log_odds(frame, vec![0.0; 200]).expect("valid"),
        ] {
            let mut forward = start.clone();
            forward.integrate(&model, &shots).expect("valid shots");
            for _ in 0..3 {
                for k in (1..shots.len()).rev() {
                    shots.swap(k, (random.next() * (k + 1) as f64) as usize);
                }
                let mut shuffled = start.clone();
                shuffled.integrate(&model, &shots).expect("valid shots");
                prop_assert_eq!(forward.frame(), shuffled.frame());
                let bits = |grid: &OccupancyGrid| -> Vec<u32> {
                    grid.log_odds().iter().map(|l| l.to_bits()).collect()
                };
                prop_assert_eq!(bits(&forward), bits(&shuffled));
            }
        }
    }
}

#[test]
fn half_is_never_free() {
    assert_eq!([0.0, 0.5, 1.0].map(gray_level), [255, 127, 0]);
    assert_eq!(gray_level(0.498), 128);
    for p in [0.4981_f32, 0.499, 0.5 - f32::EPSILON, 0.5, 0.6] {
        assert!(
            gray_level(p) <= 128 && (p < 0.5 || gray_level(p) <= 127),
            "{p}"
        );
    }
    for level in 0..=255_u8 {
        assert_eq!(gray_level(1.0 - f32::from(level) / 255.0), level);
    }
}

#[test]
fn the_finished_map_has_three_states() {
    let frame = MapFrame::new(5, 1, 0.1, Pose2::default()).expect("a valid frame");
    let grid =
        OccupancyGrid::from_log_odds(frame, vec![0.0, -3.0, 3.0, 0.1, -50.0]).expect("finite");
    let map = grid.to_occupancy_map(FREE_AT_MOST, OCCUPIED_AT_LEAST);
    // 100 / (1 + exp(-l)): 4.74, 95.26, 52.50 and, clamped to -10, 0.005
    assert_eq!(map.values(), [-1, 5, 95, 52, 0]);
    let states = [0, 1, 2, 3, 4].map(|col| map.state(Cell::new(col, 0)));
    use CellState::{Free, Occupied, Unknown};
    assert_eq!(states, [Unknown, Free, Occupied, Unknown, Free]);
    assert_eq!(grid.to_gray(), [127, 243, 12, 121, 255]);
}

#[cfg(feature = "image")]
#[test]
fn a_picture_has_the_gray_levels_row_after_row() {
    let frame = MapFrame::new(2, 3, 0.1, Pose2::default()).expect("a valid frame");
    let values = vec![0.0, -50.0, 3.0, 0.0, 0.0, 50.0];
    let grid = OccupancyGrid::from_log_odds(frame, values).expect("finite");
    let picture = grid.to_gray_image();
    assert_eq!(picture.dimensions(), (2, 3));
    // 255 (1 - 1 / (1 + exp(-3))) = 12.09
    assert_eq!(picture.into_raw(), [127, 255, 12, 127, 127, 0]);
}

fn long() -> bool {
    std::env::var_os("MOBOT_LONG").is_some()
}

/// Round numbers put centres exactly on the rim of a beam, on its edges and on its blanking distance, and
/// axes along grid lines and through corners.
#[test]
fn round_numbers_agree_too() {
    for (resolution, sigma) in [
        (0.25, 0.05),
        (0.05, 0.05),
        (0.02, 0.05),
        (0.05, 0.2),
        (0.1, 0.1),
    ] {
        for degrees in [18_f64, 30.0, 90.0, 170.0, 180.0] {
            let model = SonarModel {
                sigma,
                blanking: 0.3,
                beam_width: degrees.to_radians(),
                ..SonarModel::default()
            };
            for k in 0..40 {
                let reading = if k % 4 == 3 {
                    Reading::NoEcho { listened: 2.0 }
                } else {
                    Reading::Echo {
                        range: 0.5 + 0.05 * f64::from(k),
                    }
                };
                let bearing = (9.0 * f64::from(k)).to_radians();
                for cells in [0.0, 0.5, 7.0] {
                    let place = cells * resolution;
                    let turn = [0.0, 0.3][k as usize % 2];
                    let shot = Shot {
                        bearing,
                        ..shot(place, -place, turn, reading)
                    };
                    let mut grid = OccupancyGrid::new(resolution).expect("a valid resolution");
                    grid.update(&model, &shot).expect("a valid shot");
                    let difference = first_difference(&grid, &model, &[shot]);
                    assert!(difference.is_none(), "{}", difference.unwrap_or_default());
                }
            }
        }
    }
}

/// Twenty shots all round at each of some places of a square, as a robot takes them at every stop.
fn full_turns(stops: usize, side: f64) -> Vec<Shot> {
    let mut random = Random(3);
    let mut shots = Vec::new();
    for _ in 0..stops {
        let base = Pose2::new(
            random.between(6.0, side - 6.0),
            random.between(6.0, side - 6.0),
            random.between(-3.0, 3.0),
        );
        shots.extend((0..20).map(|k| Shot {
            stamp: 0.0,
            map_from_base: base,
            bearing: (18.0 * f64::from(k)).to_radians(),
            reading: if k % 4 == 3 {
                Reading::NoEcho { listened: 5.0 }
            } else {
                Reading::Echo {
                    range: 0.5 + 0.22 * f64::from(k),
                }
            },
        }));
    }
    shots
}

#[test]
#[ignore = "timing: cargo test --release -p occgrid --test it -- --ignored --nocapture speed"]
fn speed() {
    /// 4096 cells of 0.05 m [m].
    const SIDE: f64 = 204.8;
    for resolution in [0.05, 0.1, 0.25] {
        let cells = (SIDE / resolution) as u32;
        let frame = MapFrame::new(cells, cells, resolution, Pose2::default()).expect("valid");
        for degrees in [15_f64, 18.0, 30.0] {
            let model = SonarModel {
                sigma: 0.05,
                beam_width: degrees.to_radians(),
                ..SonarModel::default()
            };
            time_updates(frame, &model, &full_turns(50, SIDE));
        }
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

#[expect(
    clippy::print_stdout,
    reason = "a timing is read by whoever asked for it"
)]
fn time_updates(frame: MapFrame, model: &SonarModel, shots: &[Shot]) {
    let touched: usize = shots
        .iter()
        .map(|shot| {
            let mut alone = OccupancyGrid::new(frame.resolution()).expect("a valid resolution");
            alone.update(model, shot).expect("a valid shot");
            alone.log_odds().iter().filter(|v| **v != 0.0).count()
        })
        .sum();
    let mut plain = vec![0.0; frame.cell_count()];
    let mut grid = OccupancyGrid::from_log_odds(frame, plain.clone()).expect("finite");
    // Every place is left for all others before it comes again, so that it is not in the nearest caches.
    let stops = shots.chunks(20);
    let mut times = vec![[const { Vec::new() }; 2]; stops.len()];
    for _ in 0..15 {
        for (times, stop) in times.iter_mut().zip(stops.clone()) {
            let start = std::time::Instant::now();
            grid.integrate(model, stop).expect("valid shots");
            times[0].push(start.elapsed().as_secs_f64());
        }
        for (times, stop) in times.iter_mut().zip(stops.clone()) {
            let start = std::time::Instant::now();
            for shot in stop {
                reference::update(&frame, &mut plain, model, shot);
            }
            times[1].push(start.elapsed().as_secs_f64());
        }
    }
    assert!(grid.log_odds() == plain, "the two differ");
    let mut sums = [0.0; 2];
    for of_stop in times {
        for (sum, times) in sums.iter_mut().zip(of_stop) {
            *sum += median(times);
        }
    }
    let [fast, plain] = sums;
    println!(
        "{} m, {:.0} degrees: {:.0} cells a shot, {:.2} us a shot, {:.1} ns a cell; plain {:.1} us a shot; ratio {:.1}",
        frame.resolution(),
        model.beam_width.to_degrees(),
        touched as f64 / shots.len() as f64,
        fast * 1e6 / shots.len() as f64,
        fast * 1e9 / touched as f64,
        plain * 1e6 / shots.len() as f64,
        plain / fast
    );
}
