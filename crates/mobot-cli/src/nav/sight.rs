//! What the camera is good for: pose fixes against a floor plan, and things that move on the floor.

use linefeat::{FloorState, ObstacleParams, ObstacleTracker};
use mobot_hw::CameraFrame;
use monocal::{FloorCamera, FloorPlan, LocateParams, PoseFix, Prior, Undetermined, locate};
use occgrid::{CellState, Point2, Pose2};

use super::swath::SwathMap;
use super::{Eye, Mover, Thresholds};

/// A calibrated camera and the plan of what it may see.
#[derive(Debug)]
pub struct Sight {
    eye: Eye,
    plan: FloorPlan,
    params: LocateParams,
    /// From the first frame on.
    tracker: Option<ObstacleTracker>,
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
        Ok(Self {
            // thresholds of the frame give more fixes, and with them a kidnapped robot neither found itself nor said
            // that it was lost: what the filter concludes from fixes was measured with these
            eye: Eye::new(&camera, Thresholds::Fixed)?,
            plan,
            params,
            tracker: None,
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
        let fits = self.eye.camera().image_size.is_none_or(|s| s == size);
        let newer = self.sequence.is_none_or(|s| frame.sequence > s);
        if fits && newer {
            self.sequence = Some(frame.sequence);
        }
        fits && newer
    }

    /// The pose that a frame shows near the prior.
    pub fn fix(&mut self, frame: &CameraFrame, prior: &Prior) -> PoseFix {
        self.eye.look(&frame.image);
        self.fix_again(prior)
    }

    /// The same for the last frame and another prior.
    #[must_use]
    pub fn fix_again(&self, prior: &Prior) -> PoseFix {
        let (seen, camera) = (self.eye.seen(), self.eye.camera());
        locate(seen, &self.plan, camera, prior, &self.params)
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
        let Some((image, view)) = self.eye.flattened(&frame.image) else {
            return vec![];
        };
        let fresh = || ObstacleTracker::new(view, ObstacleParams::default());
        let tracker = self.tracker.get_or_insert_with(fresh);
        tracker.update(image, frame.stamp, [x, y, theta], &floor);
        let direction = Pose2::new(0.0, 0.0, map_from_odom.theta);
        let mover = |track: &linefeat::Track| Mover {
            position: map_from_odom
                .transform_from(Point2::new(track.position[0], track.position[1])),
            velocity: direction.transform_from(Point2::new(track.velocity[0], track.velocity[1])),
            seen: track.time,
        };
        tracker.moving().map(mover).collect()
    }
}
