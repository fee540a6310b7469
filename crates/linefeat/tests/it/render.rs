//! Renders straight edges with known truth: exact pixel coverage, Gaussian blur, Gaussian noise, whole gray
//! levels. No part of the crate is used.

use image::{GrayImage, Luma};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;

/// A straight edge between two half-planes, `u cos(theta) + v sin(theta) = rho`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub(crate) rho: f64,
    pub(crate) theta: f64,
    /// Gray levels at negative distance, and how much more on the other side.
    pub(crate) dark: f64,
    pub(crate) contrast: f64,
    /// Standard deviation of the blur [px].
    pub(crate) blur: f64,
    /// Standard deviation of the noise [gray levels].
    pub(crate) noise: f64,
}

impl Edge {
    /// The mean of pixel (u, v): the step through the pixel's square and the blur.
    fn level(&self, u: u32, v: u32) -> f64 {
        let (sin, cos) = self.theta.sin_cos();
        let distance = f64::from(u) * cos + f64::from(v) * sin - self.rho;
        // the square seen along the edge is the convolution of two boxes
        let (a, b) = (cos.abs().max(1e-3), sin.abs().max(1e-3));
        let twice = |x: f64| twice_integrated(x / self.blur) * self.blur * self.blur;
        let part = twice(distance + 0.5 * (a + b))
            - twice(distance + 0.5 * (a - b))
            - twice(distance - 0.5 * (a - b))
            + twice(distance - 0.5 * (a + b));
        self.dark + self.contrast * part / (a * b)
    }

    pub(crate) fn render(&self, width: u32, height: u32, seed: u64) -> GrayImage {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let noise = Normal::new(0.0, self.noise).expect("a deviation");
        GrayImage::from_fn(width, height, |u, v| {
            Luma([(self.level(u, v) + noise.sample(&mut rng))
                .round()
                .clamp(0.0, 255.0) as u8])
        })
    }

    /// A line through the middle part of a picture.
    pub(crate) fn random(rng: &mut Pcg64Mcg, width: u32, height: u32) -> Self {
        let theta = rng.random_range(0.0..std::f64::consts::PI);
        let u = f64::from(width) * rng.random_range(0.3..0.7);
        let v = f64::from(height) * rng.random_range(0.3..0.7);
        let contrast = rng.random_range(25.0..110.0);
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        Self {
            rho: u * theta.cos() + v * theta.sin(),
            theta,
            dark: if sign > 0.0 { 60.0 } else { 190.0 },
            contrast: sign * contrast,
            blur: rng.random_range(0.5..1.3),
            noise: rng.random_range(0.8..4.0),
        }
    }
}

/// The normal distribution function integrated twice.
fn twice_integrated(z: f64) -> f64 {
    let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    0.5 * ((z * z + 1.0) * normal(z) + z * density)
}

/// The normal distribution function: continued fraction in the tails, power series between.
fn normal(z: f64) -> f64 {
    let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    if z.abs() > 5.0 {
        let x = z.abs();
        let tail = density / (x + 1.0 / (x + 2.0 / (x + 3.0 / (x + 4.0 / (x + 5.0 / x)))));
        return if z > 0.0 { 1.0 - tail } else { tail };
    }
    let (mut term, mut sum, mut k) = (z, z, 1.0);
    while f64::abs(term) > 1e-17 * f64::abs(sum) {
        k += 2.0;
        term *= z * z / k;
        sum += term;
    }
    0.5 + density * sum
}
