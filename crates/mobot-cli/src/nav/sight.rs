//! What the camera is good for: pose fixes against a floor plan, and things that move on the floor.

use linefeat::{
    CannyParams, Detector, DetectorParams, FloorFeatures, FloorParams, FloorState, FloorView, Norm,
    ObstacleParams, ObstacleTracker, Segment, floor_features_into,
};
use mobot_hw::CameraFrame;
use monocal::{
    CornerObservation, EdgeObservation, FloorCamera, FloorPlan, LocateParams, Observations,
    PoseFix, Prior, Undetermined, locate,
};
use occgrid::{CellState, Point2, Pose2};

use super::Mover;
use super::swath::SwathMap;

/// What is an edge in frames of indoor floors.
const EDGES: CannyParams = CannyParams {
    low: 40.0,
    high: 100.0,
    norm: Norm::L1,
};

/// A calibrated camera and the plan of what it may see.
#[derive(Debug)]
pub struct Sight {
    camera: FloorCamera,
    view: FloorView,
    plan: FloorPlan,
    params: LocateParams,
    detector: Detector,
    features: FloorFeatures,
    seen: Observations,
    tracker: ObstacleTracker,
    /// Of the newest frame that was looked at.
    sequence: Option<u64>,
}

impl Sight {
    /// A camera over a floor, in a building of which this is known.
    ///
    /// # Errors
    /// [`Undetermined`] where the camera's mounting cannot be told from its calibration.
    pub fn new(
        camera: FloorCamera,
        plan: FloorPlan,
        params: LocateParams,
    ) -> Result<Self, Undetermined> {
        let view = FloorView {
            pixel_to_floor: camera.homography.pixel_to_floor(),
            nadir: camera.geometry()?.nadir,
        };
        Ok(Self {
            camera,
            view,
            plan,
            params,
            detector: Detector::new(DetectorParams {
                canny: EDGES,
                ..DetectorParams::default()
            }),
            features: FloorFeatures::default(),
            seen: Observations::default(),
            tracker: ObstacleTracker::new(view, ObstacleParams::default()),
            sequence: None,
        })
    }

    /// The floor plan.
    #[must_use]
    pub const fn plan(&self) -> &FloorPlan {
        &self.plan
    }

    /// Whether a frame is newer than all before and of the camera's size.
    pub fn accepts(&mut self, frame: &CameraFrame) -> bool {
        let size = [frame.image.width(), frame.image.height()];
        let fits = self.camera.image_size.is_none_or(|s| s == size);
        let newer = self.sequence.is_none_or(|s| frame.sequence > s);
        if fits && newer {
            self.sequence = Some(frame.sequence);
        }
        fits && newer
    }

    /// The pose that a frame shows near the prior.
    pub fn fix(&mut self, frame: &CameraFrame, prior: &Prior) -> PoseFix {
        let segments = self.detector.detect(&frame.image);
        floor_features_into(
            &frame.image,
            segments,
            &self.view,
            &FloorParams::default(),
            &mut self.features,
        );
        self.seen = observations(segments, &self.features);
        self.fix_again(prior)
    }

    /// The same for the last frame and another prior.
    #[must_use]
    pub fn fix_again(&self, prior: &Prior) -> PoseFix {
        locate(&self.seen, &self.plan, &self.camera, prior, &self.params)
    }

    /// Follows what moves, from a frame taken at `odom_from_base`, where the estimate puts the origin of
    /// dead reckoning at `map_from_odom`.
    pub fn follow(
        &mut self,
        frame: &CameraFrame,
        odom_from_base: Pose2,
        map_from_odom: Pose2,
        map: &impl SwathMap,
    ) -> Vec<Mover> {
        let floor = |[x, y]: [f64; 2]| match map.at(map_from_odom.transform_from(Point2::new(x, y)))
        {
            CellState::Free => FloorState::Free,
            CellState::Occupied => FloorState::Solid,
            CellState::Unknown => FloorState::Unknown,
        };
        let Pose2 { x, y, theta } = odom_from_base;
        self.tracker
            .update(&frame.image, frame.stamp, [x, y, theta], &floor);
        let direction = Pose2::new(0.0, 0.0, map_from_odom.theta);
        let mover = |track: &linefeat::Track| Mover {
            position: map_from_odom
                .transform_from(Point2::new(track.position[0], track.position[1])),
            velocity: direction.transform_from(Point2::new(track.velocity[0], track.velocity[1])),
            seen: track.time,
        };
        self.tracker.moving().map(mover).collect()
    }
}

/// Features as the pose step takes them.
#[must_use]
pub fn observations(lines: &[Segment], features: &FloorFeatures) -> Observations {
    let edges = features.edges.iter().map(|edge| {
        let line = &lines[edge.segment];
        EdgeObservation {
            start: line.start,
            end: line.end,
            covariance: line.covariance,
            confidence: edge.confidence,
        }
    });
    let corners = features.corners.iter().map(|corner| CornerObservation {
        pixel: corner.pixel,
        covariance: corner.covariance,
        confidence: corner.confidence,
        edge: corner.edge,
    });
    Observations {
        edges: edges.collect(),
        corners: corners.collect(),
    }
}
