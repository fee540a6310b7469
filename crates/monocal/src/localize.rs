//! A pose fix from floor features against a floor plan (Choi, Ryu, Kim 1999, section 3.2).
//!
//! The unknowns are the pose and, as nuisances with their own priors, how far the camera nods and rolls in
//! this frame and the calibration's eight degrees of freedom: errors that all features of a frame share are
//! so counted once, not once a feature. Which feature is which wall or corner is decided jointly (Neira,
//! Tardos 2001): a feature is taken only where it agrees with all that were taken before it, every other
//! reading of the frame is weighed against the best one, and where one that puts the robot elsewhere is not
//! far less likely, what the readings do not agree on is left out and the answer is called ambiguous.

mod associate;
mod belief;
mod doubt;
mod feature;
mod landmarks;
mod model;
mod solve;
mod update;
mod view;

use occgrid::Pose2;

use crate::{FloorCamera, FloorPlan};

/// A point where a door's vertical edge meets the floor, as seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerObservation {
    /// Where in the picture (u, v) [px].
    pub pixel: [f64; 2],
    /// Covariance of the pixel [px^2].
    pub covariance: [[f64; 2]; 2],
    /// Probability that it is a door corner, 0 to 1.
    pub confidence: f64,
    /// Index of the floor edge on which it was constructed, if any: across that edge it says nothing that the
    /// edge does not.
    pub edge: Option<usize>,
}

/// A straight line where a wall meets the floor, as seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeObservation {
    /// One end (u, v) [px].
    pub start: [f64; 2],
    /// The other end (u, v) [px].
    pub end: [f64; 2],
    /// Covariance of (rho, theta), its normal form about the centre of pixel (0, 0), theta from 0 to below pi
    /// [px^2, px rad, rad^2].
    pub covariance: [[f64; 2]; 2],
    /// Probability that it is a floor edge, 0 to 1.
    pub confidence: f64,
}

/// What a frame shows of the floor plan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Observations {
    /// Floor edges.
    pub edges: Vec<EdgeObservation>,
    /// Door corners.
    pub corners: Vec<CornerObservation>,
}

/// Where the robot is thought to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// `map_from_base`.
    pub pose: Pose2,
    /// Covariance of (x, y, theta) in the map frame [m^2, m rad, rad^2], positive definite.
    pub covariance: [[f64; 3]; 3],
}

/// Parameters of [`locate`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocateParams {
    /// One sigma of the camera's nodding about its calibrated tilt [rad], 0 or more. Raised: frames taken
    /// while braking fit, and lone edges say less.
    pub pitch_sigma: f64,
    /// One sigma of its rolling [rad], 0 or more. Raised: as for nodding.
    pub roll_sigma: f64,
    /// One sigma of the systematic part of a feature's place [px], 0 or more: shading, skirting, blur. Raised:
    /// a fix trusts the picture less.
    pub bias_px: f64,
    /// One sigma by which two verticals that run into each other in the picture move each other, at most [px],
    /// 0 or more: a door's frame from afar. Raised: a lone stripe says less of which door it is.
    pub crowd_px: f64,
    /// One sigma of the plan's points [m], 0 or more. Raised: rough plans fit, and a fix trusts the plan less.
    pub plan_sigma: f64,
    /// A pose coordinate counts as observed where the frame alone measures it to this sigma or better [m].
    pub observed_position: f64,
    /// As `observed_position`, for the heading [rad].
    pub observed_heading: f64,
    /// By how much a reading of the frame that puts the robot elsewhere must be less likely [natural log of
    /// the ratio], 0 or more. Raised: fewer wrong doors, more ambiguous answers.
    pub margin: f64,
    /// How many partial readings are looked at, above 0; past it the answer is ambiguous. Raised: crowded
    /// frames are resolved, and take longer (about 0.5 us each).
    pub most_steps: u32,
}

impl Default for LocateParams {
    fn default() -> Self {
        Self {
            pitch_sigma: 0.6_f64.to_radians(),
            roll_sigma: 0.2_f64.to_radians(),
            bias_px: 0.005,
            crowd_px: 0.6,
            plan_sigma: 0.003,
            observed_position: 0.02,
            observed_heading: 0.5_f64.to_radians(),
            margin: 6.0,
            most_steps: 8000,
        }
    }
}

/// What became of a pose fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FixStatus {
    /// Position and heading were observed.
    Ok,
    /// Some of x, y, theta were observed; for the others the answer is the prior. Normal in a bare corridor.
    Partial,
    /// The frame fits in more than one place. What all of them agree on is in the answer.
    Ambiguous,
    /// Nothing of the plan is in view from near the prior, or nothing is seen: the answer is the prior.
    NoMatch,
    /// The prior says that the plan is in view, and the frame shows floor edges or corners, but next to none of
    /// them is in the plan there: the prior, the plan or the calibration is wrong. The answer is the prior.
    Lost,
}

impl FixStatus {
    /// As commands print it: `ok`, `partial`, `ambiguous`, `no_match`, `lost`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Partial => "partial",
            Self::Ambiguous => "ambiguous",
            Self::NoMatch => "no_match",
            Self::Lost => "lost",
        }
    }
}

/// Which pose coordinates the frame measured, in the map frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Observed {
    /// Along the map's x axis.
    pub x: bool,
    /// Along the map's y axis.
    pub y: bool,
    /// The heading.
    pub theta: bool,
}

/// A direction in the map and how well the frame alone measures the position along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionAxis {
    /// Unit vector (x, y) in the map frame.
    pub direction: [f64; 2],
    /// One sigma without the prior [m]; large where the frame says nothing.
    pub sigma: f64,
    /// Whether that is good enough to count.
    pub observed: bool,
}

/// A feature and what it was taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Match {
    /// A floor edge: indices into the observations' edges and the plan's walls.
    Edge {
        /// As seen.
        edge: usize,
        /// In the plan.
        wall: usize,
    },
    /// A door corner: indices into the observations' corners and the plan's.
    Corner {
        /// As seen.
        corner: usize,
        /// In the plan.
        door_corner: usize,
    },
}

/// A pose and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseFix {
    /// What became of it.
    pub status: FixStatus,
    /// `map_from_base`, prior and frame together; heading in -pi to pi.
    pub pose: Pose2,
    /// Covariance of (x, y, theta) in the map frame [m^2, m rad, rad^2].
    pub covariance: [[f64; 3]; 3],
    /// What the frame alone measured, prior aside.
    pub observed: Observed,
    /// The best and the worst measured direction of the position; both unmeasured where nothing matched.
    pub axes: [PositionAxis; 2],
    /// The features that were used.
    pub matched: Vec<Match>,
    /// How far the camera nodded down from its calibrated tilt in this frame [rad], as estimated.
    pub pitch: f64,
}

/// The pose from which the camera sees these features of the plan, near the prior.
///
/// Observations that are not finite, and covariances that are none, are passed over. Time is bounded by
/// [`LocateParams::most_steps`] and linear in the plan. A prior wider than 0.3 m is searched in parts, out to
/// 2.5 sigmas and at most 3 m a side.
#[must_use]
pub fn locate(
    observations: &Observations,
    plan: &FloorPlan,
    camera: &FloorCamera,
    prior: &Prior,
    params: &LocateParams,
) -> PoseFix {
    let model = model::Model::new(camera, params);
    let Some(start) = model.start(prior) else {
        return solve::unchanged(prior, FixStatus::NoMatch);
    };
    let features = model.features(observations);
    let landmarks = model.landmarks(plan, &start);
    let parts = start.parts(landmarks.main_direction());
    let readings = associate::readings(&model, &features, &landmarks, &parts, params);
    solve::fix(&model, &features, &landmarks, &start, &readings, params)
}

impl FloorCamera {
    /// The camera nodded down by an angle [rad] about its own centre, as for [`PoseFix::pitch`]; `None` where
    /// its mounting is not determined, or the floor is out of its sight then.
    #[must_use]
    pub fn nodding(&self, pitch: f64) -> Option<Self> {
        let homography = view::nodded(self, pitch)?;
        Some(Self {
            homography,
            ..self.clone()
        })
    }
}
