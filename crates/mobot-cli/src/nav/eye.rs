//! From a camera's frame to what the pose step takes: lens undone, straight edges, floor features.

use image::GrayImage;
use linefeat::{
    CannyParams, Detector, DetectorParams, FloorFeatures, FloorParams, FloorView,
    ModifiedCannyParams, Norm, Segment, floor_features_into,
};
use monocal::{
    CornerObservation, EdgeObservation, FloorCamera, Lens, Observations, Rectifier, Undetermined,
};
use occgrid::Point2;

/// What is an edge in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thresholds {
    /// Steps of about 15 gray levels, whatever the frame's light.
    Fixed,
    /// What stands out in the frame: they follow light and noise. In rendered corridors they give as good fixes and a
    /// few more, in dim ones twice as many and better ones.
    OfFrame,
}

/// Joints and shadows with a step of about 15 gray levels are kept, sensor noise is not.
const FIXED: CannyParams = CannyParams {
    low: 40.0,
    high: 100.0,
    norm: Norm::L1,
};

/// A calibrated camera that finds floor features in frame after frame, with the buffers of the frame before.
///
/// Lines bend in a lens, and features with them. So the lens is undone in the picture, once, before they are looked
/// for: all that an eye finds is in undistorted pixels, those of its [`camera`](Self::camera).
#[derive(Debug)]
pub struct Eye {
    camera: FloorCamera,
    flat: Flat,
    thresholds: Thresholds,
    detector: Detector,
    segments: Vec<Segment>,
    features: FloorFeatures,
    seen: Observations,
}

impl Eye {
    /// An eye that has seen no frame.
    ///
    /// # Errors
    /// [`Undetermined`] where the camera's mounting cannot be told from its calibration.
    pub fn new(camera: &FloorCamera, thresholds: Thresholds) -> Result<Self, Undetermined> {
        let view = FloorView {
            pixel_to_floor: camera.homography.pixel_to_floor(),
            nadir: camera.geometry()?.nadir,
        };
        Ok(Self {
            camera: camera.rectified(),
            flat: Flat {
                view,
                lens: camera.lens.filter(|lens| !lens.is_plain()),
                rectifier: None,
                picture: GrayImage::default(),
            },
            thresholds,
            detector: Detector::new(DetectorParams {
                canny: FIXED,
                ..DetectorParams::default()
            }),
            segments: Vec::new(),
            features: FloorFeatures::default(),
            seen: Observations::default(),
        })
    }

    /// The camera of undistorted pixels.
    #[must_use]
    pub const fn camera(&self) -> &FloorCamera {
        &self.camera
    }

    /// The floor point right under the camera, base frame [m].
    #[must_use]
    pub fn foot(&self) -> Point2 {
        let [x, y] = self.flat.view.camera_foot();
        Point2::new(x, y)
    }

    /// What a frame shows. Nothing where the lens images none of it.
    pub fn look(&mut self, frame: &GrayImage) -> &Observations {
        self.segments.clear();
        self.seen.edges.clear();
        self.seen.corners.clear();
        let Some(Flattened {
            image,
            view,
            origin,
        }) = self.flat.of(frame)
        else {
            self.features = FloorFeatures::default();
            return &self.seen;
        };
        let found = match self.thresholds {
            Thresholds::Fixed => self.detector.detect(image),
            Thresholds::OfFrame => self
                .detector
                .detect_modified(image, &ModifiedCannyParams::default()),
        };
        let params = FloorParams::default();
        floor_features_into(image, found, &view, &params, &mut self.features);
        self.segments.extend(found.iter().map(|s| moved(s, origin)));
        for edge in &mut self.features.edges {
            let theta = self.segments[edge.segment].theta;
            edge.covariance = moved_covariance(theta, edge.covariance, origin);
        }
        for corner in &mut self.features.corners {
            corner.pixel = sum(corner.pixel, origin);
        }
        observe(&self.segments, &self.features, &mut self.seen);
        &self.seen
    }

    /// The frame without its lens and how the floor lies in it; `None` where the lens images none of it.
    pub fn flattened<'a>(&'a mut self, frame: &'a GrayImage) -> Option<(&'a GrayImage, FloorView)> {
        let flat = self.flat.of(frame)?;
        Some((flat.image, flat.view))
    }

    /// The straight edges of the last frame.
    #[must_use]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The floor features of the last frame.
    #[must_use]
    pub const fn features(&self) -> &FloorFeatures {
        &self.features
    }

    /// What the last frame showed.
    #[must_use]
    pub const fn seen(&self) -> &Observations {
        &self.seen
    }
}

/// Undoes the lens, where there is one.
#[derive(Debug)]
struct Flat {
    /// In undistorted pixels.
    view: FloorView,
    lens: Option<Lens>,
    /// For frames of the size of the last.
    rectifier: Option<Rectifier>,
    picture: GrayImage,
}

/// A frame in which straight things are straight.
struct Flattened<'a> {
    image: &'a GrayImage,
    /// In pixels of the image.
    view: FloorView,
    /// The undistorted pixel at the image's pixel (0, 0) [px].
    origin: [f64; 2],
}

impl Flat {
    fn of<'a>(&'a mut self, frame: &'a GrayImage) -> Option<Flattened<'a>> {
        let Some(lens) = &self.lens else {
            return Some(Flattened {
                image: frame,
                view: self.view,
                origin: [0.0, 0.0],
            });
        };
        let size = [frame.width(), frame.height()];
        if self
            .rectifier
            .as_ref()
            .is_none_or(|r| r.frame_size() != size)
        {
            self.rectifier = Rectifier::new(lens, size);
        }
        let rectifier = self.rectifier.as_ref()?;
        rectifier.rectify(frame, &mut self.picture);
        let origin = rectifier.origin().map(f64::from);
        Some(Flattened {
            image: &self.picture,
            view: shifted(&self.view, origin),
            origin,
        })
    }
}

/// The view in pixels counted from another origin.
fn shifted(view: &FloorView, [u, v]: [f64; 2]) -> FloorView {
    let [x, y, w] = view.nadir;
    FloorView {
        pixel_to_floor: view
            .pixel_to_floor
            .map(|[a, b, c]| [a, b, a * u + b * v + c]),
        nadir: [x - u * w, y - v * w, w],
    }
}

/// A segment in pixels counted from another origin.
fn moved(segment: &Segment, origin: [f64; 2]) -> Segment {
    let (sin, cos) = segment.theta.sin_cos();
    Segment {
        start: sum(segment.start, origin),
        end: sum(segment.end, origin),
        rho: segment.rho + origin[0] * cos + origin[1] * sin,
        covariance: moved_covariance(segment.theta, segment.covariance, origin),
        ..*segment
    }
}

/// Covariance of a normal form in pixels counted from another origin: rho grows with theta by the origin's part
/// across the normal.
fn moved_covariance(
    theta: f64,
    [[rr, rt], [_, tt]]: [[f64; 2]; 2],
    origin: [f64; 2],
) -> [[f64; 2]; 2] {
    let across = origin[1] * theta.cos() - origin[0] * theta.sin();
    let mixed = rt + across * tt;
    [[rr + across * (2.0 * rt + across * tt), mixed], [mixed, tt]]
}

fn sum(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

/// Features as the pose step takes them.
fn observe(lines: &[Segment], features: &FloorFeatures, seen: &mut Observations) {
    let edges = features.edges.iter().map(|edge| {
        let line = &lines[edge.segment];
        EdgeObservation {
            start: line.start,
            end: line.end,
            covariance: edge.covariance,
            confidence: edge.confidence,
        }
    });
    seen.edges.extend(edges);
    let corners = features.corners.iter().map(|corner| CornerObservation {
        pixel: corner.pixel,
        covariance: corner.covariance,
        confidence: corner.confidence,
        edge: corner.edge,
    });
    seen.corners.extend(corners);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The covariance moves with the line: of a point far along it stays what it was.
    #[test]
    fn a_moved_segment_is_the_same_line() {
        let segment = Segment {
            start: [10.0, 20.0],
            end: [110.0, 70.0],
            rho: 20.0 * 0.6_f64.sin() + 10.0 * 0.6_f64.cos(),
            theta: 0.6,
            covariance: [[0.04, -0.0003], [-0.0003, 0.00001]],
            contrast: 40.0,
            support_px: 100,
        };
        let origin = [-31.0, -17.0];
        let other = moved(&segment, origin);
        let distance =
            |s: &Segment, p: [f64; 2]| p[0] * s.theta.cos() + p[1] * s.theta.sin() - s.rho;
        let variance = |s: &Segment, p: [f64; 2]| {
            let t = p[1] * s.theta.cos() - p[0] * s.theta.sin();
            let [[rr, rt], [_, tt]] = s.covariance;
            rr - 2.0 * t * rt + t * t * tt
        };
        for place in [[0.0, 0.0], [200.0, -40.0], [33.0, 71.0]] {
            let there = sum(place, origin);
            assert!((distance(&segment, place) - distance(&other, there)).abs() < 1e-12);
            assert!((variance(&segment, place) - variance(&other, there)).abs() < 1e-12);
        }
        let start = [other.start[0] + 21.0, other.start[1] - 3.0];
        assert!(start.iter().all(|d| d.abs() < 1e-12));
    }
}
