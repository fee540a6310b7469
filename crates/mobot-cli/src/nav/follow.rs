//! Along a route: pure pursuit that cuts no corner, and an arrival in position and heading.
//!
//! The point that is steered for is the farthest one within reach whose chord stays near the route (Coulter,
//! "Implementation of the Pure Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01; Macenski et al., "Regulated
//! Pure Pursuit for Robot Path Tracking", 2023, for speeds that fall with curvature and clearance). Where it
//! is far to the side the robot turns on the spot first.

use mobot_hw::Twist2;
use occgrid::{Point2, Pose2};

use super::angle::wrap;

/// How a route is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowParams {
    /// Largest speed [m/s], above 0.
    pub speed: f64,
    /// The farthest point steered for [m], above 0. Raised: smoother, slower back on the route.
    pub look_ahead: f64,
    /// The chord to it leaves the route by this much at most [m], above 0. Raised: corners are cut more.
    pub cut: f64,
    /// Turns on the spot where the point is this far to the side [rad], 0.1 to 1.5.
    pub corner: f64,
    /// Largest turn rate [rad/s], above 0.
    pub turn_rate: f64,
    /// Braking that the approach to the goal is planned with [m/s^2], above 0.
    pub braking: f64,
    /// Nearer than this to the goal it is reached [m], above 0.
    pub at_goal: f64,
    /// So near to the goal's heading it is reached [rad], above 0.
    pub at_heading: f64,
}

impl Default for FollowParams {
    fn default() -> Self {
        Self {
            speed: 0.4,
            look_ahead: 0.5,
            cut: 0.03,
            corner: 35.0_f64.to_radians(),
            turn_rate: 1.2,
            braking: 0.3,
            at_goal: 0.02,
            at_heading: 1.0_f64.to_radians(),
        }
    }
}

/// What to do next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Followed {
    /// Drive so.
    Drive(Twist2),
    /// The end of the route is reached, and its heading.
    Arrived,
}

/// A robot's way along one route.
#[derive(Debug, Clone)]
pub struct Follower {
    params: FollowParams,
    points: Vec<Point2>,
    /// Way from the start to each point [m].
    ways: Vec<f64>,
    heading: Option<f64>,
    /// Way along the route so far [m].
    progress: f64,
    turning: bool,
    at_end: bool,
}

impl Follower {
    /// Along these points, to end with this heading where one is given.
    ///
    /// # Panics
    /// If there is no point.
    #[must_use]
    pub fn new(points: Vec<Point2>, heading: Option<f64>, params: FollowParams) -> Self {
        assert!(!points.is_empty(), "a route has at least one point");
        let mut ways = vec![0.0];
        for pair in points.windows(2) {
            ways.push(ways[ways.len() - 1] + pair[0].distance(pair[1]));
        }
        Self {
            params,
            points,
            ways,
            heading,
            progress: 0.0,
            turning: false,
            at_end: false,
        }
    }

    /// The route.
    #[must_use]
    pub fn points(&self) -> &[Point2] {
        &self.points
    }

    /// What is left of the way [m].
    #[must_use]
    pub fn left(&self) -> f64 {
        self.length() - self.progress
    }

    fn length(&self) -> f64 {
        self.ways[self.ways.len() - 1]
    }

    /// The place on the route at some way from its start.
    #[must_use]
    pub fn at(&self, way: f64) -> Point2 {
        let next = self.ways.partition_point(|w| *w <= way).max(1);
        if next >= self.points.len() {
            return self.points[self.points.len() - 1];
        }
        let (a, b) = (self.points[next - 1], self.points[next]);
        let share = (way - self.ways[next - 1]) / (self.ways[next] - self.ways[next - 1]).max(1e-9);
        let share = share.clamp(0.0, 1.0);
        Point2::new(a.x + (b.x - a.x) * share, a.y + (b.y - a.y) * share)
    }

    /// Way along the route so far [m].
    #[must_use]
    pub const fn progress(&self) -> f64 {
        self.progress
    }

    /// How far the robot is off the route [m].
    #[must_use]
    pub fn off_route(&self, pose: Pose2) -> f64 {
        self.at(self.progress).distance(pose.position())
    }

    /// Steers; `cap` is a limit of the speed from elsewhere [m/s].
    pub fn step(&mut self, pose: Pose2, cap: f64) -> Followed {
        self.advance(pose.position());
        let goal = self.points[self.points.len() - 1];
        let away = goal.distance(pose.position());
        if self.at_end || away <= self.params.at_goal {
            self.at_end = true;
            return self.align(pose);
        }
        let target = self.target(pose.position());
        let local = pose.inverse().transform_from(target);
        let side = local.y.atan2(local.x);
        // past the goal, and near enough that turning round would gain nothing
        if self.left() < 1e-6 && side.abs() > 1.2 && away < 2.0 * self.params.at_goal {
            self.at_end = true;
            return self.align(pose);
        }
        let begin = self.params.corner;
        let end = 0.08;
        self.turning = side.abs() > if self.turning { end } else { begin };
        if self.turning {
            return Followed::Drive(Twist2::new(0.0, self.turn(side)));
        }
        let distance_squared = (local.x * local.x + local.y * local.y).max(1e-6);
        let curvature = 2.0 * local.y / distance_squared;
        let p = &self.params;
        let brake = (2.0 * p.braking * away).sqrt().max(0.05);
        let bend = p.turn_rate / 1.5 / curvature.abs().max(1e-9);
        let speed = p.speed.min(cap).min(brake).min(bend).max(0.03);
        Followed::Drive(Twist2::new(speed, speed * curvature))
    }

    /// Moves on to the nearest place of the next piece of the route.
    fn advance(&mut self, at: Point2) {
        let reach = self.progress + 1.0;
        let mut best = (self.at(self.progress).distance(at), self.progress);
        let step = 0.02;
        let mut way = self.progress;
        while way < reach.min(self.length()) {
            way = (way + step).min(self.length());
            let away = self.at(way).distance(at);
            if away < best.0 {
                best = (away, way);
            } else if away > best.0 + 0.3 {
                break;
            }
        }
        self.progress = best.1;
    }

    /// The farthest place within reach whose chord stays near the route.
    fn target(&self, from: Point2) -> Point2 {
        let step = 0.05;
        let mut found = self.at(self.progress + step);
        let mut passed: Vec<Point2> = vec![found];
        let mut ahead = 2.0 * step;
        while ahead <= self.params.look_ahead + 1e-9 {
            let place = self.at(self.progress + ahead);
            let near = |p: &Point2| off_line(from, place, *p) <= self.params.cut;
            if !passed.iter().all(near) {
                break;
            }
            passed.push(place);
            found = place;
            ahead += step;
        }
        found
    }

    fn align(&mut self, pose: Pose2) -> Followed {
        let Some(heading) = self.heading else {
            return Followed::Arrived;
        };
        let off = wrap(heading - pose.theta);
        if off.abs() <= self.params.at_heading {
            return Followed::Arrived;
        }
        Followed::Drive(Twist2::new(0.0, self.turn(off)))
    }

    /// Turn rate towards an angle: slower near it, never so slow that a wheel would stick.
    fn turn(&self, off: f64) -> f64 {
        (1.5 * off.abs())
            .clamp(0.08, self.params.turn_rate)
            .copysign(off)
    }
}

/// Distance of a place from the line through two others.
fn off_line(a: Point2, b: Point2, p: Point2) -> f64 {
    let long = a.distance(b);
    if long < 1e-9 {
        return a.distance(p);
    }
    ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x)).abs() / long
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Follows with ideal wheels that answer at once, and gives the largest distance from the route.
    fn drive(points: Vec<Point2>, start: Pose2, heading: Option<f64>) -> (Pose2, f64) {
        let mut follower = Follower::new(points.clone(), heading, FollowParams::default());
        let mut pose = start;
        let mut worst: f64 = 0.0;
        for _ in 0..20_000 {
            let Followed::Drive(twist) = follower.step(pose, f64::INFINITY) else {
                return (pose, worst);
            };
            let time = 0.05;
            let turn = twist.angular * time;
            let way = twist.linear * time;
            pose = Pose2::new(
                pose.x + way * (pose.theta + turn / 2.0).cos(),
                pose.y + way * (pose.theta + turn / 2.0).sin(),
                pose.theta + turn,
            );
            let off = points
                .windows(2)
                .map(|w| off_piece(w[0], w[1], pose.position()));
            worst = worst.max(off.fold(f64::INFINITY, f64::min));
        }
        panic!("never arrived: {pose:?}");
    }

    fn off_piece(a: Point2, b: Point2, p: Point2) -> f64 {
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        let share = ((p.x - a.x) * dx + (p.y - a.y) * dy) / (dx * dx + dy * dy);
        let share = share.clamp(0.0, 1.0);
        p.distance(Point2::new(a.x + dx * share, a.y + dy * share))
    }

    #[test]
    fn corners_of_any_angle_are_kept_and_the_end_is_reached() {
        for degrees in [-170, -120, -90, -60, -30, -10, 0, 20, 45, 80, 100, 150, 175] {
            let turn = f64::from(degrees).to_radians();
            let points = vec![
                Point2::new(0.0, 0.0),
                Point2::new(2.0, 0.0),
                Point2::new(2.0 + 3.0 * turn.cos(), 3.0 * turn.sin()),
            ];
            let goal = points[2];
            let (end, worst) = drive(points, Pose2::new(0.0, 0.0, 2.0), Some(-1.0));
            assert!(worst < 0.08, "{degrees}: {worst}");
            assert!(end.position().distance(goal) < 0.045, "{degrees}: {end:?}");
            assert!(wrap(end.theta + 1.0).abs() < 0.02, "{degrees}: {end:?}");
        }
    }

    #[test]
    fn a_route_that_doubles_back_is_followed_in_order() {
        let points = vec![
            Point2::new(0.0, 0.0),
            Point2::new(3.0, 0.0),
            Point2::new(3.0, 0.2),
            Point2::new(0.0, 0.2),
        ];
        let (end, worst) = drive(points, Pose2::default(), None);
        assert!(worst < 0.08 && end.position().distance(Point2::new(0.0, 0.2)) < 0.045);
    }
}
