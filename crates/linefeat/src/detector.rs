//! From a frame to its straight edges, with the buffers of the frame before.

use image::GrayImage;

use crate::segment::most_segments;
use crate::{Canny, CannyParams, EdgeMap, ModifiedCannyParams, Segment, SegmentParams, Segments};

/// Parameters of a [`Detector`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DetectorParams {
    /// What is an edge pixel.
    pub canny: CannyParams,
    /// What is a segment.
    pub segments: SegmentParams,
}

/// Finds the straight edges of frame after frame. The first frame makes room for the worst one of its size (24
/// bytes a pixel, of which memory is taken as frames need it): frames of that size allocate nothing any more,
/// whatever they show.
#[derive(Clone, Debug, Default)]
pub struct Detector {
    params: DetectorParams,
    canny: Canny,
    edges: EdgeMap,
    segments: Segments,
    found: Vec<Segment>,
}

impl Detector {
    /// A detector that has seen no frame.
    #[must_use]
    pub fn new(params: DetectorParams) -> Self {
        Self {
            params,
            ..Self::default()
        }
    }

    /// The straight edges of `frame`, in row order of their first pixels.
    pub fn detect(&mut self, frame: &GrayImage) -> &[Segment] {
        self.make_room(frame);
        self.canny
            .detect(frame, &self.params.canny, &mut self.edges);
        self.follow(frame)
    }

    /// The same with thresholds chosen from the frame, and only within a region, as
    /// [`canny_modified`](crate::canny_modified) does: they follow exposure and noise.
    pub fn detect_modified(
        &mut self,
        frame: &GrayImage,
        params: &ModifiedCannyParams,
    ) -> &[Segment] {
        self.make_room(frame);
        self.canny.detect_modified(frame, params, &mut self.edges);
        self.follow(frame)
    }

    fn make_room(&mut self, frame: &GrayImage) {
        let pixels = frame.as_raw().len();
        self.edges.reserve(pixels);
        self.found.clear();
        self.found.reserve(most_segments(pixels));
    }

    fn follow(&mut self, frame: &GrayImage) -> &[Segment] {
        self.segments
            .detect(frame, &self.edges, &self.params.segments, &mut self.found);
        &self.found
    }

    /// The edge pixels of the last frame.
    #[must_use]
    pub fn edges(&self) -> &EdgeMap {
        &self.edges
    }

    /// The straight edges of the last frame.
    #[must_use]
    pub fn segments(&self) -> &[Segment] {
        &self.found
    }
}
