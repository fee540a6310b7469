//! The fit itself: pairs in normalised coordinates, the linear start, Gauss-Newton with damping, covariance.
//!
//! The unknown is the map from floor to pixels, a unit 9-vector in the chart of [`chart`]. A pair's error is
//! that of its pixel, of its floor point, or of both. With a latent floor point `q` on the floor near the
//! measured `f`, the cost of a pair is the least over `q` of
//! `|p - g(q)|^2 / pixel variance + |f - q|^2 / floor variance`; linearised at the best `q` that is
//! `r^T S^-1 r` with `r = p - g(q) - P (f - q)`, `P` the slope of `g` and `S = pixel variance + floor variance
//! P P^T`. Without floor noise `q = f`; without pixel noise `g(q) = p`: one formula serves all three.
//!
//! Sources: R. Hartley, In Defense of the Eight-Point Algorithm, PAMI 1997 (normalisation); R. Hartley,
//! A. Zisserman, Multiple View Geometry in Computer Vision, chapters 4 and 5 (linear solve, errors in both
//! pictures, covariance).

use faer::linalg::solvers::SolveLstsq as _;
use faer::prelude::*;
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3};

use super::normal::{Scaling, depth, image, image_by_entries};
use crate::FloorHomography;
use crate::chart::{self, Entries};
use crate::homography::rows;

/// A measured pair and the variances of its measurement.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measured {
    /// Undistorted pixel [px].
    pub(crate) pixel: Vector2<f64>,
    /// Covariance of the pixel [px^2].
    pub(crate) pixel_noise: Matrix2<f64>,
    /// Floor point [m].
    pub(crate) floor: Vector2<f64>,
    /// Variance of each floor coordinate [m^2].
    pub(crate) floor_noise: f64,
}

/// All pairs in normalised coordinates.
#[derive(Debug, Clone)]
pub(crate) struct Problem {
    samples: Vec<Measured>,
    pixels: Scaling,
    floor: Scaling,
}

/// A solution for some of the pairs.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    /// Floor to pixel in normalised coordinates, unit norm, positive third component at its pairs.
    pub(crate) map: Matrix3<f64>,
    /// Sum of squared errors in sigmas.
    pub(crate) cost: f64,
    /// Covariance in the chart at `map`, for the variances as they were given.
    covariance: SMatrix<f64, 8, 8>,
    /// The largest sigma of any direction of the chart [rad].
    pub(crate) worst_sigma: f64,
}

/// The error of one pair, whitened, and how it moves with the chart.
struct Whitened {
    error: Vector2<f64>,
    slope: SMatrix<f64, 2, 8>,
}

const MOST_STEPS: usize = 60;

impl Problem {
    pub(crate) fn new(pairs: &[Measured]) -> Self {
        let pixels = Scaling::of(pairs.iter().map(|p| p.pixel));
        let floor = Scaling::of(pairs.iter().map(|p| p.floor));
        let samples = pairs.iter().map(|p| Measured {
            pixel: pixels.apply(p.pixel),
            pixel_noise: p.pixel_noise * pixels.scale.powi(2),
            floor: floor.apply(p.floor),
            floor_noise: p.floor_noise * floor.scale.powi(2),
        });
        Self {
            samples: samples.collect(),
            pixels,
            floor,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.samples.len()
    }

    /// The normalised linear least-squares solution for some of the pairs; `None` where they leave it open.
    pub(crate) fn linear(&self, chosen: &[usize]) -> Option<Matrix3<f64>> {
        // nine rows at least, so that the thin decomposition has the null vector
        let mut system = Mat::<f64>::zeros((2 * chosen.len()).max(9), 9);
        for (k, &i) in chosen.iter().enumerate() {
            let Measured {
                pixel: p, floor: f, ..
            } = self.samples[i];
            let q = [f.x, f.y, 1.0];
            for c in 0..3 {
                system[(2 * k, c)] = q[c];
                system[(2 * k, 6 + c)] = -p.x * q[c];
                system[(2 * k + 1, 3 + c)] = q[c];
                system[(2 * k + 1, 6 + c)] = -p.y * q[c];
            }
        }
        let svd = system.thin_svd().ok()?;
        let values = svd.S().column_vector();
        if values[7].is_nan() || values[7] <= 1e-9 * values[0] {
            return None;
        }
        let null = svd.V().col(8);
        self.facing(Matrix3::from_fn(|r, c| null[3 * r + c]), chosen)
    }

    /// The map through four pairs, by projective bases; `None` where three of them are on a line.
    pub(crate) fn through(&self, four: [usize; 4]) -> Option<Matrix3<f64>> {
        let basis = |points: [Vector2<f64>; 4]| {
            let [a, b, c, d] = points.map(|p| p.push(1.0));
            let corners = Matrix3::from_columns(&[a, b, c]);
            let weights: Vector3<f64> = corners.try_inverse()? * d;
            (weights.abs().min() > 1e-9).then(|| corners * Matrix3::from_diagonal(&weights))
        };
        let to = basis(four.map(|i| self.samples[i].pixel))?;
        let from = basis(four.map(|i| self.samples[i].floor))?;
        self.facing(to * from.try_inverse()?, &four)
    }

    /// The map at unit norm, signed so that most of the chosen floor points are before the camera.
    fn facing(&self, map: Matrix3<f64>, chosen: &[usize]) -> Option<Matrix3<f64>> {
        let before = chosen
            .iter()
            .filter(|&&i| depth(&map, self.samples[i].floor) > 0.0);
        let sign = if 2 * before.count() >= chosen.len() {
            1.0
        } else {
            -1.0
        };
        let unit = map * (sign / map.norm());
        unit.iter().all(|v| v.is_finite()).then_some(unit)
    }

    /// The chosen pairs that the map puts behind the camera.
    pub(crate) fn behind(&self, map: &Matrix3<f64>, chosen: &[usize]) -> Vec<usize> {
        let behind = |i: &usize| depth(map, self.samples[*i].floor) <= 0.0;
        chosen.iter().copied().filter(behind).collect()
    }

    /// Squared error of a pair in sigmas; infinite behind the camera.
    pub(crate) fn squared_error(&self, map: &Matrix3<f64>, pair: usize) -> f64 {
        let pair = &self.samples[pair];
        if pair.floor_noise == 0.0 {
            // the latent floor point is the measured one
            return image(map, pair.floor).map_or(f64::INFINITY, |(seen, _)| {
                let error = pair.pixel - seen;
                let inverse = pair.pixel_noise.try_inverse();
                inverse.map_or(f64::INFINITY, |inverse| error.dot(&(inverse * error)))
            });
        }
        let latent = self.latent(map, pair);
        latent.map_or(f64::INFINITY, |l| l.error.dot(&(l.inverse * l.error)))
    }

    /// The least cost near a first guess; `None` if the guess puts a chosen pair behind the camera or the
    /// pairs leave a direction open.
    pub(crate) fn refine(&self, start: &Matrix3<f64>, chosen: &[usize]) -> Option<Fit> {
        let mut map = *start;
        let mut whitened = self.whitened(&map, chosen)?;
        let mut cost = cost_of(&whitened);
        let mut damping = 1e-6;
        for _ in 0..MOST_STEPS {
            let step = damped_step(&whitened, damping);
            let next = stepped(&map, &step);
            let tried = self.whitened(&next, chosen).map(|w| (cost_of(&w), w));
            let change = tried.as_ref().map_or(f64::INFINITY, |t| t.0 - cost);
            let settled = step.norm() < 1e-13 || change.abs() <= 1e-12 * cost;
            if let Some((less, w)) = tried.filter(|t| t.0 <= cost) {
                (map, cost, whitened) = (next, less, w);
                damping = (damping * 0.1).max(1e-15);
            } else {
                damping = (damping * 10.0).max(1e-9);
            }
            if settled || damping > 1e12 {
                break;
            }
        }
        let slopes = stacked(&whitened, 0.0).0;
        let svd = slopes.thin_svd().ok()?;
        let values = svd.S().column_vector();
        if values[7].is_nan() || values[7] <= 1e-12 * values[0] {
            return None;
        }
        let mut covariance = SMatrix::zeros();
        for k in 0..8 {
            let direction = SMatrix::<f64, 8, 1>::from_fn(|r, _| svd.V()[(r, k)] / values[k]);
            covariance += direction * direction.transpose();
        }
        Some(Fit {
            map,
            cost,
            covariance,
            worst_sigma: 1.0 / values[7],
        })
    }

    /// The linear start, refined.
    pub(crate) fn solve(&self, chosen: &[usize]) -> Option<Fit> {
        self.refine(&self.linear(chosen)?, chosen)
    }

    /// Squared error of a pair in sigmas of the error to be expected if the pair is right: the fit's own
    /// uncertainty adds to that of a pair outside the fit, and hides part of the error of one inside.
    pub(crate) fn squared_surprise(&self, fit: &Fit, pair: usize, inside: bool) -> f64 {
        let Some(w) = self.whitened(&fit.map, &[pair]) else {
            return f64::INFINITY;
        };
        let of_fit = w[0].slope * fit.covariance * w[0].slope.transpose();
        let expected = if inside {
            // a pair that alone determines a direction has no error to judge
            Matrix2::identity() - of_fit * (1.0 - 1e-9)
        } else {
            Matrix2::identity() + of_fit
        };
        expected.try_inverse().map_or(f64::INFINITY, |inverse| {
            w[0].error.dot(&(inverse * w[0].error))
        })
    }

    /// RMS distance of pixels from where a map puts their floor points, before the camera or behind [px].
    pub(crate) fn rms_pixel(&self, map: &Matrix3<f64>, chosen: &[usize]) -> f64 {
        let squared = |&i: &usize| {
            let Measured { pixel, floor, .. } = self.samples[i];
            let h = map * floor.push(1.0);
            (h.xy() / h.z - pixel).norm_squared()
        };
        (chosen.iter().map(squared).sum::<f64>() / chosen.len() as f64).sqrt() / self.pixels.scale
    }

    /// RMS distance of pixels from their centre [px].
    pub(crate) fn pixel_spread(&self, chosen: &[usize]) -> f64 {
        let count = chosen.len() as f64;
        let pixels = || chosen.iter().map(|&i| self.samples[i].pixel);
        let center = pixels().sum::<Vector2<f64>>() / count;
        (pixels().map(|p| (p - center).norm_squared()).sum::<f64>() / count).sqrt()
            / self.pixels.scale
    }

    /// The homography of a fit, and its covariance in the chart there, variances times `scale`; `None` where
    /// the map cannot be inverted.
    pub(crate) fn homography(
        &self,
        fit: &Fit,
        scale: f64,
    ) -> Option<(FloorHomography, SMatrix<f64, 8, 8>)> {
        let inverse = self.pixel_to_floor(&fit.map)?;
        let homography = FloorHomography::new(rows(&inverse)).ok()?;
        let unit = chart::entries(&homography);
        let (to_pixels, from_floor) = (self.pixels.matrix().try_inverse()?, self.floor.matrix());
        // d(map^-1) = -map^-1 d(map) map^-1, at unit norm, in the chart
        let raw = Matrix3::from_fn(|r, c| unit[3 * r + c]);
        let back = raw.try_inverse()?;
        let size = (to_pixels * fit.map * from_floor).norm() / back.norm();
        let sign = (to_pixels * fit.map * from_floor).dot(&back).signum();
        let normal_basis = map_basis(&fit.map);
        let basis = chart::basis(&homography);
        let mut by_chart = SMatrix::<f64, 8, 8>::zeros();
        for k in 0..8 {
            let moved = Matrix3::from_fn(|r, c| normal_basis[(3 * r + c, k)]);
            let moved = to_pixels * moved * from_floor * (sign / size);
            let change = -raw * moved * raw;
            let change = Entries::from_fn(|e, _| change[(e / 3, e % 3)]);
            by_chart.set_column(k, &(basis.transpose() * change));
        }
        let covariance = by_chart * fit.covariance * by_chart.transpose() * scale;
        let symmetric = (covariance + covariance.transpose()) * 0.5;
        symmetric
            .iter()
            .all(|v| v.is_finite())
            .then_some((homography, symmetric))
    }

    /// Seen from above, not in a mirror: see [`FloorHomography`].
    pub(crate) fn is_mirrored(&self, map: &Matrix3<f64>) -> bool {
        // both scalings keep orientation, and the third component is positive at the pairs
        map.determinant() > 0.0
    }

    fn pixel_to_floor(&self, map: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        let from_floor = self.floor.matrix().try_inverse()?;
        Some(from_floor * map.try_inverse()? * self.pixels.matrix())
    }

    fn whitened(&self, map: &Matrix3<f64>, chosen: &[usize]) -> Option<Vec<Whitened>> {
        let basis = map_basis(map);
        let one = |&i: &usize| {
            let latent = self.latent(map, &self.samples[i])?;
            let lower = latent.variance.cholesky()?.l();
            let whiten = lower.try_inverse()?;
            Some(Whitened {
                error: whiten * latent.error,
                slope: -whiten * latent.by_entries * basis,
            })
        };
        chosen.iter().map(one).collect()
    }

    /// The best latent floor point of a pair and the error there; `None` behind the camera.
    fn latent(&self, map: &Matrix3<f64>, pair: &Measured) -> Option<Latent> {
        let mut q = pair.floor;
        for _ in 0..50 {
            let (seen, slope) = image(map, q)?;
            let error = pair.pixel - seen - slope * (pair.floor - q);
            let variance = pair.pixel_noise + slope * slope.transpose() * pair.floor_noise;
            let inverse = variance.try_inverse()?;
            let better = pair.floor + slope.transpose() * inverse * error * pair.floor_noise;
            let step = (better - q).norm();
            if step <= 1e-14 * (1.0 + q.norm()) {
                return Some(Latent {
                    error,
                    variance,
                    inverse,
                    by_entries: image_by_entries(map, q)?,
                });
            }
            q = better;
        }
        None
    }
}

struct Latent {
    error: Vector2<f64>,
    variance: Matrix2<f64>,
    inverse: Matrix2<f64>,
    /// How the seen pixel moves with the map's entries.
    by_entries: SMatrix<f64, 2, 9>,
}

fn map_basis(map: &Matrix3<f64>) -> SMatrix<f64, 9, 8> {
    chart::basis_of(&Entries::from_fn(|k, _| map[(k / 3, k % 3)]))
}

fn stepped(map: &Matrix3<f64>, step: &SMatrix<f64, 8, 1>) -> Matrix3<f64> {
    let change = map_basis(map) * step;
    let next = map + Matrix3::from_fn(|r, c| change[3 * r + c]);
    next / next.norm()
}

fn cost_of(whitened: &[Whitened]) -> f64 {
    whitened.iter().map(|w| w.error.norm_squared()).sum()
}

/// Slopes and errors one below another, with eight rows of damping.
fn stacked(whitened: &[Whitened], damping: f64) -> (Mat<f64>, Mat<f64>) {
    let count = 2 * whitened.len();
    let mut slopes = Mat::zeros(count + 8, 8);
    let mut errors = Mat::zeros(count + 8, 1);
    for (k, w) in whitened.iter().enumerate() {
        for r in 0..2 {
            errors[(2 * k + r, 0)] = -w.error[r];
            for c in 0..8 {
                slopes[(2 * k + r, c)] = w.slope[(r, c)];
            }
        }
    }
    for c in 0..8 {
        let size: f64 = (0..count).map(|r| slopes[(r, c)].powi(2)).sum();
        slopes[(count + c, c)] = (damping * size).sqrt();
    }
    (slopes, errors)
}

fn damped_step(whitened: &[Whitened], damping: f64) -> SMatrix<f64, 8, 1> {
    let (slopes, errors) = stacked(whitened, damping);
    let step = slopes.qr().solve_lstsq(&errors);
    SMatrix::from_fn(|r, _| step[(r, 0)])
}
