use std::f64::consts::FRAC_PI_2;

use linefeat::{CannyParams, Segment, SegmentParams, canny, reference, segments};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::render::Edge;

/// The segments that lie on the edge, in a picture with this edge.
fn seen(edge: &Edge, width: u32, height: u32, seed: u64) -> Vec<Segment> {
    let picture = edge.render(width, height, seed);
    let high = 1.6 * edge.contrast.abs();
    let params = CannyParams {
        low: 0.5 * high,
        high,
        ..CannyParams::default()
    };
    let edges = canny(&picture, &params);
    let mut found = segments(&picture, &edges, &SegmentParams::default());
    found.retain(|segment| {
        let [rho, theta] = error(segment, edge);
        theta.abs() < 0.1
            && rho.abs() < 0.1 * f64::from(width)
            && middle_error(segment, edge).abs() < 2.0
    });
    found
}

/// (rho, theta) of the segment less those of the edge, across theta = 0 as well.
fn error(segment: &Segment, edge: &Edge) -> [f64; 2] {
    use std::f64::consts::PI;
    let turn = segment.theta - edge.theta;
    if turn > 0.5 * PI {
        [segment.rho + edge.rho, turn - PI]
    } else if turn < -0.5 * PI {
        [segment.rho + edge.rho, turn + PI]
    } else {
        [segment.rho - edge.rho, turn]
    }
}

/// Distance of the segment's middle from the edge.
fn middle_error(segment: &Segment, edge: &Edge) -> f64 {
    let middle = [0, 1].map(|i| 0.5 * (segment.start[i] + segment.end[i]));
    middle[0] * edge.theta.cos() + middle[1] * edge.theta.sin() - edge.rho
}

/// Squared Mahalanobis distance of the segment's (rho, theta) from the edge's.
fn distance(segment: &Segment, edge: &Edge) -> f64 {
    let [rho, theta] = error(segment, edge);
    let [[a, b], [_, d]] = segment.covariance;
    (d * rho * rho - 2.0 * b * rho * theta + a * theta * theta) / (a * d - b * b)
}

/// 95 % of the chi-square distribution with two degrees of freedom.
const REGION: f64 = 5.991_464_547;

#[test]
fn regions_of_95_percent_hold_the_truth() {
    let mut rng = Pcg64Mcg::seed_from_u64(20_260);
    let (mut inside, mut all, mut lines) = (0, 0, 0);
    let mut sums = [0.0; 2];
    for seed in 0..6000 {
        let (width, height) = (rng.random_range(40..140), rng.random_range(40..140));
        let edge = Edge::random(&mut rng, width, height);
        let found = seen(&edge, width, height, seed);
        lines += usize::from(!found.is_empty());
        for segment in &found {
            all += 1;
            inside += usize::from(distance(segment, &edge) < REGION);
            let shift = middle_error(segment, &edge);
            sums[0] += shift;
            sums[1] += shift * shift;
        }
    }
    let share = inside as f64 / all as f64;
    println!("{inside} of {all}");
    // the middle is off by nothing in the mean, up to four standard errors
    let mean = sums[0] / all as f64;
    let error = (sums[1] / all as f64).sqrt() / (all as f64).sqrt();
    assert!(
        mean.abs() < 4.0 * error,
        "{mean} px, standard error {error} px"
    );
    assert!(lines >= 5950, "{lines} of 6000 edges seen");
    assert!((0.94..=0.96).contains(&share), "{inside} of {all}");
}

/// Without noise the levels are whole numbers all the same; the regions must not shrink to nothing.
#[test]
fn regions_without_noise_hold_the_truth() {
    let mut rng = Pcg64Mcg::seed_from_u64(31);
    for seed in 0..300 {
        let mut edge = Edge::random(&mut rng, 90, 70);
        edge.noise = 1e-6;
        if seed % 3 == 0 {
            // along an axis or a diagonal, where all cuts are alike
            edge.theta = [0.0, FRAC_PI_2, 0.5 * FRAC_PI_2][seed as usize / 3 % 3];
            edge.rho = rng.random_range(20.0..50.0);
        }
        let found = seen(&edge, 90, 70, seed);
        assert!(!found.is_empty(), "{edge:?}");
        for segment in found {
            assert!((0.0..std::f64::consts::PI).contains(&segment.theta));
            // one rounding for a whole line: no Gaussian, so a wider region than that of 95 %
            assert!(distance(&segment, &edge) < 16.0, "{edge:?} {segment:?}");
            assert!(
                middle_error(&segment, &edge).abs() < 0.06,
                "{edge:?} {segment:?}"
            );
        }
    }
}

/// The mean error over many edges at one place between the pixels, for every place: no bias from the grid.
#[test]
fn places_between_pixels_are_alike() {
    for (step, theta) in (0..40).flat_map(|step| [0.0, 0.3, 0.785, FRAC_PI_2].map(|t| (step, t))) {
        let edge = Edge {
            rho: 30.0 * f64::cos(theta) + 30.0 * f64::sin(theta) + 0.025 * f64::from(step),
            theta,
            dark: 60.0,
            contrast: 150.0,
            blur: 0.7,
            noise: 0.6,
        };
        let found = seen(&edge, 64, 64, step as u64);
        assert_eq!(found.len(), 1, "{edge:?} {found:#?}");
        assert!(
            middle_error(&found[0], &edge).abs() < 0.005,
            "{edge:?} {:?}",
            found[0]
        );
    }
}

/// A dashed edge is one segment if its gaps may be bridged, else one for each dash.
#[test]
fn gaps_are_bridged() {
    let picture = image::GrayImage::from_fn(120, 40, |u, v| {
        let level: u32 = if u % 30 < 26 && v > 20 { 180 } else { 60 };
        image::Luma([(level + (u * 7 + v * 13) % 3) as u8])
    });
    let edges = canny(&picture, &CannyParams::default());
    let count = |gap_px| {
        let params = SegmentParams {
            gap_px,
            ..SegmentParams::default()
        };
        let found = segments(&picture, &edges, &params);
        let flat = found
            .iter()
            .filter(|s| (s.theta - FRAC_PI_2).abs() < 0.02 && s.start[1] < 22.0);
        flat.count()
    };
    assert_eq!((count(10), count(0)), (1, 4));
}

#[test]
fn any_picture_is_safe() {
    let mut rng = Pcg64Mcg::seed_from_u64(8);
    for kind in crate::pictures::KINDS {
        for side in [0, 1, 2, 7, 8, 9, 33, 64, 129] {
            let (width, height) = (side, rng.random_range(0..140));
            let picture = crate::pictures::picture(kind, rng.random_range(0..999), width, height);
            let edges = canny(
                &picture,
                &CannyParams {
                    low: 5.0,
                    high: 20.0,
                    ..CannyParams::default()
                },
            );
            let params = SegmentParams {
                length_px: 0,
                gap_px: u32::MAX,
                turn: 1.6,
            };
            for segment in segments(&picture, &edges, &params) {
                let numbers = [segment.rho, segment.theta, segment.contrast];
                let all = numbers.iter().chain(segment.covariance.as_flattened());
                assert!(all.into_iter().all(|n| n.is_finite()), "{kind} {segment:?}");
                let [[a, b], [_, d]] = segment.covariance;
                assert!(a > 0.0 && d > 0.0 && a * d > b * b, "{kind} {segment:?}");
            }
        }
    }
}

/// The line that was fitted is that of the definition, but for what whole numbers and one linear step lose.
#[test]
fn lines_are_the_twins() {
    let mut rng = Pcg64Mcg::seed_from_u64(9);
    let mut all = 0;
    for seed in 0..1000 {
        let (width, height) = (rng.random_range(40..140), rng.random_range(40..140));
        let mut edge = Edge::random(&mut rng, width, height);
        edge.noise = 0.5;
        let picture = edge.render(width, height, seed);
        for segment in seen(&edge, width, height, seed) {
            let [rho, theta] = reference::segment::line(&picture, &segment).expect("a line");
            let twin = Edge { rho, theta, ..edge };
            let [_, turn] = error(&segment, &twin);
            let shift = middle_error(&segment, &twin);
            let length = segment.length_px();
            assert!(
                shift.abs() < 0.01 && turn.abs() * length < 0.04,
                "{edge:?} {segment:?}: {shift} px, {turn} rad"
            );
            all += 1;
        }
    }
    assert!(all > 900, "{all}");
}

/// What holds for the segments of any picture.
#[test]
fn segments_obey_their_own_rules() {
    let mut rng = Pcg64Mcg::seed_from_u64(10);
    let mut all = 0;
    for kind in crate::pictures::KINDS {
        for side in [8, 63, 64, 65, 127, 128, 129] {
            let picture =
                crate::pictures::picture(kind, rng.random_range(0..999), side, 140 - side / 2);
            let params = SegmentParams::default();
            let of = |picture: &image::GrayImage| {
                segments(picture, &canny(picture, &CannyParams::default()), &params)
            };
            let found = of(&picture);
            for s in &found {
                let (sin, cos) = s.theta.sin_cos();
                for [u, v] in [s.start, s.end] {
                    assert!((u * cos + v * sin - s.rho).abs() < 1e-6, "{kind} {s:?}");
                    let inside = |x: f64, size: u32| x > 0.0 && x < f64::from(size);
                    assert!(
                        inside(u + 0.5, picture.width()) && inside(v + 0.5, picture.height()),
                        "{kind} {s:?}"
                    );
                }
                assert!(
                    f64::from(s.support_px) <= s.length_px() + 1.5,
                    "{kind} {s:?}"
                );
                assert!(2 * s.support_px >= params.length_px, "{kind} {s:?}");
            }
            // a negative has the same lines, the other way
            let mut negative = picture.clone();
            negative.iter_mut().for_each(|level| *level = 255 - *level);
            let turned = of(&negative).into_iter().map(|s| Segment {
                contrast: -s.contrast,
                ..s
            });
            assert_eq!(turned.collect::<Vec<_>>(), found, "{kind}");
            all += found.len();
        }
    }
    assert!(all > 60, "{all}");
}
