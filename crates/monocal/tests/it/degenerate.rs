//! A generated family of sets that determine no camera over a floor: each is refused, with the reason.

use monocal::{CalibrateError, CalibrateParams, Noise, Pair, Side, calibrate};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::calibrate::noisy;
use crate::pinhole::Pinhole;

type Reason = fn(&CalibrateError) -> bool;

/// Name, the set, and what may be said of it.
fn kind(number: usize, rng: &mut Pcg64) -> (&'static str, Vec<Pair>, Reason) {
    let camera = Pinhole {
        tilt: rng.random_range(0.2..0.6),
        yaw: rng.random_range(-0.3..0.3),
        height: rng.random_range(0.5..1.5),
        ..Pinhole::paper()
    };
    let count = rng.random_range(4..20);
    let pair = |rng: &mut Pcg64, mark: [f64; 2]| {
        let [u, v] = camera.pixel(mark).expect("by construction");
        let [du, dv] = noisy(rng, 0.3);
        Pair::new([u + du, v + dv], mark)
    };
    let mark = |rng: &mut Pcg64| [rng.random_range(2.0..5.0), rng.random_range(-1.5..1.5)];
    let on_line = |t: f64| [2.2 + 1.5 * t, -1.0 + 1.1 * t];
    let spread = |rng: &mut Pcg64, count: usize| -> Vec<Pair> {
        (0..count)
            .map(|_| {
                let m = mark(rng);
                pair(rng, m)
            })
            .collect()
    };
    let line = |rng: &mut Pcg64, count: usize| -> Vec<Pair> {
        (0..count)
            .map(|k| pair(rng, on_line(2.0 * k as f64 / count as f64)))
            .collect()
    };
    match number {
        0 => ("no pairs", vec![], |e| {
            *e == CalibrateError::TooFew { found: 0 }
        }),
        1 => {
            let few = rng.random_range(1..4);
            ("too few", spread(rng, few), |e| {
                matches!(e, CalibrateError::TooFew { .. })
            })
        }
        2 => {
            let mut pairs = spread(rng, count);
            pairs[1].pixel.v = f64::NAN;
            ("a pixel that is not a number", pairs, |e| {
                matches!(
                    e,
                    CalibrateError::OutOfRange {
                        index: 1,
                        side: Side::Picture,
                        ..
                    }
                )
            })
        }
        3 => {
            let mut pairs = spread(rng, count);
            pairs[2].floor.x = f64::INFINITY;
            ("an infinite floor point", pairs, |e| {
                matches!(
                    e,
                    CalibrateError::OutOfRange {
                        index: 2,
                        side: Side::Floor,
                        ..
                    }
                )
            })
        }
        4 => {
            let mut pairs = spread(rng, count);
            pairs.push(pairs[0]);
            ("a pair twice", pairs, |e| {
                matches!(e, CalibrateError::Duplicate { first: 0, .. })
            })
        }
        5 => {
            let pixel = [200.0, 100.0];
            let pairs = (0..count).map(|_| Pair::new(pixel, mark(rng))).collect();
            ("all in one pixel", pairs, |e| {
                matches!(
                    e,
                    CalibrateError::FewPlaces {
                        side: Side::Picture,
                        found: 1
                    }
                )
            })
        }
        6 => {
            let pairs = (0..count.max(8))
                .map(|_| Pair {
                    floor: [3.0, 0.0].into(),
                    ..spread(rng, 1)[0]
                })
                .collect();
            ("all on one mark", pairs, |e| {
                matches!(
                    e,
                    CalibrateError::FewPlaces {
                        side: Side::Floor,
                        found: 1
                    }
                )
            })
        }
        7 => {
            let marks = [mark(rng), mark(rng), mark(rng)];
            let pairs = (0..12).map(|k| pair(rng, marks[k % 3])).collect();
            ("three marks read again and again", pairs, |e| {
                matches!(e, CalibrateError::FewPlaces { .. })
            })
        }
        8 => ("all on a line", line(rng, count), |e| {
            matches!(e, CalibrateError::Collinear { .. })
        }),
        9 => {
            let mut pairs = spread(rng, count);
            for (k, p) in pairs.iter_mut().enumerate() {
                p.floor = on_line(k as f64).into();
            }
            ("floor points on a line, pixels not", pairs, |e| {
                matches!(
                    e,
                    CalibrateError::Collinear { side: Side::Floor }
                        | CalibrateError::FewPlaces { .. }
                )
            })
        }
        10 => {
            let mut pairs = spread(rng, count);
            for (k, p) in pairs.iter_mut().enumerate() {
                p.pixel = [10.0 + 21.0 * k as f64, 150.0 - 7.0 * k as f64].into();
            }
            ("pixels on a line, floor points not", pairs, |e| {
                *e == CalibrateError::Collinear {
                    side: Side::Picture,
                }
            })
        }
        11 => {
            let mut pairs = line(rng, 3);
            pairs.insert(1, pair(rng, [2.3, 1.3]));
            ("three on a line of four", pairs, |e| {
                matches!(e, CalibrateError::CollinearButOne { off: 1, .. })
            })
        }
        12 => {
            let mut pairs = line(rng, 12);
            pairs.push(pair(rng, [2.3, 1.3]));
            ("all but one on a line", pairs, |e| {
                matches!(e, CalibrateError::CollinearButOne { off: 12, .. })
            })
        }
        13 => {
            let pairs = (0..count).map(|_| {
                let [dx, dy] = noisy(rng, 1e-3);
                pair(rng, [3.0 + dx, dy])
            });
            ("closer together than the noise", pairs.collect(), |e| {
                matches!(
                    e,
                    CalibrateError::FewPlaces { .. }
                        | CalibrateError::Collinear { .. }
                        | CalibrateError::CollinearButOne { .. }
                )
            })
        }
        14 => {
            let mut pairs = spread(rng, count.max(8));
            for p in &mut pairs {
                p.floor.y = -p.floor.y;
            }
            ("y to the right", pairs, |e| *e == CalibrateError::Mirrored)
        }
        15 => {
            let mut pairs = spread(rng, count.max(8));
            for p in &mut pairs {
                p.pixel.v = 219.0 - p.pixel.v;
            }
            ("v upwards", pairs, |e| *e == CalibrateError::Mirrored)
        }
        16 => {
            let mut pairs = spread(rng, count.max(6));
            let floor: Vec<_> = pairs.iter().map(|p| p.floor).collect();
            let shift = pairs.len() / 2;
            for (k, p) in pairs.iter_mut().enumerate() {
                p.floor = floor[(k * 5 + shift) % floor.len()];
            }
            let at_random = (0..pairs.len()).map(|_| {
                Pair::new(
                    [rng.random_range(0.0..480.0), rng.random_range(0.0..220.0)],
                    mark(rng),
                )
            });
            ("floor points of other pixels", at_random.collect(), |e| {
                matches!(
                    e,
                    CalibrateError::Inconsistent { .. }
                        | CalibrateError::BeyondHorizon { .. }
                        | CalibrateError::Mirrored
                )
            })
        }
        17 => {
            let corners = [[2.0, 1.0], [2.0, -1.0], [4.0, -1.0], [4.0, 1.0]];
            let mut pairs: Vec<Pair> = corners.iter().map(|c| pair(rng, *c)).collect();
            let swapped = pairs[0].floor;
            pairs[0].floor = pairs[1].floor;
            pairs[1].floor = swapped;
            ("two of four swapped", pairs, |e| {
                matches!(e, CalibrateError::BeyondHorizon { .. })
            })
        }
        18 => {
            // the ray through a pixel above the horizon meets the floor's plane behind the camera
            let mut pairs = spread(rng, count.max(6));
            for _ in 0..2 {
                let [x, y] = mark(rng);
                let behind = [-x, -y];
                let mirrored = Pinhole {
                    height: -camera.height,
                    ..camera
                };
                let [u, v] = mirrored.pixel([x, y]).expect("by construction");
                pairs.push(Pair::new([u, v], behind));
            }
            ("on both sides of the horizon", pairs, |e| {
                matches!(e, CalibrateError::BeyondHorizon { .. })
            })
        }
        19 => {
            let mut pairs = spread(rng, count);
            pairs[3].floor.y = 1e12;
            ("a coordinate beyond all floors", pairs, |e| {
                matches!(e, CalibrateError::OutOfRange { index: 3, .. })
            })
        }
        20 => {
            let mut pairs = spread(rng, 12);
            for p in pairs.iter_mut().step_by(2) {
                p.floor = mark(rng).into();
            }
            ("half of them wrong", pairs, |e| {
                matches!(
                    e,
                    CalibrateError::Inconsistent { .. } | CalibrateError::Mirrored
                )
            })
        }
        21 => {
            let two = [mark(rng), mark(rng)];
            let pairs = (0..count).map(|k| pair(rng, two[k % 2])).collect();
            ("two marks", pairs, |e| {
                matches!(e, CalibrateError::FewPlaces { .. })
            })
        }
        _ => {
            let mut pairs = spread(rng, count.max(8));
            for p in &mut pairs {
                (p.floor.x, p.floor.y) = (p.floor.y, p.floor.x);
            }
            ("x and y swapped", pairs, |e| *e == CalibrateError::Mirrored)
        }
    }
}

const KINDS: usize = 23;

#[test]
fn degenerate_sets_are_refused_with_the_reason() {
    let mut rng = Pcg64::seed_from_u64(20);
    for number in 0..KINDS {
        for trial in 0..40 {
            let (name, pairs, reason) = kind(number, &mut rng);
            match calibrate(&pairs, &CalibrateParams::default()) {
                Ok(found) => panic!(
                    "{name} ({number}, {trial}): accepted with outliers {:?}, {pairs:?}",
                    found.outliers
                ),
                Err(error) => {
                    assert!(reason(&error), "{name} ({number}, {trial}): {error}");
                    assert!(!error.to_string().contains('\n'));
                }
            }
        }
    }
}

#[test]
fn degenerate_sets_are_refused_for_other_noise_too() {
    for noise in [Noise::Floor, Noise::Both] {
        let mut rng = Pcg64::seed_from_u64(21);
        let params = CalibrateParams {
            noise,
            ..CalibrateParams::default()
        };
        for number in 0..KINDS {
            for _ in 0..10 {
                let (name, pairs, _) = kind(number, &mut rng);
                assert!(
                    calibrate(&pairs, &params).is_err(),
                    "{name} ({number}), {noise:?}: {pairs:?}"
                );
            }
        }
    }
}
