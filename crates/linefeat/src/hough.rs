//! Straight lines by voting (Duda and Hart 1972), every edge pixel for all lines through it or only for
//! those near its gradient's direction (O'Gorman and Clowes 1976).

use crate::EdgeMap;
use crate::accumulator::Accumulator;
use crate::peaks::Peaks;

/// A line `u cos(theta) + v sin(theta) = rho` of pixels (u, v), pixel centres at integers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Line {
    /// Signed distance from the centre of pixel (0, 0) along the normal [px].
    pub rho: f64,
    /// Direction of the normal [rad], 0 (line along v) to below pi.
    pub theta: f64,
    /// Edge pixels in the peak's bin.
    pub votes: u32,
}

/// Which lines an edge pixel votes for.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Voting {
    /// All lines through it: the standard transform.
    AllDirections,
    /// The lines through it whose normals lie near its gradient: the modified transform. Three to four
    /// times faster, and crossing clutter does not vote.
    NearGradient {
        /// Largest angle between normal and gradient [rad], above 0; rounded to whole bins. Raised:
        /// noisier edges still vote for their line, the time grows with it. 4 degrees is the noise of
        /// a gradient 14 times stronger than its noise.
        spread: f64,
    },
}

/// Parameters of [`hough`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HoughParams {
    /// Width of a bin of rho [px], above 0. Raised: less memory, more lines a bin.
    pub rho_px: f64,
    /// Width of a bin of theta [rad], above 0 to pi; the nearest width that divides pi is taken. Raised:
    /// faster, less exact.
    pub theta: f64,
    /// Which lines an edge pixel votes for.
    pub voting: Voting,
    /// Fewest votes of a line, from 1. Raised: short lines go.
    pub votes: u32,
    /// Lines nearer than this in rho at the picture's centre [px] and nearer than `apart` in theta are one.
    /// 0: only bins that touch are.
    pub apart_px: f64,
    /// See `apart_px` [rad].
    pub apart: f64,
    /// Most lines returned, the strongest. Raised: time grows with its square at worst.
    pub lines: usize,
}

impl Default for HoughParams {
    fn default() -> Self {
        Self {
            rho_px: 1.0,
            theta: 1f64.to_radians(),
            voting: Voting::NearGradient {
                spread: 4f64.to_radians(),
            },
            votes: 60,
            apart_px: 4.0,
            apart: 3f64.to_radians(),
            lines: 500,
        }
    }
}

/// Why no lines were looked for.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HoughError {
    /// A bin width that is no positive number, or no angle up to pi.
    #[error("bins of {rho_px} px and {theta} rad: expected positive widths, theta up to pi")]
    Width {
        /// As given [px].
        rho_px: f64,
        /// As given [rad].
        theta: f64,
    },
    /// An accumulator beyond bounds.
    #[error("an accumulator of {found} bins: expected {expected} at most")]
    TooFine {
        /// Most bins.
        expected: usize,
        /// Bins asked for.
        found: f64,
    },
}

/// The lines of an edge map, the strongest first.
///
/// # Errors
/// If the accumulator would have no or too many bins.
pub fn hough(edges: &EdgeMap, params: &HoughParams) -> Result<Vec<Line>, HoughError> {
    let mut lines = Vec::new();
    Hough::new().detect(edges, params, &mut lines)?;
    Ok(lines)
}

/// The buffers of [`hough`], for frame after frame.
#[derive(Clone, Debug, Default)]
pub struct Hough {
    accumulator: Accumulator,
    peaks: Peaks,
}

impl Hough {
    /// Buffers that grow with the first frame.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// `lines` becomes the lines of `edges`, the strongest first.
    ///
    /// # Errors
    /// If the accumulator would have no or too many bins; `lines` is empty then.
    pub fn detect(
        &mut self,
        edges: &EdgeMap,
        params: &HoughParams,
        lines: &mut Vec<Line>,
    ) -> Result<(), HoughError> {
        lines.clear();
        self.accumulator.vote(edges, params)?;
        self.peaks.find(&self.accumulator, edges, params, lines);
        Ok(())
    }

    /// The votes of the last frame.
    #[must_use]
    pub fn accumulator(&self) -> &Accumulator {
        &self.accumulator
    }
}
