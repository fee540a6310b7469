//! Calibration against cameras whose truth is known.

use monocal::{CalibrateParams, CalibrateWarning, Calibration, Noise, Pair, PixelPoint, calibrate};
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use crate::pinhole::Pinhole;

/// 26 marks over the paper's region: 3.2 m wide, 4.5 m long, starting 2 m ahead.
pub(crate) fn paper_marks() -> Vec<[f64; 2]> {
    let mut marks = Vec::new();
    for row in 0..5 {
        for column in 0..5 {
            let x = 2.0 + 4.5 * f64::from(row) / 4.0;
            marks.push([x, -1.6 + 3.2 * f64::from(column) / 4.0]);
        }
    }
    marks.push([2.5625, 0.4]);
    marks
}

pub(crate) fn noisy(rng: &mut Pcg64, sigma: f64) -> [f64; 2] {
    let n: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(rng));
    n.map(|n| n * sigma)
}

/// Pairs of a camera with noise on pixels [px] and floor points [m].
pub(crate) fn pairs_of(
    camera: &Pinhole,
    marks: &[[f64; 2]],
    rng: &mut Pcg64,
    pixel_sigma: f64,
    floor_sigma: f64,
) -> Vec<Pair> {
    let pair = |mark: &[f64; 2]| {
        let [u, v] = camera.pixel(*mark).expect("by construction");
        let [du, dv] = noisy(rng, pixel_sigma);
        let [dx, dy] = noisy(rng, floor_sigma);
        Pair::new([u + du, v + dv], [mark[0] + dx, mark[1] + dy])
    };
    marks.iter().map(pair).collect()
}

/// A grid over the paper's region: all of it, or what the camera's picture shows of it.
fn grid(truth: &Pinhole, seen_only: bool) -> Vec<[f64; 2]> {
    let places = (0..10).flat_map(|row| (0..9).map(move |column| (row, column)));
    let points =
        places.map(|(row, column)| [2.0 + 0.5 * f64::from(row), -1.6 + 0.4 * f64::from(column)]);
    let shown = |point: &[f64; 2]| {
        let [u, v] = truth.pixel(*point).expect("by construction");
        !seen_only || (0.0..=479.0).contains(&u) && (0.0..=219.0).contains(&v)
    };
    points.filter(shown).collect()
}

/// Distances on the floor between where a calibration puts the pixels of the grid and where they are.
fn floor_errors(found: &Calibration, truth: &Pinhole, seen_only: bool) -> Vec<f64> {
    let error = |point: [f64; 2]| {
        let pixel = truth.pixel(point).expect("by construction");
        let seen = found.camera.floor_point(pixel.into());
        seen.expect("by construction").distance(point.into())
    };
    grid(truth, seen_only).into_iter().map(error).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// Slopes of a mark's pixel with the eight entries of the map from the floor, the ninth being 1, and with the
/// mark itself.
fn slopes(truth: &Pinhole, [x, y]: [f64; 2]) -> (SMatrix<f64, 2, 8>, Matrix2<f64>) {
    let inverse = Matrix3::from_fn(|r, c| truth.pixel_to_floor()[r][c]);
    let map = inverse.try_inverse().expect("by construction");
    let map = map / map[(2, 2)];
    let place = Vector3::new(x, y, 1.0);
    let [u, v, w] = (map * place).into();
    let (u, v) = (u / w, v / w);
    let mut by_map = SMatrix::<f64, 2, 8>::zeros();
    for (row, seen) in [u, v].into_iter().enumerate() {
        for k in 0..3 {
            by_map[(row, 3 * row + k)] = place[k] / w;
        }
        for k in 0..2 {
            by_map[(row, 6 + k)] = -seen * place[k] / w;
        }
    }
    let by_mark = Matrix2::from_fn(|r, c| (map[(r, c)] - [u, v][r] * map[(2, c)]) / w);
    (by_map, by_mark)
}

/// Errors as the most efficient unbiased estimator of the eight numbers would make them (Cramer and Rao):
/// mean, the largest of a calibration on average, the largest of 150 calibrations in half of the cases.
fn bound(truth: &Pinhole, sigma: f64, seen_only: bool) -> [f64; 3] {
    let mut information = SMatrix::<f64, 8, 8>::zeros();
    for mark in paper_marks() {
        let (by_map, _) = slopes(truth, mark);
        information += by_map.transpose() * by_map / (sigma * sigma);
    }
    let covariance = information.try_inverse().expect("by construction");
    let covariance = (covariance + covariance.transpose()) * 0.5;
    let lower = covariance.cholesky().expect("by construction").l();
    let to_floor: Vec<_> = grid(truth, seen_only)
        .into_iter()
        .map(|point| {
            let (by_map, by_mark) = slopes(truth, point);
            by_mark.try_inverse().expect("by construction") * by_map * lower
        })
        .collect();
    let mut rng = Pcg64::seed_from_u64(27);
    let (mut means, mut largests) = (Vec::new(), Vec::new());
    for _ in 0..150 * 41 {
        let draw = SMatrix::<f64, 8, 1>::from_fn(|_, _| StandardNormal.sample(&mut rng));
        let errors: Vec<f64> = to_floor.iter().map(|m| (m * draw).norm()).collect();
        means.push(mean(&errors));
        largests.push(largest(&errors));
    }
    let mut worst: Vec<f64> = largests.chunks(150).map(largest).collect();
    worst.sort_by(f64::total_cmp);
    [mean(&means), mean(&largests), worst[worst.len() / 2]]
}

#[test]
fn held_out_floor_errors_beat_the_paper_s_residuals() {
    let truth = Pinhole::paper();
    let mut rng = Pcg64::seed_from_u64(26);
    let [
        mut means,
        mut largests,
        mut all_means,
        mut all_largests,
        mut left_out,
    ] = [const { Vec::new() }; 5];
    for _ in 0..150 {
        let pairs = pairs_of(&truth, &paper_marks(), &mut rng, 0.5, 0.0);
        let found = calibrate(&pairs, &CalibrateParams::default()).unwrap();
        assert!(found.outliers.is_empty());
        left_out.push(found.held_out.unwrap().mean);
        let seen = floor_errors(&found, &truth, true);
        means.push(mean(&seen));
        largests.push(largest(&seen));
        let all = floor_errors(&found, &truth, false);
        all_means.push(mean(&all));
        all_largests.push(largest(&all));
    }
    for (what, seen_only, means, largests) in [
        ("seen", true, &means, &largests),
        ("whole region", false, &all_means, &all_largests),
    ] {
        let found = [mean(means), mean(largests), largest(largests)];
        let least = bound(&truth, 0.5, seen_only);
        println!(
            "{what}: mean {:.2} cm, largest of a calibration {:.2} cm on average, {:.2} cm in the worst of 150; no unbiased estimator is below {:.2}, {:.2}, {:.2}",
            100.0 * found[0],
            100.0 * found[1],
            100.0 * found[2],
            100.0 * least[0],
            100.0 * least[1],
            100.0 * least[2]
        );
        // as good as pairs like these allow; 150 calibrations scatter by some percent
        assert!(found[0] <= 1.1 * least[0] && found[1] <= 1.1 * least[1]);
    }
    println!(
        "pairs left out, with their own pixel noise: {:.2} cm",
        100.0 * mean(&left_out)
    );
    assert!(mean(&means) <= 0.0055 && mean(&largests) <= 0.017);
}

/// Share of floor points inside their 95 % ellipse.
fn share_inside(noise: Noise, pixel_sigma: f64, floor_sigma: f64, trials: u32) -> f64 {
    let truth = Pinhole::paper();
    let mut rng = Pcg64::seed_from_u64(95);
    let params = CalibrateParams {
        noise,
        ..CalibrateParams::default()
    };
    let inside = |_: &u32| {
        let pairs = pairs_of(&truth, &paper_marks(), &mut rng, pixel_sigma, floor_sigma);
        let found = calibrate(&pairs, &params).expect("by construction");
        let point = [rng.random_range(2.0..6.5), rng.random_range(-1.6..1.6)];
        let [u, v] = truth.pixel(point).expect("by construction");
        let [du, dv] = noisy(&mut rng, pixel_sigma);
        let variance = if pixel_sigma > 0.0 {
            found.camera.pixel_sigma_px.powi(2)
        } else {
            0.0
        };
        let estimate = found
            .camera
            .floor_estimate(
                PixelPoint::new(u + du, v + dv),
                [[variance, 0.0], [0.0, variance]],
            )
            .expect("by construction");
        let e = [estimate.point.x - point[0], estimate.point.y - point[1]];
        let [[a, b], [_, d]] = estimate.covariance;
        (d * e[0] * e[0] - 2.0 * b * e[0] * e[1] + a * e[1] * e[1]) / (a * d - b * b) <= 5.991
    };
    f64::from((0..trials).filter(inside).count() as u32) / f64::from(trials)
}

#[test]
fn ellipses_hold_the_truth_as_often_as_they_say() {
    let long = std::env::var_os("MOBOT_LONG").is_some();
    let trials = if long { 10_000 } else { 2_000 };
    for (noise, pixel_sigma, floor_sigma) in [
        (Noise::Pixel, 0.5, 0.0),
        (Noise::Floor, 0.0, 0.01),
        (Noise::Both, 0.5, 0.005),
    ] {
        let share = share_inside(noise, pixel_sigma, floor_sigma, trials);
        println!("{noise:?}: {share} of {trials}");
        assert!((0.94..=0.96).contains(&share), "{noise:?}: {share}");
    }
}

#[test]
fn few_pairs_are_warned_of() {
    let truth = Pinhole::paper();
    let mut rng = Pcg64::seed_from_u64(4);
    let marks = [[2.0, -1.0], [2.0, 1.0], [5.0, -1.0], [5.0, 1.0]];
    let found = calibrate(
        &pairs_of(&truth, &marks, &mut rng, 0.5, 0.0),
        &CalibrateParams::default(),
    )
    .unwrap();
    assert!(
        found
            .warnings
            .contains(&CalibrateWarning::FewPairs { found: 4 })
    );
    assert_eq!(found.held_out, None);
    assert!(found.residual.max < 1e-9);
}
