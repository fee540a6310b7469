//! What a simulated robot sees of a building that it knows: frame, camera, floor plan, and where it was.

use image::GrayImage;
use mobot_cli::nav::{Eye, Thresholds, calibrated};
use mobot_cli::world;
use mobot_hw::sim::{CameraModel, Distortion, Look, Renderer};
use monocal::{FloorPlan, LocateParams, PoseFix, Prior, locate};
use occgrid::Pose2;

/// A frame of 640 x 480 down a corridor, and all that is needed to tell from where.
#[derive(Debug)]
pub struct View {
    /// Its pixels.
    pub frame: GrayImage,
    /// `map_from_base` when it was taken.
    pub map_from_base: Pose2,
    eye: Eye,
    plan: FloorPlan,
    prior: Prior,
}

impl View {
    /// Down the corridor of the office: doors on both sides, a tiled floor, noise and blur as sensors have them.
    ///
    /// # Panics
    /// Never: the world and its camera are built in.
    #[must_use]
    pub fn corridor(distortion: Distortion) -> Self {
        let world = world::load("office", None).expect("a built-in world");
        let model = CameraModel {
            distortion,
            ..CameraModel::vga()
        };
        let map_from_base = Pose2::new(1.5, 0.1, 0.03);
        let mut renderer = Renderer::new(model, Look::default()).expect("a camera");
        let plan = FloorPlan {
            walls: world.floor_outline(),
            door_corners: world.door_corners().iter().map(|c| c.position).collect(),
        };
        Self {
            frame: renderer.render(&world, map_from_base, 0.0, 1),
            map_from_base,
            eye: Eye::new(
                &calibrated(&model).expect("marks in sight"),
                Thresholds::OfFrame,
            )
            .expect("a mounting"),
            plan,
            prior: Prior {
                pose: Pose2::new(1.58, 0.03, 0.06),
                covariance: [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.0025]],
            },
        }
    }

    /// From the frame to the pose, as `mobot locate` and the mission do it: edges, segments, floor features, fix.
    pub fn locate(&mut self) -> PoseFix {
        self.eye.look(&self.frame);
        let (seen, camera) = (self.eye.seen(), self.eye.camera());
        locate(
            seen,
            &self.plan,
            camera,
            &self.prior,
            &LocateParams::default(),
        )
    }

    /// How far a fix is from where the frame was taken [m], [rad].
    #[must_use]
    pub fn error(&self, fix: &PoseFix) -> [f64; 2] {
        let off = self.map_from_base.inverse().compose(fix.pose);
        [off.x.hypot(off.y), off.theta.abs()]
    }
}
