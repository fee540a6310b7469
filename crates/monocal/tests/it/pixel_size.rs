//! The predicted size of a pixel on the floor against the size measured between marks found in rendered frames.
//!
//! The frames are made by following rays of the pinhole camera, sixteen a pixel, with noise and a falloff of light.

use monocal::{CalibrateParams, Pair, PixelPoint, calibrate};
use rand::SeedableRng as _;
use rand_pcg::Pcg64;

use crate::calibrate::noisy;
use crate::pinhole::Pinhole;

const WIDTH: usize = 480;
const HEIGHT: usize = 220;
/// Of a mark, a white disc [m].
const RADIUS: f64 = 0.06;

/// Gray values of a floor with marks on it.
fn render(camera: &Pinhole, marks: &[[f64; 2]], rng: &mut Pcg64) -> Vec<f64> {
    let mut frame = vec![0.0; WIDTH * HEIGHT];
    for (k, value) in frame.iter_mut().enumerate() {
        let (u, v) = ((k % WIDTH) as f64, (k / WIDTH) as f64);
        let mut sum = 0.0;
        for sub in 0..16 {
            let (du, dv) = (f64::from(sub % 4), f64::from(sub / 4));
            let seen = camera.floor([u + (du - 1.5) / 4.0, v + (dv - 1.5) / 4.0]);
            let white = seen
                .is_some_and(|[x, y]| marks.iter().any(|m| (x - m[0]).hypot(y - m[1]) < RADIUS));
            sum += if white { 200.0 } else { 70.0 };
        }
        let falloff = 1.0 - 0.3 * ((u - 240.0) / 300.0).powi(2);
        *value = (sum / 16.0 * falloff + noisy(rng, 2.0)[0])
            .round()
            .clamp(0.0, 255.0);
    }
    frame
}

/// The centroid of brightness about where a mark is about.
fn found(frame: &[f64], about: [f64; 2], reach: [i64; 2]) -> [f64; 2] {
    let mut center = about;
    for _ in 0..3 {
        let [mut weight, mut u, mut v] = [0.0; 3];
        for row in -reach[1]..=reach[1] {
            for column in -reach[0]..=reach[0] {
                let (c, r) = (
                    center[0].round() as i64 + column,
                    center[1].round() as i64 + row,
                );
                if (0..WIDTH as i64).contains(&c) && (0..HEIGHT as i64).contains(&r) {
                    let bright = (frame[r as usize * WIDTH + c as usize] - 85.0).max(0.0);
                    weight += bright;
                    u += bright * c as f64;
                    v += bright * r as f64;
                }
            }
        }
        center = [u / weight, v / weight];
    }
    center
}

/// Where marks are found in a frame of them.
fn detected(camera: &Pinhole, marks: &[[f64; 2]], rng: &mut Pcg64) -> Vec<[f64; 2]> {
    let frame = render(camera, marks, rng);
    let of = |mark: &[f64; 2]| {
        let about = camera.pixel(*mark).expect("before the camera");
        let far = camera.pixel([mark[0] + RADIUS, mark[1]]).unwrap_or(about);
        let side = camera.pixel([mark[0], mark[1] + RADIUS]).unwrap_or(about);
        let reach =
            [(about[0] - side[0]).abs(), (about[1] - far[1]).abs()].map(|r| r.ceil() as i64 + 2);
        found(&frame, [about[0] + 0.7, about[1] - 0.6], reach)
    };
    marks.iter().map(of).collect()
}

#[test]
fn pixels_are_as_large_as_they_are_predicted_to_be() {
    let camera = Pinhole::paper();
    let mut rng = Pcg64::seed_from_u64(3);
    let mut marks = Vec::new();
    for x in [1.6_f64, 2.0, 2.6, 3.4, 4.6] {
        for side in [-0.9, -0.45, 0.0, 0.45, 0.9] {
            marks.push([x, side * (0.44 * x).min(1.5)]);
        }
    }
    let pixels = detected(&camera, &marks, &mut rng);
    let pairs: Vec<Pair> = pixels
        .iter()
        .zip(&marks)
        .map(|(p, m)| Pair::new(*p, *m))
        .collect();
    let calibration = calibrate(&pairs, &CalibrateParams::default()).unwrap();
    assert!(calibration.outliers.is_empty());
    let homography = calibration.camera.homography;
    let [mut ahead, mut across] = [Vec::new(), Vec::new()];
    for x in [2.0, 2.5, 3.0, 3.5, 4.0] {
        for y in [-0.6, 0.0, 0.6] {
            // four marks around a place, far enough apart to be told apart
            let half = 0.1 + 0.05 * x;
            let around = [[x - half, y], [x + half, y], [x, y - half], [x, y + half]];
            let [near, far, right, left] = detected(&camera, &around, &mut rng)[..] else {
                panic!()
            };
            let mean = |from: [f64; 2], to: [f64; 2], size: &dyn Fn(PixelPoint) -> f64| {
                let at = |k: i32| {
                    let t = (f64::from(k) + 0.5) / 32.0;
                    size(PixelPoint::new(
                        from[0] + t * (to[0] - from[0]),
                        from[1] + t * (to[1] - from[1]),
                    ))
                };
                (0..32).map(at).sum::<f64>() / 32.0
            };
            // a resolution is that from its pixel to the next: centred, half a pixel earlier
            let dx = |p: PixelPoint| {
                homography
                    .resolution(PixelPoint::new(p.u, p.v - 0.5))
                    .unwrap()
                    .dx
            };
            let dy = |p: PixelPoint| {
                homography
                    .resolution(PixelPoint::new(p.u - 0.5, p.v))
                    .unwrap()
                    .dy
            };
            let measured = 2.0 * half / (near[1] - far[1]);
            ahead.push((mean(far, near, &dx) - measured).abs());
            let measured = 2.0 * half / (right[0] - left[0]);
            across.push((mean(left, right, &dy) - measured).abs());
        }
    }
    let mean = |errors: &[f64]| 1000.0 * errors.iter().sum::<f64>() / errors.len() as f64;
    println!(
        "marks found to {:.3} px; pixel size off by {:.3} mm ahead, {:.3} mm across (mean of {})",
        calibration.pixel_sigma_px,
        mean(&ahead),
        mean(&across),
        ahead.len()
    );
    assert!(
        mean(&ahead) <= 0.3 && mean(&across) <= 0.3,
        "{ahead:?} {across:?}"
    );
}
