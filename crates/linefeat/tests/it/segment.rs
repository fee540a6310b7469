use linefeat::{CannyParams, Segment, SegmentParams, canny, segments};
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

/// Squared Mahalanobis distance. If theta wrapped around, the covariance goes with the segment's own signs.
fn distance(segment: &Segment, edge: &Edge) -> f64 {
    let flipped = (segment.theta - edge.theta).abs() > 0.5 * std::f64::consts::PI;
    let [rho, theta] = error(segment, edge);
    let _ = flipped;
    let [[a, b], [_, d]] = segment.covariance;
    (d * rho * rho - 2.0 * b * rho * theta + a * theta * theta) / (a * d - b * b)
}

/// 95 % of the chi-square distribution with two degrees of freedom.
const REGION: f64 = 5.991_464_547;

#[test]
fn regions_of_95_percent_hold_the_truth() {
    let mut rng = Pcg64Mcg::seed_from_u64(77);
    let (mut inside, mut all, mut lines) = (0, 0, 0);
    let mut sums = [0.0; 4];
    for seed in 0..6000 {
        let (width, height) = (rng.random_range(40..140), rng.random_range(40..140));
        let edge = Edge::random(&mut rng, width, height);
        let found = seen(&edge, width, height, seed + 900_000);
        lines += usize::from(!found.is_empty());
        for segment in &found {
            all += 1;
            println!(
                "DBG {} {} {} {} {} {} {} {} {}",
                edge.theta,
                edge.contrast,
                edge.blur,
                edge.noise,
                segment.support_px,
                middle_error(segment, &edge),
                error(segment, &edge)[1],
                distance(segment, &edge),
                segment.covariance[1][1].sqrt()
            );
            inside += usize::from(distance(segment, &edge) < REGION);
            let [_, theta] = error(segment, &edge);
            let shift = middle_error(segment, &edge);
            sums[0] += shift;
            sums[1] += theta;
            sums[2] += shift * shift;
            sums[3] += theta * theta;
        }
    }
    let share = inside as f64 / all as f64;
    println!(
        "{inside} of {all}: {share}; {lines}; {:?}",
        sums.map(|s| s / all as f64)
    );
    assert!((0.94..=0.96).contains(&share), "{inside} of {all}");
}
