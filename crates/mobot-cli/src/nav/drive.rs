//! To a goal on a map: plan, follow, wait, go round, arrive.

use mobot_hw::{Bearings, Twist2};
use occgrid::{OccupancyMap, Point2, Pose2};
use voronoi_plan::{
    ClearanceField, FreeSpace, GraphParams, Plan, Planner, Prune, Route, VoronoiGraph,
};

use super::angle::wrap;
use super::avoid::{AvoidParams, Surprises, too_near};
use super::follow::{FollowParams, Followed, Follower};
use super::{
    Action, Behaviour, Confidence, Event, Motion, Observation, Outcome, SafetyParams, StopCause,
};

/// How a goal is driven to.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveParams {
    /// Radius of the body [m], above 0.
    pub radius: f64,
    /// Distances from what is not free that routes keep, the first one that leads to the goal [m]; each at
    /// least `radius`.
    pub keep: Vec<f64>,
    /// Along the route.
    pub follow: FollowParams,
    /// Off the map.
    pub avoid: AvoidParams,
    /// How long the way may be blocked before another one is looked for [s].
    pub patience: f64,
    /// How long it may be blocked, with no other way, before the goal is given up [s].
    pub blocked: f64,
    /// So many other ways are tried without coming nearer to the goal, before it is given up.
    pub detours: u32,
    /// How long the pose may be lost or uncertain before the goal is given up [s].
    pub lost: f64,
    /// Within this of the goal the robot has arrived [m].
    pub arrived: f64,
    /// Within this of the goal's heading it has arrived [rad].
    pub arrived_heading: f64,
    /// And the pose is known this well, one sigma of the position [m].
    pub sure: f64,
    /// One sigma of the heading [rad].
    pub sure_heading: f64,
    /// The mission may take so long [s].
    pub budget: f64,
}

impl DriveParams {
    /// For a round body of this radius [m].
    #[must_use]
    pub fn of(radius: f64) -> Self {
        let safety = SafetyParams::default();
        Self {
            radius,
            // where nothing is nearer than what safety stops for, it never stops for what the map shows
            keep: [safety.margin + 0.03, 0.1, 0.05]
                .map(|room| radius + room)
                .to_vec(),
            follow: FollowParams::default(),
            avoid: AvoidParams::default(),
            patience: 3.0,
            blocked: 60.0,
            detours: 8,
            lost: 40.0,
            arrived: 0.05,
            arrived_heading: 2.0_f64.to_radians(),
            sure: 0.04,
            sure_heading: 2.0_f64.to_radians(),
            budget: f64::INFINITY,
        }
    }
}

impl Default for DriveParams {
    /// For a small round base.
    fn default() -> Self {
        Self::of(SafetyParams::default().radius)
    }
}

/// Where to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Map frame [m].
    pub place: Point2,
    /// Heading to end with [rad].
    pub heading: Option<f64>,
}

/// Drives to a goal.
#[derive(Debug)]
pub struct Drive {
    params: DriveParams,
    map: OccupancyMap,
    goal: Goal,
    /// Without surprises, one for each distance to keep, made when needed.
    planners: Vec<Option<Planner>>,
    field: ClearanceField,
    follower: Option<Follower>,
    began: Option<f64>,
    planned: f64,
    /// Since when each of these lasts [s].
    blocked: Option<f64>,
    waiting: Option<f64>,
    lost: Option<f64>,
    settling: Option<f64>,
    attempts: u32,
    sweep: u32,
    /// The least way that was left to the goal so far [m].
    nearest: f64,
    /// Ways tried since.
    detours: u32,
    /// Near the goal, and not sure where.
    searching: bool,
}

/// Frames need this long to settle the pose of a robot that stands [s].
const SETTLING: f64 = 0.7;
/// Routes are looked for again at most this often [s].
const REPLAN: f64 = 1.5;
/// A robot that came nearer to its goal by this makes progress [m].
const PROGRESS: f64 = 0.5;
/// How far ahead on the route surprises count [m].
const HORIZON: f64 = 2.5;
/// Attempts at the last centimetres.
const ATTEMPTS: u32 = 5;

impl Drive {
    /// To a goal on a map.
    #[must_use]
    pub fn new(map: OccupancyMap, goal: Goal, params: DriveParams) -> Self {
        let field = ClearanceField::new(&FreeSpace::from_map(&map));
        Self {
            planners: params.keep.iter().map(|_| None).collect(),
            params,
            map,
            goal,
            field,
            follower: None,
            began: None,
            planned: f64::NEG_INFINITY,
            blocked: None,
            waiting: None,
            lost: None,
            settling: None,
            attempts: 0,
            sweep: 0,
            nearest: f64::INFINITY,
            detours: 0,
            searching: false,
        }
    }

    /// A route from a place, around what was found on the way.
    fn route(&mut self, from: Point2, surprises: &Surprises) -> Result<Route, Plan> {
        let surprised = surprises.things().next().is_some();
        let changed = surprised.then(|| surprises.on(&self.map, from, self.params.radius));
        let mut answer = None;
        for (index, keep) in self.params.keep.iter().enumerate() {
            let plan = match &changed {
                Some(map) => planner(map, *keep).plan(from, self.goal.place),
                None => self.planners[index]
                    .get_or_insert_with(|| planner(&self.map, *keep))
                    .plan(from, self.goal.place),
            };
            match plan {
                Plan::Ok(route) => return Ok(route),
                // what the widest distance says names the narrowest place
                other => {
                    answer.get_or_insert(other);
                }
            }
        }
        Err(answer.unwrap_or(Plan::Outside))
    }

    fn plan(&mut self, seen: &Observation<'_>, why: &'static str) -> Result<Event, Plan> {
        self.planned = seen.now;
        let route = self.route(seen.pose.map_from_base.position(), seen.surprises)?;
        let event = Event::Planned {
            length: route.length,
            clearance: route.clearance,
            why,
            points: route.points.clone(),
        };
        self.follower = Some(Follower::new(
            route.points,
            self.goal.heading,
            self.params.follow,
        ));
        Ok(event)
    }

    /// Speed that the room beside the robot allows [m/s].
    fn cap(&self, seen: &Observation<'_>) -> f64 {
        let frame = self.map.frame();
        let at = frame.grid_from_map(seen.pose.map_from_base.position());
        let room = self.field.of_point(at) * frame.resolution() - self.params.radius;
        (0.12 + 0.8 * room.max(0.0)).min(self.params.follow.speed)
    }

    /// Stands or turns until the pose is known again.
    fn find_pose(&mut self, seen: &Observation<'_>) -> Action {
        let since = *self.lost.get_or_insert(seen.now);
        let lasts = seen.now - since;
        if lasts > self.params.lost {
            let why = match seen.pose.confidence {
                Confidence::Lost => "lost: what is seen does not fit the map around here",
                Confidence::Tracking => {
                    "near the goal, but nothing to make sure of it by is in view"
                }
                Confidence::Uncertain => "pose too uncertain: nothing to correct it by is in view",
            };
            return Action::done(Outcome::GaveUp(why.to_owned()));
        }
        // two seconds of standing, then an eighth of a turn
        let phase = lasts % 3.0;
        if phase < 2.0 {
            self.sweep += 1;
            let bearing = direction(seen.bearings, self.sweep);
            return Action::stand("looking for the pose").aiming(bearing);
        }
        Action::drive(Twist2::new(0.0, 0.8))
    }

    fn near_somebody(&self, seen: &Observation<'_>, command: Twist2) -> bool {
        let pose = seen.pose.map_from_base;
        let (sin, cos) = pose.theta.sin_cos();
        let velocity = Point2::new(command.linear * cos, command.linear * sin);
        let near = |velocity| {
            seen.movers
                .iter()
                .any(|m| too_near(m, pose.position(), velocity, seen.now, &self.params.avoid))
        };
        command.linear != 0.0 && near(velocity)
    }

    /// Whether something new stands on the next piece of the route.
    fn way_is_taken(&self, surprises: &Surprises) -> bool {
        let Some(follower) = &self.follower else {
            return false;
        };
        let steps = (HORIZON / 0.1) as u32;
        let places: Vec<Point2> = (0..=steps)
            .map(|k| follower.at(follower.progress() + 0.1 * f64::from(k)))
            .collect();
        surprises.block(&places, self.params.radius + 0.02)
    }

    fn arrive(&mut self, seen: &Observation<'_>) -> Action {
        let since = *self.settling.get_or_insert(seen.now);
        if seen.now - since < SETTLING {
            return Action::stand("settling at the goal");
        }
        let p = &self.params;
        if seen.pose.position_sigma() > p.sure || seen.pose.heading_sigma() > p.sure_heading {
            // nothing to see from here: look round, and come back
            self.searching = true;
            return self.find_pose(seen);
        }
        let pose = seen.pose.map_from_base;
        let off = pose.position().distance(self.goal.place);
        let turned = self
            .goal
            .heading
            .map_or(0.0, |h| wrap(h - pose.theta).abs());
        let there = off <= self.params.arrived && turned <= self.params.arrived_heading;
        self.attempts += 1;
        if there || self.attempts >= ATTEMPTS {
            return if off <= 2.0 * self.params.arrived {
                Action::done(Outcome::Done)
            } else {
                let why = format!("stopped {off:.2} m from the goal");
                Action::done(Outcome::GaveUp(why))
            };
        }
        self.settling = None;
        let points = vec![pose.position(), self.goal.place];
        self.follower = Some(Follower::new(points, self.goal.heading, self.params.follow));
        Action::stand("once more to the goal")
    }

    fn give_up(&self, plan: &Plan) -> Action {
        let why = match plan {
            Plan::NoRoute { bottleneck } => format!(
                "no route: the best way is {:.2} m wide at ({:.2}, {:.2})",
                bottleneck.width, bottleneck.place.x, bottleneck.place.y
            ),
            other => other.status().to_string().replace('_', " "),
        };
        Action::done(Outcome::GaveUp(why))
    }

    /// Ways that are tried are counted anew where the robot came nearer.
    fn notice_progress(&mut self) {
        let left = self.follower.as_ref().map_or(f64::INFINITY, Follower::left);
        if left <= self.nearest - PROGRESS || self.nearest.is_infinite() {
            self.nearest = left;
            self.detours = 0;
        }
    }

    /// When the way is blocked: wait, look for another way, give up; in this order.
    fn blocked(&mut self, seen: &Observation<'_>) -> Option<Action> {
        let obstacle = matches!(
            seen.stopped,
            Some(StopCause::Obstacle { .. } | StopCause::Silence)
        );
        let taken = self.way_is_taken(seen.surprises);
        if !obstacle && !taken {
            self.blocked = None;
            return None;
        }
        let since = *self.blocked.get_or_insert(seen.now);
        let lasts = seen.now - since;
        if lasts > self.params.blocked {
            let why = "the way is blocked, and there is no other".to_owned();
            return Some(Action::done(Outcome::GaveUp(why)));
        }
        let away = self.goal.place.distance(seen.pose.map_from_base.position());
        if obstacle && away <= 2.0 * self.params.arrived {
            // as near as it is safe
            let here = vec![seen.pose.map_from_base.position()];
            self.follower = Some(Follower::new(here, self.goal.heading, self.params.follow));
            return None;
        }
        // what is new may be somebody who walks on: who moves towards people in a beam this narrow meets them
        let impatient = lasts >= self.params.patience;
        if impatient && seen.now - self.planned >= REPLAN {
            self.detours += 1;
            if self.detours > self.params.detours {
                let why = "the way is blocked, and so are the others that were tried".to_owned();
                return Some(Action::done(Outcome::GaveUp(why)));
            }
            return Some(match self.plan(seen, "the way is blocked") {
                Ok(event) => Action::stand("new route").saying(event),
                Err(_) => Action::stand("no other way: waiting"),
            });
        }
        if taken && !impatient {
            return Some(Action::stand("waiting for what is in the way"));
        }
        if obstacle && seen.twist.linear.abs() > 1e-3 {
            return Some(Action::stand("the way is blocked"));
        }
        None
    }

    fn follow(&mut self, seen: &Observation<'_>) -> Action {
        let cap = self.cap(seen);
        let Some(follower) = &mut self.follower else {
            return Action::stand("no route");
        };
        match follower.step(seen.pose.map_from_base, cap) {
            Followed::Arrived => self.arrive(seen),
            Followed::Drive(wanted) => {
                self.settling = None;
                if self.near_somebody(seen, wanted) {
                    self.waiting.get_or_insert(seen.now);
                    return Action::stand("letting somebody pass");
                }
                self.waiting = None;
                Action::drive(wanted)
            }
        }
    }
}

impl Behaviour for Drive {
    fn step(&mut self, seen: &Observation<'_>) -> Action {
        let began = *self.began.get_or_insert(seen.now);
        if seen.now - began > self.params.budget {
            return Action::done(Outcome::BudgetOver);
        }
        if let Some(halt) = seen.halt {
            if halt.cause.needs_a_person() {
                return Action::done(Outcome::Stopped(halt.cause));
            }
            return Action {
                motion: Motion::Resume,
                ..Action::stand("resuming")
            };
        }
        let p = &self.params;
        let sure =
            || seen.pose.position_sigma() < p.sure && seen.pose.heading_sigma() < p.sure_heading;
        self.searching = self.searching && !sure();
        if seen.pose.confidence != Confidence::Tracking || self.searching {
            return self.find_pose(seen);
        }
        if self.lost.take().is_some() {
            self.follower = None;
            self.nearest = f64::INFINITY;
        }
        self.notice_progress();
        let off = |f: &Follower| f.off_route(seen.pose.map_from_base) > 0.3;
        if self.follower.as_ref().is_none_or(off) {
            let why = if self.follower.is_none() {
                "to the goal"
            } else {
                "off the route"
            };
            return match self.plan(seen, why) {
                Ok(event) => Action::stand("route planned").saying(event),
                Err(plan) => self.give_up(&plan),
            };
        }
        if let Some(action) = self.blocked(seen) {
            return action;
        }
        self.follow(seen)
    }
}

/// The next direction of a look round with a sonar of this reach: 18 degrees from the one before, as the
/// paper's shots are.
fn direction(reach: Bearings, index: u32) -> f64 {
    let step = 18.0_f64.to_radians();
    let most = (std::f64::consts::TAU - step).min(reach.to - reach.from);
    let shots = (most / step).floor() as u32 + 1;
    reach.from + f64::from(index % shots) * step
}

/// A planner that keeps a distance.
fn planner(map: &OccupancyMap, keep: f64) -> Planner {
    let space = FreeSpace::from_map(map);
    let params = GraphParams {
        radius: keep,
        prune: Prune::default(),
    };
    let graph = VoronoiGraph::build(&space, &params).expect("a finite distance of 0 or more");
    Planner::new(&space, &graph, ClearanceField::new(&space))
}

/// Where a goal's heading is none: whatever the way ends with.
impl From<Point2> for Goal {
    fn from(place: Point2) -> Self {
        Self {
            place,
            heading: None,
        }
    }
}

/// A goal with a heading.
impl From<Pose2> for Goal {
    fn from(pose: Pose2) -> Self {
        Self {
            place: pose.position(),
            heading: Some(pose.theta),
        }
    }
}
