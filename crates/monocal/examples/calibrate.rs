//! Makes up a camera 1 m above a floor, reads marks off its picture with half a pixel of noise, calibrates it,
//! and prints error bars beside errors. `cargo run --example calibrate`

#![expect(clippy::print_stdout, reason = "an example speaks to the terminal")]

use monocal::{CalibrateParams, Pair, PixelPoint, calibrate};

/// 24 degrees down, 450 px of focal length, 480 x 220 px.
fn pixel_of([x, y]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = 24_f64.to_radians().sin_cos();
    let depth = x * cos + sin;
    [
        239.5 - 450.0 * y / depth,
        109.5 + 450.0 * (cos - x * sin) / depth,
    ]
}

/// Noise of about the given sigma from a fixed sequence.
fn noise(state: &mut u64, sigma: f64) -> f64 {
    let mut sum = 0.0;
    for _ in 0..12 {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        sum += (*state >> 11) as f64 / (1_u64 << 53) as f64;
    }
    (sum - 6.0) * sigma
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut state = 1999;
    let mut pairs = Vec::new();
    for x in [2.0, 3.0, 4.5, 6.0] {
        for y in [-1.0, -0.4, 0.4, 1.0] {
            let [u, v] = pixel_of([x, y]);
            let pixel = [u + noise(&mut state, 0.5), v + noise(&mut state, 0.5)];
            pairs.push(Pair::new(pixel, [x, y]));
        }
    }
    // a slip of the ruler
    pairs[9].floor.x += 0.5;

    let params = CalibrateParams {
        image_size: Some([480, 220]),
        ..CalibrateParams::default()
    };
    let found = calibrate(&pairs, &params)?;
    println!(
        "pairs that do not fit: {:?}; pixels were read to {:.2} px",
        found.outliers, found.pixel_sigma_px
    );
    let mounted = found.camera.geometry()?;
    println!(
        "height {:.3} +- {:.3} m, tilt {:.1} +- {:.1} degrees, focal length {:.0} +- {:.0} px",
        mounted.height,
        mounted.height_sigma,
        mounted.tilt.to_degrees(),
        mounted.tilt_sigma.to_degrees(),
        mounted.focal_px,
        mounted.focal_sigma_px
    );
    let variance = found.camera.pixel_sigma_px.powi(2);
    for x in [2.0, 3.0, 4.0, 5.0, 6.0] {
        let [u, v] = pixel_of([x, 0.5]);
        let seen = PixelPoint::new(u + noise(&mut state, 0.5), v + noise(&mut state, 0.5));
        let Some(floor) = found
            .camera
            .floor_estimate(seen, [[variance, 0.0], [0.0, variance]])
        else {
            continue;
        };
        println!(
            "{x} m ahead: off by {:+.3} m, one sigma {:.3} m; a pixel covers {:.3} m",
            floor.point.x - x,
            floor.covariance[0][0].sqrt(),
            floor.resolution.map_or(f64::NAN, |r| r.dx)
        );
    }
    Ok(())
}
