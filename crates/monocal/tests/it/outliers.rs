//! Pairs that do not fit are named, and only they.

use monocal::{CalibrateParams, Noise, calibrate};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::calibrate::{pairs_of, paper_marks};
use crate::pinhole::Pinhole;

#[test]
fn wrong_pairs_are_named_and_good_ones_are_not() {
    let truth = Pinhole::paper();
    let mut rng = Pcg64::seed_from_u64(7);
    for trial in 0..200 {
        let sigma = [0.05, 0.5, 2.0][trial % 3];
        let mut pairs = pairs_of(&truth, &paper_marks(), &mut rng, sigma, 0.0);
        let mut wrong: Vec<usize> = (0..trial % 8).map(|_| rng.random_range(0..26)).collect();
        wrong.sort_unstable();
        wrong.dedup();
        for &index in &wrong {
            let far = rng.random_range(25.0..200.0) * sigma.max(0.2);
            let angle: f64 = rng.random_range(0.0..std::f64::consts::TAU);
            pairs[index].pixel.u += far * angle.cos();
            pairs[index].pixel.v += far * angle.sin();
        }
        let found = calibrate(&pairs, &CalibrateParams::default()).unwrap();
        assert_eq!(found.outliers, wrong, "trial {trial}");
        assert_eq!(
            found.errors.iter().filter(|e| e.fits).count(),
            26 - wrong.len()
        );
        let measured = found.pixel_sigma_px / sigma;
        assert!(
            (0.5..1.6).contains(&measured),
            "trial {trial}: {measured} of the noise"
        );
    }
}

#[test]
fn good_sets_lose_no_pair() {
    let mut rng = Pcg64::seed_from_u64(8);
    let mut cut = 0;
    for trial in 0..600 {
        let noise = [Noise::Pixel, Noise::Floor, Noise::Both][trial % 3];
        let (pixel, floor) = match noise {
            Noise::Pixel => (0.5, 0.0),
            Noise::Floor => (0.0, 0.005),
            Noise::Both => (0.5, 0.005),
        };
        let count = rng.random_range(4..20);
        let marks: Vec<[f64; 2]> = (0..count)
            .map(|k| {
                [
                    2.0 + 1.3 * f64::from(k % 4) + rng.random_range(0.0..0.5),
                    rng.random_range(-1.6..1.6),
                ]
            })
            .collect();
        let pairs = pairs_of(&Pinhole::paper(), &marks, &mut rng, pixel, floor);
        let params = CalibrateParams {
            noise,
            ..CalibrateParams::default()
        };
        match calibrate(&pairs, &params) {
            Ok(found) => cut += usize::from(!found.outliers.is_empty()),
            // random marks may be nearly on a line
            Err(error) => assert!(count < 7, "{count} pairs: {error}"),
        }
    }
    assert!(cut <= 3, "{cut} of 600");
}

#[test]
fn one_wrong_pair_of_six_and_seven_is_named() {
    let truth = Pinhole::paper();
    let marks = [
        [2.0, -1.0],
        [2.2, 1.1],
        [3.4, 0.2],
        [5.0, -1.3],
        [5.5, 1.4],
        [4.0, -0.4],
        [2.9, 0.8],
    ];
    let mut rng = Pcg64::seed_from_u64(9);
    for count in [6, 7] {
        for wrong in 0..count {
            let mut pairs = pairs_of(&truth, &marks[..count], &mut rng, 0.5, 0.0);
            pairs[wrong].floor.y += 0.7;
            let found = calibrate(&pairs, &CalibrateParams::default());
            // where the others hang on it, it is refused rather than guessed
            match found {
                Ok(found) => assert_eq!(found.outliers, [wrong], "{count}"),
                Err(error) => assert!(error.to_string().contains("agree"), "{error}"),
            }
        }
    }
}
