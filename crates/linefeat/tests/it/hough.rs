use std::f64::consts::PI;

use linefeat::{
    CannyParams, EdgeMap, Hough, HoughError, HoughParams, Line, Voting, canny, hough, reference,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::pictures::{KINDS, picture};

const SIDES: [u32; 8] = [0, 1, 63, 64, 65, 127, 128, 129];

fn edges(rng: &mut Pcg64Mcg) -> EdgeMap {
    let kind = KINDS[rng.random_range(0..KINDS.len())];
    let side = |rng: &mut Pcg64Mcg| SIDES[rng.random_range(0..SIDES.len())];
    let (width, height) = (side(rng), side(rng));
    let picture = picture(kind, rng.random_range(0..1000), width, height);
    canny(&picture, &CannyParams::default())
}

fn params(rng: &mut Pcg64Mcg) -> HoughParams {
    let spread = rng.random_range(0.0..0.4);
    HoughParams {
        rho_px: [0.1, 0.5, 0.9, 1.0, 1.7, 30.0][rng.random_range(0..6)],
        theta: PI / f64::from([1, 2, 3, 31, 32, 33, 180, 360][rng.random_range(0..8)]),
        voting: if rng.random_bool(0.5) {
            Voting::AllDirections
        } else {
            Voting::NearGradient { spread }
        },
        votes: rng.random_range(1..40),
        ..HoughParams::default()
    }
}

#[test]
fn votes_are_those_of_the_definition() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let mut transform = Hough::new();
    let mut lines = Vec::new();
    for _ in 0..400 {
        let (edges, params) = (edges(&mut rng), params(&mut rng));
        transform.detect(&edges, &params, &mut lines).expect("bins");
        let votes = transform.accumulator();
        let expected = reference::hough::votes(&edges, &params);
        assert_eq!(votes.angles(), expected.len());
        for (k, row) in expected.iter().enumerate() {
            assert_eq!(votes.row(k), row, "angle {k}, {params:?}");
        }
    }
}

/// As many pixels below each border between bins as lie below it in f64, give or take those within
/// 0.001 bins of it.
#[test]
fn bins_are_equally_wide() {
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let mut transform = Hough::new();
    let params = HoughParams {
        voting: Voting::AllDirections,
        ..HoughParams::default()
    };
    for _ in 0..20 {
        let edges = edges(&mut rng);
        transform
            .detect(&edges, &params, &mut Vec::new())
            .expect("bins");
        let votes = transform.accumulator();
        for k in 0..votes.angles() {
            let (sin, cos) = (k as f64 * PI / votes.angles() as f64).sin_cos();
            let mut rhos: Vec<f64> = edges
                .pixels()
                .iter()
                .map(|pixel| f64::from(pixel.u) * cos + f64::from(pixel.v) * sin)
                .collect();
            rhos.sort_by(f64::total_cmp);
            let mut below = 0;
            for (r, &votes) in votes.row(k).iter().enumerate() {
                let border = r as f64 - transform.accumulator().reach() as f64 - 0.5;
                let least = rhos.partition_point(|&rho| rho < border - 1e-3);
                let most = rhos.partition_point(|&rho| rho < border + 1e-3);
                assert!(
                    (least..=most).contains(&below),
                    "angle {k}, border {border}"
                );
                below += usize::from(votes);
            }
            assert_eq!(below, rhos.len());
        }
    }
}

/// A bright half-plane's edge map.
fn half_plane(theta: f64, rho: f64) -> EdgeMap {
    let picture = image::GrayImage::from_fn(200, 160, |u, v| {
        let inside = f64::from(u) * theta.cos() + f64::from(v) * theta.sin() - rho;
        image::Luma([(60.0 + 120.0 * (inside + 0.5).clamp(0.0, 1.0)) as u8])
    });
    canny(&picture, &CannyParams::default())
}

fn error(line: &Line, theta: f64, rho: f64) -> [f64; 2] {
    let turn = line.theta - theta;
    if turn.abs() < 0.5 * PI {
        [turn, line.rho - rho]
    } else {
        [turn - PI * turn.signum(), line.rho + rho]
    }
}

#[test]
fn one_edge_is_one_line_at_every_angle() {
    for voting in [Voting::AllDirections, HoughParams::default().voting] {
        let params = HoughParams {
            voting,
            ..HoughParams::default()
        };
        for step in -8..368 {
            let theta = 0.5f64.to_radians() * f64::from(step) + 0.001;
            let rho = 100.0 * theta.cos() + 80.0 * theta.sin() + 0.3;
            let lines = hough(&half_plane(theta, rho), &params).expect("bins");
            assert_eq!(lines.len(), 1, "{step} half degrees, {voting:?}: {lines:?}");
            let [turn, _] = error(&lines[0], theta, rho);
            assert!((0.0..PI).contains(&lines[0].theta));
            assert!(
                turn.abs() < 0.5f64.to_radians(),
                "{step}: {}",
                turn.to_degrees()
            );
        }
    }
}

#[test]
fn bins_without_width_or_bound_are_refused() {
    let edges = EdgeMap::new();
    let base = HoughParams::default();
    for (rho_px, theta) in [
        (0.0, 0.1),
        (-1.0, 0.1),
        (f64::NAN, 0.1),
        (1.0, 0.0),
        (1.0, f64::NAN),
        (1.0, 4.0),
    ] {
        let result = hough(
            &edges,
            &HoughParams {
                rho_px,
                theta,
                ..base
            },
        );
        assert!(
            matches!(result, Err(HoughError::Width { .. })),
            "{rho_px} {theta}"
        );
    }
    let result = hough(
        &edges,
        &HoughParams {
            theta: 1e-300,
            ..base
        },
    );
    assert!(matches!(result, Err(HoughError::TooFine { .. })));
    assert!(hough(&edges, &base).expect("bins").is_empty());
}
