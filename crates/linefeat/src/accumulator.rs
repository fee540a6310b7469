//! The votes of a Hough transform.

use std::f64::consts::PI;

use crate::direction::direction;
use crate::vote_blocks::{self, VoteBlocks};
use crate::{EdgeMap, EdgePixel, HoughError, HoughParams, Voting};

/// Most bins of an accumulator (half a GiB).
const MAX_BINS: usize = 1 << 28;
/// Angles computed at once.
const LANES: usize = 16;
/// 1.5 x 2^23: from here on the numbers of f32 are whole.
const ROUNDING: f32 = 12_582_912.0;
/// Bins before and behind a row that take the empty part of a block's window.
const MARGIN: usize = 16;

/// Votes by theta and rho.
///
/// Bin (k, r) counts the edge pixels (u, v) with `floor((u cos(theta_k) + v sin(theta_k)) / d + 1/2) = r`,
/// where `theta_k = k pi / angles` and d is the width of a bin. Every bin is d wide, that around 0 as well.
/// The sum is made of whole numbers, cosines and sines rounded so that it is off by less than the
/// picture's diagonal / 10^6. Counts stop at 65535. The angles just below pi adjoin those from 0 up, with
/// rho negated.
#[derive(Clone, Debug, Default)]
pub struct Accumulator {
    pub(crate) angles: usize,
    pub(crate) reach: usize,
    pub(crate) rho_px: f64,
    stride: usize,
    pub(crate) table: Table,
    /// By angle, then rho, with margins.
    pub(crate) bins: Vec<u16>,
    blocks: VoteBlocks,
}

/// What an angle needs for a vote. The angles wrap around, so that any `LANES` of them are a slice.
#[derive(Clone, Debug, Default)]
pub(crate) struct Table {
    /// Binary digits of the fraction in `cos` and `sin`.
    pub(crate) fraction: u32,
    /// cos(theta_k) / d.
    pub(crate) cos: Vec<i32>,
    /// sin(theta_k) / d.
    pub(crate) sin: Vec<i32>,
    /// Where the bin of rho = 0 lies.
    pub(crate) zero: Vec<u32>,
}

impl Accumulator {
    /// Bins of theta; that of bin k is `k pi / angles`.
    #[must_use]
    pub fn angles(&self) -> usize {
        self.angles
    }

    /// Bins of rho are -reach to reach.
    #[must_use]
    pub fn reach(&self) -> usize {
        self.reach
    }

    /// Votes of angle k for the bins -reach to reach of rho.
    ///
    /// # Panics
    /// If there is no angle k.
    #[must_use]
    pub fn row(&self, k: usize) -> &[u16] {
        assert!(k < self.angles, "no angle {k} of {}", self.angles);
        &self.bins[k * self.stride + MARGIN..][..2 * self.reach + 1]
    }

    /// Becomes the votes of `edges`.
    pub(crate) fn vote(&mut self, edges: &EdgeMap, params: &HoughParams) -> Result<(), HoughError> {
        self.shape(edges, params)?;
        let half = match params.voting {
            Voting::AllDirections => self.angles,
            Voting::NearGradient { spread } => self.half_window(spread),
        };
        if 2 * half + 1 < self.angles {
            pulp::Arch::new().dispatch(NearGradient(self, edges.pixels(), half));
            return Ok(());
        }
        let mut blocks = std::mem::take(&mut self.blocks);
        if !vote_blocks::vote(self, edges, &mut blocks) {
            pulp::Arch::new().dispatch(AllDirections(self, edges.pixels()));
        }
        self.blocks = blocks;
        Ok(())
    }

    /// Whole bins in an angle.
    pub(crate) fn half_window(&self, spread: f64) -> usize {
        (spread / PI * self.angles as f64).round().max(0.0) as usize
    }

    /// Zero votes in the bins for the picture.
    fn shape(&mut self, edges: &EdgeMap, params: &HoughParams) -> Result<(), HoughError> {
        let HoughParams { rho_px, theta, .. } = *params;
        let valid = rho_px > 0.0 && rho_px.is_finite() && theta > 0.0 && theta <= PI;
        if !valid {
            return Err(HoughError::Width { rho_px, theta });
        }
        let far = f64::from(edges.width().saturating_sub(1))
            .hypot(f64::from(edges.height().saturating_sub(1)));
        let (angles, reach) = ((PI / theta).round(), (far / rho_px).ceil() + 1.0);
        let found = angles * (2.0 * (reach + MARGIN as f64) + 1.0);
        if found > MAX_BINS as f64 {
            return Err(HoughError::TooFine {
                expected: MAX_BINS,
                found,
            });
        }
        (self.angles, self.reach, self.rho_px) = (angles as usize, reach as usize, rho_px);
        self.stride = 2 * (self.reach + MARGIN) + 1;
        self.bins.clear();
        self.bins.resize(self.angles * self.stride, 0);
        self.table
            .update(self.angles, rho_px, self.reach + MARGIN, self.stride);
        Ok(())
    }

    /// The bins of a pixel at `LANES` angles from `first`.
    #[inline(always)]
    fn places(&self, first: usize, u: i32, v: i32) -> [u32; LANES] {
        let table = &self.table;
        let cos: &[i32; LANES] = table.cos[first..][..LANES].try_into().expect("that long");
        let sin: &[i32; LANES] = table.sin[first..][..LANES].try_into().expect("that long");
        let zero: &[u32; LANES] = table.zero[first..][..LANES].try_into().expect("that long");
        let half = (1 << table.fraction) >> 1;
        std::array::from_fn(|i| {
            let sum = u.wrapping_mul(cos[i]).wrapping_add(v.wrapping_mul(sin[i]));
            zero[i].wrapping_add_signed(sum.wrapping_add(half) >> table.fraction)
        })
    }

    #[inline(always)]
    fn count(&mut self, places: &[u32]) {
        for &place in places {
            if let Some(votes) = self.bins.get_mut(place as usize) {
                *votes = votes.saturating_add(1);
            }
        }
    }
}

impl Table {
    fn update(&mut self, angles: usize, rho_px: f64, zero: usize, stride: usize) {
        self.cos.clear();
        self.sin.clear();
        self.zero.clear();
        self.fraction = 30 - (zero + MARGIN).next_power_of_two().ilog2();
        let scale = f64::from(self.fraction).exp2() / rho_px;
        let wrapped = (0..angles).cycle().take(angles + 2 * vote_blocks::LANES);
        for k in wrapped {
            let (sin, cos) = (k as f64 * PI / angles as f64).sin_cos();
            self.cos.push((cos * scale).round() as i32);
            self.sin.push((sin * scale).round() as i32);
            self.zero.push((k * stride + zero) as u32);
        }
    }
}

struct AllDirections<'a>(&'a mut Accumulator, &'a [EdgePixel]);

impl pulp::NullaryFnOnce for AllDirections<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self(votes, pixels) = self;
        for pixel in pixels {
            for first in (0..votes.angles).step_by(LANES) {
                let places = votes.places(first, pixel.u as i32, pixel.v as i32);
                votes.count(&places[..LANES.min(votes.angles - first)]);
            }
        }
    }
}

/// Votes for the angle nearest to the gradient and so many on either side.
struct NearGradient<'a>(&'a mut Accumulator, &'a [EdgePixel], usize);

impl pulp::NullaryFnOnce for NearGradient<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self(votes, pixels, half) = self;
        // idle additions instead of a division a pixel
        let wrapped = [-(half as i32), votes.angles as i32];
        let per_radian = votes.angles as f32 / std::f32::consts::PI;
        for some in pixels.chunks(LANES) {
            let (mut gx, mut gy) = ([0f32; LANES], [0f32; LANES]);
            for (i, pixel) in some.iter().enumerate() {
                (gx[i], gy[i]) = (f32::from(pixel.gx), f32::from(pixel.gy));
            }
            let mut nearest = [0i32; LANES];
            for (nearest, (gx, gy)) in nearest.iter_mut().zip(gx.into_iter().zip(gy)) {
                // halves to even: an addition that leaves no room for fractions
                let rounded = direction(gx, gy) * per_radian + ROUNDING;
                *nearest = rounded.to_bits().wrapping_sub(ROUNDING.to_bits()) as i32;
            }
            for (pixel, nearest) in some.iter().zip(nearest) {
                let mut first = nearest + wrapped[0];
                first += if first < 0 { wrapped[1] } else { 0 };
                first += if first < 0 { wrapped[1] } else { 0 };
                let mut first = first as usize;
                for done in (0..2 * half + 1).step_by(LANES) {
                    let places = votes.places(first, pixel.u as i32, pixel.v as i32);
                    votes.count(&places[..LANES.min(2 * half + 1 - done)]);
                    first += LANES;
                    first -= if first < votes.angles {
                        0
                    } else {
                        votes.angles
                    };
                }
            }
        }
    }
}
