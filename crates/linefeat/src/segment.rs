//! Straight edges as segments, placed between the pixels, with covariance.
//!
//! Edge pixels are gathered along a growing line ([`crate::follow`]) if their gradients agree with it, after the grouping of
//! Burns, Hanson and Riseman (1986); the line is then fitted to the gray levels ([`crate::profile`]).

use image::GrayImage;

use crate::EdgeMap;
use crate::follow::{Compass, Path};
use crate::profile::Profiles;

/// A straight edge, from dark to bright on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Segment {
    /// One end (u, v) [px], on the line.
    pub start: [f64; 2],
    /// The other end (u, v) [px], on the line.
    pub end: [f64; 2],
    /// Signed distance of the line from the centre of pixel (0, 0) along its normal [px].
    pub rho: f64,
    /// Direction of the line's normal [rad], 0 to below pi.
    pub theta: f64,
    /// Covariance of (rho, theta) [px^2, px rad, rad^2].
    pub covariance: [[f64; 2]; 2],
    /// How much brighter it is on the side to which the normal points [gray levels].
    pub contrast: f64,
    /// Rows or columns of the picture that show the edge, across which the line was fitted.
    pub support_px: u32,
}

impl Segment {
    /// Distance of the ends [px].
    #[must_use]
    pub fn length_px(&self) -> f64 {
        (self.end[0] - self.start[0]).hypot(self.end[1] - self.start[1])
    }
}

/// Parameters of [`segments`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SegmentParams {
    /// Least extent along the nearer axis of the picture [px], from 8. Raised: short segments go.
    pub length_px: u32,
    /// Longest gap that is bridged [px]. Raised: broken lines become one, and more chance neighbours join.
    pub gap_px: u32,
    /// Largest angle between an edge pixel's gradient and the line's normal [rad], 0 to pi / 2. Raised: noisy
    /// edges hold together, and bends too. The staircases of edges drawn without smoothing need 27 degrees.
    pub turn: f64,
}

impl Default for SegmentParams {
    fn default() -> Self {
        Self {
            length_px: 12,
            gap_px: 4,
            turn: 30f64.to_radians(),
        }
    }
}

/// Least extent of any segment along an axis of the picture [px]: no gap is bridged before, so that it takes as
/// many pixels.
const LEAST_PX: u32 = 8;

/// A picture of so many pixels has no more segments.
pub(crate) fn most_segments(pixels: usize) -> usize {
    pixels / LEAST_PX as usize
}

/// The straight edges of `image`, whose edge pixels are `edges`, in row order of their first pixels.
///
/// # Panics
/// If the sizes of the two differ.
#[must_use]
pub fn segments(image: &GrayImage, edges: &EdgeMap, params: &SegmentParams) -> Vec<Segment> {
    let mut found = Vec::new();
    Segments::new().detect(image, edges, params, &mut found);
    found
}

/// The buffers of [`segments`], for frame after frame.
#[derive(Clone, Debug, Default)]
pub struct Segments {
    compass: Compass,
    path: Path,
    profiles: Profiles,
}

impl Segments {
    /// Buffers that grow with the first frame.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// `found` becomes the straight edges of `image`, whose edge pixels are `edges`.
    ///
    /// # Panics
    /// If the sizes of the two differ.
    pub fn detect(
        &mut self,
        image: &GrayImage,
        edges: &EdgeMap,
        params: &SegmentParams,
        found: &mut Vec<Segment>,
    ) {
        let size = (edges.width(), edges.height());
        assert_eq!(image.dimensions(), size, "the edges are of another picture");
        found.clear();
        self.compass.update(edges);
        self.profiles.reserve(size);
        let least = params.length_px.max(LEAST_PX);
        for pixel in edges.pixels() {
            if self
                .compass
                .follow([pixel.u, pixel.v], params, &mut self.path)
                && self.path.extent() >= least
            {
                found.extend(self.profiles.fit(image, &self.path, least));
            }
        }
    }
}
