//! Where an exploring robot stops next: along the wall while it leads to new places, then at the best frontier.

use occgrid::{Point2, Pose2};

use super::frontier::{FrontierParams, frontiers};
use super::reach::{Reach, ReachParams};
use super::seen::Seen;
use super::wall_follow::{Along, WallFollowParams, along_the_wall};

/// How the next stop is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ItineraryParams {
    /// Room that ways have.
    pub reach: ReachParams,
    /// The way along the walls.
    pub wall: WallFollowParams,
    /// What comes after it.
    pub frontier: FrontierParams,
    /// How the robot feels its way.
    pub feel: FeelParams,
}

/// How far the robot goes from where it has looked around: thin things, as door leaves, are only heard square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeelParams {
    /// From the nearest stop in narrow places [m].
    pub narrow: f64,
    /// From the nearest stop elsewhere [m], at least `narrow`.
    pub wide: f64,
    /// A place is narrow with less room than this beside the body [m].
    pub room: f64,
}

impl Default for FeelParams {
    fn default() -> Self {
        Self {
            narrow: 0.45,
            wide: 1.0,
            room: 0.25,
        }
    }
}

/// Why a stop was chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reason {
    /// It is the next one along the wall.
    Wall,
    /// It shows floor that was not looked at from near.
    Frontier,
}

/// The way to the next stop.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// From here to the stop, straight from point to point.
    pub way: Vec<Point2>,
    /// Why there.
    pub reason: Reason,
    /// The wall led back to this known stop just now: a loop is closed.
    pub closed_at: Option<Point2>,
}

/// Ways are felt this often [m].
const FEEL_STEP: f64 = 0.05;

/// Remembers what could not be reached.
#[derive(Debug, Clone, Default)]
pub struct Itinerary {
    params: ItineraryParams,
    refused: Vec<Point2>,
    following: bool,
}

impl Itinerary {
    /// Begins along the wall.
    #[must_use]
    pub const fn new(params: ItineraryParams) -> Self {
        Self {
            params,
            refused: Vec::new(),
            following: true,
        }
    }

    /// A stop that could not be reached is not asked for again, nor is what lies around it.
    pub fn refuse(&mut self, place: Point2) {
        self.refused.push(place);
        self.following = false;
    }

    /// The next leg from where the robot stands, heading as it arrived; `None` when nothing is left.
    pub fn next(&mut self, seen: &Seen, here: Pose2) -> Option<Leg> {
        let reach = Reach::from(seen.free_space(), here.position(), self.params.reach);
        let stops: Vec<Point2> = seen.stops().collect();
        let mut closed_at = None;
        match along_the_wall(&reach, here, &stops, &self.params.wall) {
            Along::Next(stop) if !self.is_refused(stop) => {
                self.following = true;
                let way = vec![here.position(), stop];
                return Some(Leg {
                    way: self.felt(way, &reach, &stops),
                    reason: Reason::Wall,
                    closed_at,
                });
            }
            Along::Known(stop) => closed_at = Some(stop).filter(|_| self.following),
            Along::Next(_) | Along::Nowhere => {}
        }
        self.following = false;
        let found = frontiers(
            &reach,
            &seen.open_space(),
            &stops,
            &self.refused,
            &self.params.frontier,
        );
        // a way may end early: what was refused there is refused for all frontiers behind it
        let way = found.iter().find_map(|f| {
            let way = self.felt(reach.way_to(f.stop)?, &reach, &stops);
            let end = *way.last()?;
            (!self.is_refused(end)).then_some(way)
        })?;
        Some(Leg {
            way,
            reason: Reason::Frontier,
            closed_at,
        })
    }

    /// A way up to where it leaves the surroundings of all stops.
    fn felt(&self, way: Vec<Point2>, reach: &Reach, stops: &[Point2]) -> Vec<Point2> {
        let p = self.params.feel;
        let frame = reach.space().frame();
        let too_far = |at: Point2| {
            let room = frame.cell_at(at).map_or(0.0, |cell| reach.margin(cell));
            let most = if room < p.room { p.narrow } else { p.wide };
            stops.iter().all(|stop| stop.distance(at) > most)
        };
        let mut felt = vec![way[0]];
        for piece in way.windows(2) {
            let length = piece[0].distance(piece[1]);
            let steps = (length / FEEL_STEP).ceil().max(1.0);
            for k in 1..=steps as u32 {
                let t = f64::from(k) / steps;
                let at = Point2::new(
                    piece[0].x + t * (piece[1].x - piece[0].x),
                    piece[0].y + t * (piece[1].y - piece[0].y),
                );
                if too_far(at) {
                    felt.push(at);
                    return felt;
                }
            }
            felt.push(piece[1]);
        }
        felt
    }

    fn is_refused(&self, stop: Point2) -> bool {
        let near = self.params.frontier.refused;
        self.refused.iter().any(|r| r.distance(stop) <= near)
    }
}
