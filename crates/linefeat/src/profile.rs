//! Fits a line to gray levels across an edge.
//!
//! Where a row or column of the picture (a cut) crosses an edge at p, the mean of the gray-level differences'
//! places, weighted by W, is p: `sum_k W(k + 1/2 - p) (I[k + 1] - I[k]) = 0` for an odd W. It needs no gray
//! levels of the two sides, and if W is smooth it has no bias from where p lies between the pixels (below
//! 0.0003 px for edges blurred by 0.6 px or more). Cuts share no pixel, so the noise of one is independent
//! of that of the others.

use std::sync::OnceLock;

use image::GrayImage;

use crate::Segment;
use crate::follow::Path;

/// Pixels of a cut.
const TAPS: usize = 8;
/// Places between two pixels at which weights are known.
const PHASES: usize = 64;
/// Half the width of W [px].
const REACH: f64 = 3.5;
/// Weights are whole numbers of this.
const ONE: f64 = 8192.0;
/// Cuts show the edge where the mean slope of this many on either side ..
const AROUND: usize = 2;
/// .. is this part of the mean of all. (One alone is so noisy that those above are no fair sample.)
const FAINT: f64 = 0.3;
/// Farthest that a cut may place the edge from the line [px], at first and at least.
const NEAR: f64 = 1.5;
/// The same in standard deviations.
const NEAR_SIGMAS: f64 = 4.0;
/// Cuts that the first line is fitted to: the second only needs to begin near.
const ROUGH: usize = 16;
/// So many cuts at either end of a line are left out ..
const END_CUTS: usize = 4;
/// .. if it has this times as many.
const TRIMMED: usize = 6;
/// So many cuts at least make a line.
const FEWEST: usize = 6;

/// Weights of the pixels of a cut at one phase.
#[derive(Clone, Copy, Debug)]
struct Weights {
    /// The sum is 0 at the edge.
    place: [i32; TAPS],
    /// The change of that sum with p: the edge's height.
    slope: [i32; TAPS],
}

/// One cut's measurement, in whole numbers: their sums are exact and need no order.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// Step along the line.
    t: i32,
    /// Where the sums were taken [1 / PHASES px].
    at: i32,
    /// Both sums, [`ONE`] times.
    place: i32,
    slope: i32,
}

/// Buffers of [`Profiles::fit`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Profiles {
    cuts: Vec<Cut>,
    /// Sums of the slopes before each cut.
    slopes: Vec<i64>,
}

/// Tukey's biweight.
fn window(t: f64) -> f64 {
    let inside = (1.0 - (t / REACH).powi(2)).max(0.0);
    t * inside * inside
}

/// Derivative of [`window`].
fn window_slope(t: f64) -> f64 {
    let square = (t / REACH).powi(2);
    (1.0 - square).max(0.0) * (1.0 - 5.0 * square)
}

/// Weights by phase. The pixels are those from 3 before to 4 behind the whole part of p.
fn weights() -> &'static [Weights; PHASES] {
    static WEIGHTS: OnceLock<[Weights; PHASES]> = OnceLock::new();
    WEIGHTS.get_or_init(|| {
        std::array::from_fn(|phase| {
            let p = phase as f64 / PHASES as f64;
            // W between pixel i - 1 and pixel i
            let between = |i: usize, w: fn(f64) -> f64| {
                let inner = (1..TAPS).contains(&i);
                if inner {
                    (ONE * w(i as f64 - 3.5 - p)).round() as i32
                } else {
                    0
                }
            };
            let pixels =
                |w: fn(f64) -> f64| std::array::from_fn(|i| between(i, w) - between(i + 1, w));
            Weights {
                place: pixels(window),
                slope: pixels(window_slope),
            }
        })
    })
}

/// A line by least squares: value at the middle step, change a step.
#[derive(Clone, Copy, Debug)]
struct Fit {
    count: f64,
    middle: f64,
    value: f64,
    slope: f64,
    /// Sum of squared steps from the middle.
    spread: f64,
}

impl Fit {
    fn at(&self, t: f64) -> f64 {
        self.value + self.slope * (t - self.middle)
    }

    /// Distance of a cut's place from the line.
    #[inline(always)]
    fn residual(&self, cut: &Cut, per_height: f64) -> f64 {
        let place = f64::from(cut.at) / PHASES as f64 + f64::from(cut.place) * per_height;
        place - self.at(f64::from(cut.t))
    }
}

impl Profiles {
    /// Makes room for the longest line of a picture.
    pub(crate) fn reserve(&mut self, (width, height): (u32, u32)) {
        let steps = width.max(height) as usize;
        self.cuts.clear();
        self.cuts.reserve(steps);
        self.slopes.clear();
        self.slopes.reserve(steps + 1);
    }

    /// The segment along `path`, if at least half of `least` cuts show its edge.
    pub(crate) fn fit(&mut self, image: &GrayImage, path: &Path, least: u32) -> Option<Segment> {
        // edge pixels may lie the best part of a pixel beside a diagonal, where the sums are not linear yet
        let every = (path.extent() as usize / ROUGH).max(1);
        let (mut start, mut near) = ([path.offset, path.slope], NEAR);
        for _ in 0..2 {
            let height = self.pass(image, path, start, every, near)?;
            let line = self.line(height);
            let deviation = (self.squares(&line, height) / (line.count - 2.0)).sqrt();
            (start, near) = (
                [line.at(0.0), line.slope],
                NEAR.max(NEAR_SIGMAS * deviation),
            );
        }
        let height = self.pass(image, path, start, 1, near)?;
        if self.cuts.len() < (least as usize).div_ceil(2) {
            return None;
        }
        let ends = self.trim();
        let fit = self.line(height);
        let variance = self.variance(&fit, height);
        self.segment(image, path, ends, &fit, variance)
    }

    /// Leaves out the cuts at either end, where another edge begins and its blur moves this one; the steps of
    /// the first and the last cut before.
    fn trim(&mut self) -> [i32; 2] {
        let ends = [self.cuts[0].t, self.cuts[self.cuts.len() - 1].t];
        if self.cuts.len() >= TRIMMED * END_CUTS {
            self.cuts.drain(..END_CUTS);
            self.cuts.truncate(self.cuts.len() - END_CUTS);
        }
        ends
    }

    /// Measures every so many cuts about a line (offset, slope) and keeps those that show the edge near it;
    /// the mean slope of their sums.
    fn pass(
        &mut self,
        image: &GrayImage,
        path: &Path,
        line: [f64; 2],
        every: usize,
        near: f64,
    ) -> Option<f64> {
        let cuts = &mut self.cuts;
        pulp::Arch::new().dispatch(Measure {
            image,
            path,
            line,
            every,
            cuts,
        });
        let count = self.cuts.len();
        if count < FEWEST {
            return None;
        }
        self.slopes.clear();
        self.slopes.push(0);
        let mut sum = 0;
        self.slopes.extend(self.cuts.iter().map(|cut| {
            sum += i64::from(cut.slope);
            sum
        }));
        let mean = sum as f64 / count as f64;
        let mut kept = 0;
        for i in 0..count {
            let (first, end) = (i.saturating_sub(AROUND), (i + AROUND + 1).min(count));
            let around = (self.slopes[end] - self.slopes[first]) as f64;
            let cut = self.cuts[i];
            let shift = f64::from(cut.at) / PHASES as f64 - line[0] - line[1] * f64::from(cut.t);
            let shows = around > FAINT * mean * (end - first) as f64;
            let is_near = (shift * mean + f64::from(cut.place)).abs() < near * mean;
            self.cuts[kept] = cut;
            kept += usize::from(shows & is_near);
        }
        self.cuts.truncate(kept);
        let sum: i64 = self.cuts.iter().map(|cut| i64::from(cut.slope)).sum();
        (kept >= FEWEST && sum > 0).then(|| sum as f64 / kept as f64)
    }

    fn line(&self, height: f64) -> Fit {
        let base = self.cuts[0];
        let mut sums = [0i64; 6];
        for cut in &self.cuts {
            let (t, at) = (i64::from(cut.t - base.t), i64::from(cut.at - base.at));
            let place = i64::from(cut.place);
            for (sum, term) in sums
                .iter_mut()
                .zip([t, t * t, at, t * at, place, t * place])
            {
                *sum += term;
            }
        }
        let [t, tt, at, t_at, place, t_place] = sums.map(|sum| sum as f64);
        let count = self.cuts.len() as f64;
        let spread = tt - t * t / count;
        let y = at / PHASES as f64 + place / height;
        let ty = t_at / PHASES as f64 + t_place / height;
        Fit {
            count,
            middle: f64::from(base.t) + t / count,
            value: f64::from(base.at) / PHASES as f64 + y / count,
            slope: (ty - t * y / count) / spread,
            spread,
        }
    }

    /// Sum of squared residuals.
    fn squares(&self, fit: &Fit, height: f64) -> f64 {
        let square = |cut: &Cut| fit.residual(cut, 1.0 / height).powi(2);
        self.cuts.iter().map(square).sum()
    }

    /// Variances of a cut's place: the part that is independent from cut to cut, and the part that all share.
    fn variance(&self, fit: &Fit, height: f64) -> [f64; 2] {
        let (mut sum, mut lagged, mut previous) = (0.0, 0.0, 0.0);
        for cut in &self.cuts {
            let residual = fit.residual(cut, 1.0 / height);
            sum += residual * residual;
            lagged += residual * previous;
            previous = residual;
        }
        let free = fit.count - 2.0;
        // the variance was estimated too: that of Student's distribution
        let mut own = sum / free * (free / (free - 2.0));
        // correlated beyond chance (texture, compression): fewer cuts than it seems
        let correlation = lagged / sum.max(f64::MIN_POSITIVE);
        if correlation > 2.0 / fit.count.sqrt() {
            own *= (1.0 + correlation) / (1.0 - correlation);
        }
        // Rounding to whole gray levels, 1/12 in variance for a pixel: without noise no residual shows it,
        // and cuts at like phases share it. Noise spreads it: what is left falls with
        // exp(-4 pi^2 variance) (Widrow and Kollar 2008, chapter 9).
        let weights = weights()[0].place.map(|w| (f64::from(w) / height).powi(2));
        let a_pixel: f64 = weights.iter().sum();
        let noise = sum / free / a_pixel;
        let rounding = (-4.0 * std::f64::consts::PI.powi(2) * noise).exp() / 12.0;
        [own + a_pixel * rounding, a_pixel * rounding]
    }

    fn segment(
        &self,
        image: &GrayImage,
        path: &Path,
        ends: [i32; 2],
        fit: &Fit,
        variance: [f64; 2],
    ) -> Option<Segment> {
        let b = fit.slope;
        let at_zero = fit.value - b * fit.middle;
        let q = (1.0 + b * b).sqrt();
        let end = |t: f64| {
            if path.along_u {
                [t, fit.at(t)]
            } else {
                [fit.at(t), t]
            }
        };
        // along u the normal is (-b, 1) / q, along v (1, -b) / q
        let (mut theta, turn) = if path.along_u {
            (1f64.atan2(-b), 1.0)
        } else {
            ((-b).atan2(1.0), -1.0)
        };
        let mut rho = at_zero / q;
        // by value and slope at the middle, which are uncorrelated
        let mut by_value = 1.0 / q;
        let mut by_slope = -fit.middle / q - at_zero * b / q.powi(3);
        let theta_by_slope = turn / (q * q);
        let mut rising = path.rising;
        if theta <= -f64::EPSILON {
            theta += std::f64::consts::PI;
            (rho, by_value, by_slope, rising) = (-rho, -by_value, -by_slope, !rising);
        }
        theta = theta.max(0.0);
        let value = variance[0] / fit.count + variance[1];
        // what rounding hides may differ from end to end: a variance of 2 / length^2, in terms of the spread
        let slope = (variance[0] + variance[1] * fit.count / 6.0) / fit.spread;
        let mixed = by_slope * theta_by_slope * slope;
        let contrast = self.contrast(image, path);
        Some(Segment {
            start: end(f64::from(ends[0])),
            end: end(f64::from(ends[1])),
            rho,
            theta,
            covariance: [
                [
                    by_value * by_value * value + by_slope * by_slope * slope,
                    mixed,
                ],
                [mixed, theta_by_slope * theta_by_slope * slope],
            ],
            contrast: if rising { contrast } else { -contrast },
            support_px: self.cuts.len() as u32,
        })
    }

    /// Mean gray level of the outer two pixels of the cuts on the bright side less that on the dark side.
    fn contrast(&self, image: &GrayImage, path: &Path) -> f64 {
        let mut sum = 0i32;
        for cut in &self.cuts {
            let taps = taps(
                image,
                path.along_u,
                cut.t as usize,
                cut.at as usize / PHASES - 3,
            );
            sum += taps[6] + taps[7] - taps[0] - taps[1];
        }
        0.5 * f64::from(sum.abs()) / self.cuts.len() as f64
    }
}

/// The pixels of a cut.
#[inline(always)]
fn taps(image: &GrayImage, along_u: bool, t: usize, first: usize) -> [i32; TAPS] {
    let width = image.width() as usize;
    if along_u {
        let pixels = &image.as_raw()[first * width + t..][..(TAPS - 1) * width + 1];
        std::array::from_fn(|i| i32::from(pixels[i * width]))
    } else {
        let pixels = &image.as_raw()[t * width + first..][..TAPS];
        std::array::from_fn(|i| i32::from(pixels[i]))
    }
}

/// Takes the sums of all cuts about a line.
struct Measure<'a> {
    image: &'a GrayImage,
    path: &'a Path,
    line: [f64; 2],
    every: usize,
    cuts: &'a mut Vec<Cut>,
}

impl pulp::NullaryFnOnce for Measure<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self {
            image,
            path,
            line: [offset, slope],
            every,
            cuts,
        } = self;
        let across = if path.along_u {
            image.height()
        } else {
            image.width()
        };
        let whole = 3.0..f64::from(across) - 4.0 - 1.0 / PHASES as f64;
        let sign = if path.rising { 1 } else { -1 };
        let weights = weights();
        cuts.clear();
        for step in (path.first..=path.last).step_by(every) {
            let p = offset + slope * f64::from(step);
            if !whole.contains(&p) {
                continue;
            }
            let index = (p * PHASES as f64 + 0.5) as usize;
            let weights = &weights[index % PHASES];
            let taps = taps(image, path.along_u, step as usize, index / PHASES - 3);
            let sum = |weights: &[i32; TAPS]| -> i32 {
                taps.iter()
                    .zip(weights)
                    .map(|(tap, weight)| tap * weight)
                    .sum()
            };
            let (place, slope) = (sum(&weights.place), sum(&weights.slope));
            cuts.push(Cut {
                t: step,
                at: index as i32,
                place: sign * place,
                slope: sign * slope,
            });
        }
    }
}
