//! Things that move on the floor: two frames, the odometry between them and the view of the floor give
//! floor regions that moved; a tracker gives their position and velocity.
//!
//! Where nothing moves, the last frame warped by the floor's homography shows the floor as this frame
//! does, and so do things that stand on it near their feet: within a tenth of a second their parallax is
//! below a pixel. What differs by more than a neighbour pixel and the noise explain has moved.
//!
//! A thing at rest *above* the floor (a table top, a poster) can look like one that comes nearer on it.
//! Each track is therefore tried as a point at rest at some height, too; it counts as moving only where
//! that does not explain what was seen, or where the map knows that nothing stands there.

mod change;
mod fan;
mod feet;
mod memory;
mod shift;
mod track;

use std::collections::VecDeque;

use image::GrayImage;

use self::change::Change;
use self::fan::Fan;
use self::feet::Feet;
use self::memory::{Memory, Scratch};
pub use self::track::Track;
use self::track::Tracks;
use crate::floor_view::{FloorView, product, times};

/// What a map knows about a place on the floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum FloorState {
    /// Floor, and nothing stands on it for good.
    Free,
    /// A wall, a piece of furniture.
    Solid,
    /// Not on the map.
    Unknown,
}

/// How moving things are found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ObstacleParams {
    /// How far from the camera feet are looked for [m], above 0. Raised: far things earlier, coarser.
    /// Default 6.
    pub max_range: f64,
    /// Least difference that is a change [gray levels], 1 to 255; five times the noise where that is
    /// more. Raised: dark things on dark floors are missed. Default 8.
    pub least_change: f64,
    /// A frame is compared with the oldest one that is at most this much older [s], above 0. Raised:
    /// slower things are seen, and farther; memory for more frames. Default 0.21.
    pub gap: f64,
    /// Two changed strips at most this far apart at the same distance are the two sides of one thing
    /// [m]. Raised: people side by side become one. Default 0.65.
    pub max_width: f64,
    /// How much a velocity may wander within a second, one sigma [m/s]. Raised: quicker to follow turns,
    /// noisier velocities. Default 0.3.
    pub wander: f64,
    /// Least speed that counts as moving [m/s]. Default 0.2.
    pub least_speed: f64,
    /// Least width of what counts as moving [m]. Raised: people seen from the side are missed; lowered:
    /// what comes into view behind the edges of furniture counts. Default 0.25.
    pub least_width: f64,
}

impl Default for ObstacleParams {
    fn default() -> Self {
        Self {
            max_range: 6.0,
            least_change: 8.0,
            gap: 0.21,
            max_width: 0.65,
            wander: 0.3,
            least_speed: 0.2,
            least_width: 0.25,
        }
    }
}

/// A place on the floor that something left or came to between two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MovedRegion {
    /// Middle of the foot of what moved, halfway between the two frames; odometry frame [m]. Where it
    /// moved along the line of sight, of the nearer of both places.
    pub position: [f64; 2],
    /// Of `position` [m^2].
    pub covariance: [[f64; 2]; 2],
    /// Halfway between the two frames [s].
    pub time: f64,
    /// Between the two frames [s].
    pub gap: f64,
    /// Across the line of sight, both places of the thing together [m].
    pub width: f64,
    /// Whether the picture's edge hides a part of it: its middle is not seen then.
    pub cut_off: bool,
    /// Where the camera's foot was halfway between the frames; odometry frame [m].
    pub camera: [f64; 2],
}

/// A frame is kept if this share of the gap has passed since the last one that was.
const LEAST_APART: f64 = 1.0 / 16.0;

/// So many frames are kept at most, and the one that is taken.
const MOST_FRAMES: usize = 18;

/// Finds and follows what moves on the floor. Nothing is allocated after the first frames of a size: as many
/// as the gap holds, and one.
#[derive(Debug)]
pub struct ObstacleTracker {
    view: FloorView,
    params: ObstacleParams,
    fan: Fan,
    /// Frames not older than the gap, oldest first.
    recent: VecDeque<(Moment, Memory)>,
    /// Memory of frames that grew too old.
    spare: Vec<Memory>,
    scratch: Scratch,
    change: Change,
    feet: Feet,
    regions: Vec<MovedRegion>,
    tracks: Tracks,
}

/// When and where a frame was taken.
#[derive(Clone, Copy, Debug)]
struct Moment {
    time: f64,
    odom_from_base: [f64; 3],
}

impl ObstacleTracker {
    /// A tracker for one camera.
    #[must_use]
    pub fn new(view: FloorView, params: ObstacleParams) -> Self {
        Self {
            view,
            params,
            fan: Fan::default(),
            recent: VecDeque::with_capacity(MOST_FRAMES),
            spare: Vec::with_capacity(MOST_FRAMES),
            scratch: Scratch::default(),
            change: Change::default(),
            feet: Feet::default(),
            regions: Vec::new(),
            tracks: Tracks::new(),
        }
    }

    /// Takes a frame of `time` [s], seen from `odom_from_base` (x [m], y [m], heading [rad]), and what a
    /// map, if there is one, knows about the floor (odometry frame). Linear in the pixels.
    pub fn update(
        &mut self,
        frame: &GrayImage,
        time: f64,
        odom_from_base: [f64; 3],
        floor: &dyn Fn([f64; 2]) -> FloorState,
    ) {
        let now = Moment {
            time,
            odom_from_base,
        };
        let too_old = |moment: &Moment| {
            let age = time - moment.time;
            !(age > 0.0 && age <= self.params.gap)
        };
        while self
            .recent
            .front()
            .is_some_and(|(moment, _)| too_old(moment))
        {
            self.spare
                .extend(self.recent.pop_front().map(|(_, memory)| memory));
        }
        let mut current = self.spare.pop().unwrap_or_default();
        current.take(frame, &mut self.scratch);
        self.regions.clear();
        if let Some((then, previous)) = self.recent.front()
            && current.size() == previous.size()
        {
            let warp = previous_from_current(&self.view, then, &now);
            if self.fan.size != current.size() {
                self.fan = Fan::new(&self.view, current.size(), self.params.max_range);
            }
            let changed = self
                .change
                .find(&current, previous, &warp, &self.fan, &self.params);
            self.feet.regions(
                changed,
                &self.fan,
                self.view.camera_foot(),
                &self.params,
                [*then, now],
                &mut self.regions,
            );
            self.regions
                .retain(|region| floor(region.position) != FloorState::Solid);
        }
        let apart = |(last, _): &(Moment, _)| time - last.time >= LEAST_APART * self.params.gap;
        if self.recent.back().is_none_or(apart) {
            self.recent.push_back((now, current));
        } else {
            self.spare.push(current);
        }
        self.tracks.update(&self.regions, time, &self.params, floor);
    }

    /// What moved between the last frame and the one that it was compared with.
    #[must_use]
    pub fn regions(&self) -> &[MovedRegion] {
        &self.regions
    }

    /// What is followed, whether it is known to move or not; oldest first.
    #[must_use]
    pub fn tracks(&self) -> &[Track] {
        self.tracks.all()
    }

    /// What is known to move; oldest first.
    pub fn moving(&self) -> impl Iterator<Item = &Track> + '_ {
        self.tracks.all().iter().filter(|track| track.moving)
    }
}

/// The homography under which the floor of this frame lies in the last one.
fn previous_from_current(view: &FloorView, last: &Moment, now: &Moment) -> [[f64; 3]; 3] {
    let base = product(
        &matrix(inverse(last.odom_from_base)),
        &matrix(now.odom_from_base),
    );
    product(
        &view.floor_to_pixel(),
        &product(&base, &view.pixel_to_floor),
    )
}

fn matrix([x, y, theta]: [f64; 3]) -> [[f64; 3]; 3] {
    let (sin, cos) = theta.sin_cos();
    [[cos, -sin, x], [sin, cos, y], [0.0, 0.0, 1.0]]
}

fn inverse([x, y, theta]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = theta.sin_cos();
    [-(cos * x + sin * y), sin * x - cos * y, -theta]
}

/// A point given in a pose's frame, in the frame in which the pose is given.
fn transform([x, y, theta]: [f64; 3], point: [f64; 2]) -> [f64; 2] {
    let [px, py, _] = times(&matrix([x, y, theta]), [point[0], point[1], 1.0]);
    [px, py]
}
