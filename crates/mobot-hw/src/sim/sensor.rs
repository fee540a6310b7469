//! What lens and sensor do to the light: vignetting, blur, exposure, noise, tone.

use image::GrayImage;

use super::lens::CameraModel;
use crate::dice::Dice;
use crate::real::{exp, pow};

/// The qualities of a simulated picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Light of 1 becomes this share of full scale, above 0. More makes brighter, and burns out.
    pub exposure: f64,
    /// The grey level is proportional to light to the power of 1 / gamma, above 0. Default 1: edges stay
    /// where their geometry is; 2.2 shifts them towards the dark side by some hundredths of a pixel.
    pub gamma: f64,
    /// Standard deviation of the noise [grey levels], 0 or more.
    pub noise: f64,
    /// Standard deviation of the blur [px], 0 to 16.
    pub blur_px: f64,
    /// Share of light that the corners of the picture lose, 0 to 1.
    pub vignetting: f64,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            exposure: 1.25,
            gamma: 1.0,
            noise: 2.0,
            blur_px: 0.6,
            vignetting: 0.15,
        }
    }
}

#[derive(Debug)]
pub(crate) struct Sensor {
    width: usize,
    height: usize,
    /// Exposure times vignetting, a factor a pixel.
    gain: Vec<f32>,
    /// Half of the blur's kernel, centre first.
    kernel: Vec<f32>,
    noise: f32,
    /// Grey level over light 0..1.
    tone: Option<Vec<f32>>,
    scratch: Vec<f32>,
}

impl Sensor {
    pub(crate) fn new(camera: &CameraModel, look: Look) -> Self {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let (mx, my) = ((width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0);
        let corner = (mx * mx + my * my).max(1.0);
        let gain = (0..width * height).map(|i| {
            let (x, y) = ((i % width) as f64 - mx, (i / width) as f64 - my);
            let lost = look.vignetting * (x * x + y * y) / corner;
            (255.0 * look.exposure * (1.0 - lost)) as f32
        });
        let tone = ((look.gamma - 1.0).abs() > 1e-9).then(|| {
            (0..=4096)
                .map(|i| (255.0 * pow(f64::from(i) / 4096.0, 1.0 / look.gamma)) as f32)
                .collect()
        });
        Self {
            width,
            height,
            gain: gain.collect(),
            kernel: kernel(look.blur_px.clamp(0.0, 16.0)),
            noise: look.noise as f32,
            tone,
            scratch: vec![0.0; width * height],
        }
    }

    /// Turns light into a picture; the light is used up.
    pub(crate) fn expose(&mut self, light: &mut [f32], seed: u64) -> GrayImage {
        for (value, gain) in light.iter_mut().zip(&self.gain) {
            *value *= gain;
        }
        if self.kernel.len() > 1 {
            blur_rows(light, &mut self.scratch, self.width, &self.kernel);
            blur_columns(&self.scratch, light, self.width, &self.kernel);
        }
        let mut dice = Dice::new(seed);
        let pixels = light.iter().map(|value| {
            let toned = self.tone.as_ref().map_or(*value, |t| through(t, *value));
            (toned + self.noise * normal(&mut dice) + 0.5).clamp(0.0, 255.0) as u8
        });
        GrayImage::from_raw(self.width as u32, self.height as u32, pixels.collect())
            .expect("one grey level a pixel")
    }
}

fn kernel(sigma: f64) -> Vec<f32> {
    if sigma < 0.05 {
        return vec![1.0];
    }
    let radius = (3.0 * sigma).ceil() as i32;
    // the Gaussian over the whole width of a tap
    let tap = |i: i32| -> f64 {
        let at = |k: i32| {
            let x = f64::from(i) + (f64::from(k) + 0.5) / 16.0 - 0.5;
            exp(-x * x / (2.0 * sigma * sigma))
        };
        (0..16).map(at).sum()
    };
    let total: f64 = (-radius..=radius).map(tap).sum();
    (0..=radius).map(|i| (tap(i) / total) as f32).collect()
}

fn blur_rows(from: &[f32], to: &mut [f32], width: usize, kernel: &[f32]) {
    let reach = kernel.len() - 1;
    let mut padded = vec![0.0_f32; width + 2 * reach];
    for (from, to) in from.chunks_exact(width).zip(to.chunks_exact_mut(width)) {
        padded[..reach].fill(from[0]);
        padded[reach..reach + width].copy_from_slice(from);
        padded[reach + width..].fill(from[width - 1]);
        for (x, value) in to.iter_mut().enumerate() {
            let mut sum = kernel[0] * padded[x + reach];
            for (k, weight) in kernel.iter().enumerate().skip(1) {
                sum += weight * (padded[x + reach - k] + padded[x + reach + k]);
            }
            *value = sum;
        }
    }
}

fn blur_columns(from: &[f32], to: &mut [f32], width: usize, kernel: &[f32]) {
    let rows = from.len() / width;
    let row = |r: usize| &from[r * width..(r + 1) * width];
    for (r, to) in to.chunks_exact_mut(width).enumerate() {
        for (value, middle) in to.iter_mut().zip(row(r)) {
            *value = kernel[0] * middle;
        }
        for (k, weight) in kernel.iter().enumerate().skip(1) {
            let (above, below) = (row(r.saturating_sub(k)), row((r + k).min(rows - 1)));
            for ((value, a), b) in to.iter_mut().zip(above).zip(below) {
                *value += weight * (a + b);
            }
        }
    }
}

/// A grey level off the tone curve.
fn through(tone: &[f32], value: f32) -> f32 {
    let place = (value / 255.0).clamp(0.0, 1.0) * 4096.0;
    let low = (place as usize).min(4095);
    tone[low] + (tone[low + 1] - tone[low]) * (place - low as f32)
}

/// Nearly normal, mean 0, standard deviation 1, never past 3.5: the sum of four even numbers.
fn normal(dice: &mut Dice) -> f32 {
    let z = dice.next();
    let sum = (z & 0xFFFF) + (z >> 16 & 0xFFFF) + (z >> 32 & 0xFFFF) + (z >> 48);
    // four even numbers of 0..65536 have the variance 4 * 65536^2 / 12
    (sum as f32 - 131_070.0) / 37_837.2
}
