//! The last filter between any wish and the wheels: invariants S1 to S8 in one place.
//!
//! - S1 no motion without a fresh, settled reading within 15 degrees of the way; silence is no such reading
//! - S2 the robot can always stop before what it has sensed
//! - S3 a command holds until the next one; the drivers' latch ends it after 0.2 s
//! - S4 (the drivers' guard process stops the base when this program dies)
//! - S5 a pose that is too uncertain, or lost, stops the robot; a camera never moves it
//! - S6 every stop has a cause; what latches is lifted by an explicit resume, what needs a person never is
//! - S7 one clock, which is an argument here
//! - S8 limits of speed and acceleration come last; what is no number means stop
//!
//! Silence of a sonar is neither a fault nor an all-clear: a smooth wall at a slant mirrors the sound away.
//! What counts is what something else shows: echoes heard from elsewhere, a sweep made standing still (some
//! shot of which meets any such wall square), the map, the camera's floor. Up to that distance, but never
//! farther than the sonar hears a bare edge, silence then confirms what is known already. Without it the robot
//! creeps half a metre at most.

use std::collections::VecDeque;

use mobot_hw::{BaseStatus, FaultKind, Twist2};
use occgrid::{Pose2, Reading};

use super::angle::wrap;
use super::{Confidence, Device, Sounding, StopCause, Trouble};

/// What is safe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SafetyParams {
    /// Radius of the body about the base's origin [m], above 0.
    pub radius: f64,
    /// The sonar's axle ahead of the base's origin [m].
    pub sonar_ahead: f64,
    /// A reading of the way is fresh for this long [s]; at most 0.3.
    pub range_age: f64,
    /// A reading is of the way where it points at most this far off it [rad]; 15 degrees.
    pub cone: f64,
    /// The braking that is relied on [m/s^2], above 0. Raised: faster, and unsafe past what the base does.
    pub braking: f64,
    /// Room that is left when the robot has stopped [m]. Raised: slower at doors and ends.
    pub margin: f64,
    /// From one command to the next, at least [s].
    pub loop_time: f64,
    /// From a command to the wheels [s].
    pub link_time: f64,
    /// Speed where the sonar is silent and nothing else shows that the way is free [m/s]; at most 0.1.
    pub silent_speed: f64,
    /// How far it may go so [m]; at most 0.5.
    pub silent_way: f64,
    /// How far the sonar hears the bare edge of a thing, from the sonar [m]: what silence confirms of a way
    /// that is known to be free.
    pub silent_reach: f64,
    /// An echo that does not change by more than a millimetre over this way is a stuck sonar [m].
    pub stuck_way: f64,
    /// The base's word is fresh for this long [s].
    pub status_age: f64,
    /// How long everything must have been healthy before a latched stop can be lifted [s].
    pub healthy_time: f64,
    /// Largest speed [m/s].
    pub max_speed: f64,
    /// Largest turn rate [rad/s].
    pub max_turn: f64,
    /// Largest gain of speed [m/s^2]; braking is never held back.
    pub acceleration: f64,
    /// Largest gain of turn rate [rad/s^2].
    pub turn_acceleration: f64,
}

impl Default for SafetyParams {
    /// A small round base with a common indoor sonar.
    fn default() -> Self {
        Self {
            radius: 0.175,
            sonar_ahead: 0.0,
            range_age: 0.3,
            cone: 15.0_f64.to_radians(),
            braking: 0.5,
            margin: 0.15,
            loop_time: 0.05,
            link_time: 0.02,
            silent_speed: 0.1,
            silent_way: 0.5,
            silent_reach: 1.5,
            stuck_way: 0.5,
            status_age: 0.1,
            healthy_time: 1.0,
            max_speed: 0.5,
            max_turn: 1.5,
            acceleration: 0.5,
            turn_acceleration: 3.0,
        }
    }
}

/// What is known when a command is to be admitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SafetyInput {
    /// [s]
    pub now: f64,
    /// The base's newest word.
    pub status: BaseStatus,
    /// Dead reckoning now; never jumps.
    pub odom_from_base: Pose2,
    /// How far the pose is to be trusted.
    pub confidence: Confidence,
    /// How long the last steps took at most [s]: a command holds at least that long.
    pub period: f64,
    /// How far ahead along the wish, measured from the body, something else than the sonar's newest reading
    /// shows free floor [m]; 0 where nothing does.
    pub witnessed: f64,
    /// How far ahead along the wish something is known to stand, measured from the body [m]; infinite where
    /// nothing is.
    pub known_clear: f64,
}

/// A stop that lasts until it is lifted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Halt {
    /// Why.
    pub cause: StopCause,
    /// Since when [s].
    pub since: f64,
}

/// What came of a wish.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Admitted {
    /// For the base.
    pub command: Twist2,
    /// Why it is zero, where the wish was not.
    pub cause: Option<StopCause>,
}

/// Soundings that are remembered.
const REMEMBERED: usize = 12;
/// Slower than this is no motion worth the wheels [m/s].
const CRAWL: f64 = 0.01;

/// The filter.
#[derive(Debug, Clone)]
pub struct Safety {
    params: SafetyParams,
    heard: VecDeque<Sounding>,
    halt: Option<Halt>,
    /// When something was last not healthy [s].
    ailing: f64,
    last: (f64, Twist2),
    /// Where the robot began to creep through silence, by dead reckoning.
    silent_from: Option<Odometer>,
    /// Since where the same echo comes.
    same_echo: Option<(f64, Odometer)>,
    odometer: Odometer,
}

/// Way of the base's origin [m], and where it was last.
#[derive(Debug, Clone, Copy, Default)]
struct Odometer {
    way: f64,
    at: Option<Pose2>,
}

impl Safety {
    /// Nothing heard yet.
    #[must_use]
    pub fn new(params: SafetyParams) -> Self {
        Self {
            params,
            heard: VecDeque::new(),
            halt: None,
            ailing: f64::NEG_INFINITY,
            last: (f64::NEG_INFINITY, Twist2::default()),
            silent_from: None,
            same_echo: None,
            odometer: Odometer::default(),
        }
    }

    /// What is safe.
    #[must_use]
    pub const fn params(&self) -> &SafetyParams {
        &self.params
    }

    /// The latched stop.
    #[must_use]
    pub const fn halt(&self) -> Option<Halt> {
        self.halt
    }

    /// Takes a firing of the sonar. What is not settled or no reading is no news of the way.
    pub fn hear(&mut self, sounding: &Sounding) {
        let ping = &sounding.ping;
        if !ping.settled || matches!(ping.reading, Reading::Fault) || !ping.stamp.is_finite() {
            self.ailing = self.ailing.max(ping.stamp);
            return;
        }
        if self.heard.len() == REMEMBERED {
            self.heard.pop_front();
        }
        self.heard.push_back(*sounding);
        self.notice_sameness(sounding);
    }

    /// Takes the failure of a device.
    pub fn fault(&mut self, now: f64, device: Device, kind: FaultKind) {
        // a camera never moves the robot, so its faults do not stop it either (S5)
        if device == Device::Camera {
            return;
        }
        self.ailing = self.ailing.max(now);
        if device == Device::Base || kind == FaultKind::Unplugged {
            self.latch(now, StopCause::Fault(device, kind));
        }
    }

    /// Latches a stop from outside, as on request.
    pub fn latch(&mut self, now: f64, cause: StopCause) {
        if self.halt.is_none_or(|h| !h.cause.needs_a_person()) {
            self.halt = Some(Halt { cause, since: now });
        }
    }

    /// Lifts a latched stop, if that may be; says whether nothing is latched now (S6).
    pub fn resume(&mut self, now: f64) -> bool {
        let healthy = now - self.ailing >= self.params.healthy_time
            && self.freshest_age(now) <= self.params.range_age;
        if let Some(halt) = self.halt
            && !halt.cause.needs_a_person()
            && healthy
            && now - halt.since >= self.params.healthy_time
        {
            self.halt = None;
            self.same_echo = None;
        }
        self.halt.is_none()
    }

    /// As a person lifts it: whatever the cause.
    pub fn resume_by_hand(&mut self) {
        self.halt = None;
        self.same_echo = None;
    }

    /// The command that is safe, and why it is not the wish.
    pub fn admit(&mut self, input: &SafetyInput, wanted: Twist2) -> Admitted {
        self.odometer.go_on(input.odom_from_base);
        self.look_after(input);
        let cause = match self.judge(input, wanted) {
            Ok(command) => {
                self.last = (input.now, command);
                return Admitted {
                    command,
                    cause: None,
                };
            }
            Err(cause) => cause,
        };
        if cause.latches() && self.halt.is_none() {
            self.latch(input.now, cause);
        }
        self.last = (input.now, Twist2::default());
        Admitted {
            command: Twist2::default(),
            cause: Some(cause),
        }
    }

    /// What latches whatever is wished.
    fn look_after(&mut self, input: &SafetyInput) {
        let status = &input.status;
        let trouble = if status.cliff {
            Some(Trouble::Cliff)
        } else if status.wheel_drop {
            Some(Trouble::WheelDrop)
        } else if status.bump_left || status.bump_right {
            Some(Trouble::Bump)
        } else {
            None
        };
        if let Some(trouble) = trouble {
            self.ailing = input.now;
            self.latch(input.now, StopCause::Trouble(trouble));
        }
    }

    /// The command, or why there must be none.
    fn judge(&mut self, input: &SafetyInput, wanted: Twist2) -> Result<Twist2, StopCause> {
        if !wanted.is_finite() {
            return Err(StopCause::NotFinite);
        }
        if let Some(halt) = self.halt {
            return Err(halt.cause);
        }
        let stands = wanted.linear.abs() < CRAWL && wanted.angular.abs() < 1e-3;
        if stands {
            return Ok(Twist2::default());
        }
        if input.now - input.status.stamp > self.params.status_age + input.period {
            return Err(StopCause::Fault(Device::Base, FaultKind::Silent));
        }
        let limited = self.limit(input.now, wanted);
        if wanted.linear.abs() < CRAWL {
            return self.turn(input.now, limited);
        }
        // turning on the spot finds the pose again; driving on a wrong one does not (S5)
        match input.confidence {
            Confidence::Tracking => {}
            Confidence::Uncertain => return Err(StopCause::PoseUncertain),
            Confidence::Lost => return Err(StopCause::Lost),
        }
        self.drive(input, limited)
    }

    /// A round body that turns on the spot sweeps nothing, but needs a sonar that works.
    fn turn(&self, now: f64, wanted: Twist2) -> Result<Twist2, StopCause> {
        let age = self.freshest_age(now);
        if age > self.params.range_age {
            return Err(StopCause::RangeStale { age });
        }
        Ok(Twist2::new(0.0, wanted.angular))
    }

    fn drive(&mut self, input: &SafetyInput, wanted: Twist2) -> Result<Twist2, StopCause> {
        let p = self.params;
        let Some((heard, off)) = self.of_the_way(input, wanted) else {
            let age = self.age_of_the_way(input, wanted);
            return Err(StopCause::RangeStale { age });
        };
        if let Some((_, from)) = &self.same_echo
            && self.odometer.way - from.way > p.stuck_way
        {
            return Err(StopCause::RangeStuck {
                driven: self.odometer.way - from.way,
            });
        }
        let age = input.now - heard.ping.stamp;
        let gone = travelled(heard.odom_from_base, input.odom_from_base);
        // S2, held twice: for the way that the reading's age may hide, and for the way known to be gone
        let ahead = wanted.linear.signum() * p.sonar_ahead - p.radius - gone;
        let mut clear = input.known_clear;
        let mut silent_cap = f64::INFINITY;
        match heard.ping.reading {
            Reading::Echo { range } => {
                clear = clear.min(range * off.cos() + ahead);
                self.silent_from = None;
            }
            Reading::NoEcho { listened } => {
                let confirmed = input.witnessed.min(listened.min(p.silent_reach) + ahead);
                if self.stoppable(input, age, confirmed) > p.silent_speed {
                    clear = clear.min(confirmed);
                    self.silent_from = None;
                } else {
                    let from = *self.silent_from.get_or_insert(self.odometer);
                    if self.odometer.way - from.way >= p.silent_way {
                        return Err(StopCause::Silence);
                    }
                    silent_cap = p.silent_speed;
                }
            }
            // nearer than the sonar can measure
            Reading::TooClose | Reading::Fault => clear = 0.0,
        }
        let cap = self.stoppable(input, age, clear).min(silent_cap);
        if cap < CRAWL {
            return Err(StopCause::Obstacle { clear });
        }
        let share = (cap / wanted.linear.abs()).min(1.0);
        Ok(Twist2::new(wanted.linear * share, wanted.angular * share))
    }

    /// The highest speed from which the robot stops before `clear` less the margin [m/s] (S2).
    fn stoppable(&self, input: &SafetyInput, age: f64, clear: f64) -> f64 {
        let p = &self.params;
        let room = (clear - p.margin).max(0.0);
        let at = p.braking * (age + p.loop_time.max(input.period) + p.link_time);
        (at * at + 2.0 * p.braking * room).sqrt() - at
    }

    /// The newest fresh reading of the way, and how far it points off the way.
    fn of_the_way(&self, input: &SafetyInput, wanted: Twist2) -> Option<(Sounding, f64)> {
        let fresh = |s: &&Sounding| {
            let age = input.now - s.ping.stamp;
            (0.0..=self.params.range_age).contains(&age)
        };
        self.heard.iter().rev().filter(fresh).find_map(|s| {
            let off = self.off_the_way(s, input.odom_from_base, wanted);
            (off <= self.params.cone + 1e-9).then_some((*s, off))
        })
    }

    fn age_of_the_way(&self, input: &SafetyInput, wanted: Twist2) -> f64 {
        let newest =
            self.heard.iter().rev().find(|s| {
                self.off_the_way(s, input.odom_from_base, wanted) <= self.params.cone + 1e-9
            });
        newest.map_or(f64::INFINITY, |s| input.now - s.ping.stamp)
    }

    /// The angle between a reading and the way [rad].
    fn off_the_way(&self, heard: &Sounding, odom_from_base: Pose2, wanted: Twist2) -> f64 {
        let turned = odom_from_base.theta - heard.odom_from_base.theta;
        wrap(heard.ping.bearing - turned - travel_bearing(wanted)).abs()
    }

    /// Where to listen on the way of a command [rad, base frame]: along it, and a little into its curve.
    #[must_use]
    pub fn aim_along(&self, command: Twist2) -> f64 {
        let p = &self.params;
        let speed = command.linear.abs();
        let stops = speed * (p.range_age + speed / (2.0 * p.braking));
        let chord = if speed > 1e-9 {
            command.angular / speed * stops / 2.0
        } else {
            0.0
        };
        let lead = 0.6 * p.cone;
        wrap(travel_bearing(command) + chord.clamp(-lead, lead))
    }

    fn freshest_age(&self, now: f64) -> f64 {
        self.heard
            .back()
            .map_or(f64::INFINITY, |s| now - s.ping.stamp)
    }

    /// Limits of speed and acceleration, the curve kept (S8).
    fn limit(&self, now: f64, wanted: Twist2) -> Twist2 {
        let p = &self.params;
        let share = (p.max_speed / wanted.linear.abs())
            .min(p.max_turn / wanted.angular.abs())
            .min(1.0);
        let mut next = Twist2::new(wanted.linear * share, wanted.angular * share);
        let time = (now - self.last.0).clamp(0.01, 0.2);
        let gained = |before: f64, next: f64, gain: f64| {
            let from = if before * next > 0.0 {
                before.abs()
            } else {
                0.0
            };
            next.abs().min(from + gain * time).copysign(next)
        };
        let linear = gained(self.last.1.linear, next.linear, p.acceleration);
        if next.linear.abs() > 1e-9 {
            next.angular *= linear / next.linear;
            next.linear = linear;
        } else {
            next.angular = gained(self.last.1.angular, next.angular, p.turn_acceleration);
        }
        next
    }

    /// Follows how long the same echo comes while the wheels drive.
    fn notice_sameness(&mut self, sounding: &Sounding) {
        let Reading::Echo { range } = sounding.ping.reading else {
            self.same_echo = None;
            return;
        };
        let same = self
            .same_echo
            .is_some_and(|(before, _)| (before - range).abs() <= 1e-3);
        if !same {
            self.same_echo = Some((range, self.odometer));
        }
    }
}

impl Odometer {
    fn go_on(&mut self, odom_from_base: Pose2) {
        if let Some(before) = self.at {
            self.way += travelled(before, odom_from_base);
        }
        self.at = Some(odom_from_base);
    }
}

/// The direction in which a command moves the base [rad, base frame]: ahead, or back.
pub(super) fn travel_bearing(command: Twist2) -> f64 {
    if command.linear < 0.0 {
        std::f64::consts::PI
    } else {
        0.0
    }
}

fn travelled(from: Pose2, to: Pose2) -> f64 {
    from.position().distance(to.position())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mobot_hw::Ping;
    use proptest::prelude::*;

    fn sounding(stamp: f64, bearing: f64, reading: Reading, at: Pose2) -> Sounding {
        Sounding {
            ping: Ping {
                stamp,
                bearing,
                settled: true,
                reading,
            },
            map_from_base: at,
            odom_from_base: at,
        }
    }

    fn input(now: f64, at: Pose2) -> SafetyInput {
        SafetyInput {
            now,
            status: BaseStatus {
                stamp: now,
                ..BaseStatus::default()
            },
            odom_from_base: at,
            confidence: Confidence::Tracking,
            period: 0.05,
            witnessed: 0.0,
            known_clear: f64::INFINITY,
        }
    }

    fn readings() -> impl Strategy<Value = Reading> {
        prop_oneof![
            4 => (0.2..5.0).prop_map(|range| Reading::Echo { range }),
            2 => Just(Reading::NoEcho { listened: 5.0 }),
            1 => Just(Reading::TooClose),
            1 => Just(Reading::Fault),
        ]
    }

    /// A step: time passed, what the sonar says at which bearing (if it answers), what is wished.
    type Step = (f64, Option<(f64, bool, Reading)>, Twist2, f64);

    fn steps() -> impl Strategy<Value = Vec<Step>> {
        let heard = prop::option::weighted(
            0.9,
            (
                prop_oneof![3 => -0.3..0.3, 1 => -3.1..3.1],
                prop::bool::weighted(0.95),
                readings(),
            ),
        );
        let wish = prop_oneof![
            6 => (-0.6..0.9, -2.0..2.0).prop_map(|(v, w)| Twist2::new(v, w)),
            6 => (0.0..0.6).prop_map(|v| Twist2::new(v, 0.0)),
            1 => Just(Twist2::new(f64::NAN, 0.0)),
            1 => Just(Twist2::new(0.3, f64::INFINITY)),
        ];
        let witnessed = prop_oneof![2 => Just(0.0), 1 => 0.0..3.0];
        prop::collection::vec((0.01..0.4, heard, wish, witnessed), 1..60)
    }

    /// Where a base that does what it is told is after a time.
    fn moved(at: Pose2, command: Twist2, time: f64) -> Pose2 {
        let turn = command.angular * time;
        let way = command.linear * time;
        let middle = at.theta + turn / 2.0;
        Pose2::new(
            at.x + way * middle.cos(),
            at.y + way * middle.sin(),
            at.theta + turn,
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// S1, S2, S6 and S8 by their words, on any sequence of answers and wishes.
        #[test]
        fn no_wish_gets_past(steps in steps()) {
            let p = SafetyParams::default();
            let mut safety = Safety::new(p);
            let (mut now, mut at, mut command) = (0.0, Pose2::default(), Twist2::default());
            let mut heard: Vec<Sounding> = Vec::new();
            let mut silent_way = 0.0;
            let mut began = false;
            for (time, answer, wish, witnessed) in steps {
                now += time;
                let before = at;
                at = moved(at, command, time);
                if let Some((bearing, settled, reading)) = answer {
                    let mut new = sounding(now - 0.02, bearing, reading, at);
                    new.ping.settled = settled;
                    safety.hear(&new);
                    heard.push(new);
                }
                let way = before.position().distance(at.position());
                let last = command;
                let period = time;
                let given = SafetyInput { witnessed, period, ..input(now, at) };
                let admitted = safety.admit(&given, wish);
                command = admitted.command;
                let zero = command == Twist2::default();
                let wished = wish.linear.abs() >= CRAWL || wish.angular.abs() >= 1e-3;
                let wished = wished || !wish.is_finite();
                prop_assert!(command.is_finite());
                // every stop has a cause, and no motion has one
                prop_assert!(admitted.cause.is_some() || !zero || !wished);
                prop_assert!(admitted.cause.is_none() || zero);
                let gain = p.acceleration * if began { time.min(0.2) } else { 0.2 } + 1e-9;
                began = true;
                prop_assert!(command.linear.abs() <= last.linear.abs() + gain);
                prop_assert!(command.linear.abs() <= p.max_speed + 1e-9);
                prop_assert!(command.angular.abs() <= p.max_turn + 1e-9);
                if zero {
                    continue;
                }
                prop_assert!(wish.is_finite());
                let valid = |s: &&Sounding| {
                    s.ping.settled
                        && !matches!(s.ping.reading, Reading::Fault)
                        && now - s.ping.stamp <= 0.3
                };
                prop_assert!(heard.iter().any(|s| valid(&s)), "no fresh reading");
                if command.linear == 0.0 {
                    continue;
                }
                let direction = if command.linear < 0.0 { std::f64::consts::PI } else { 0.0 };
                let of_the_way = |s: &&Sounding| {
                    let turned = at.theta - s.odom_from_base.theta;
                    wrap(s.ping.bearing - turned - direction).abs() <= 15.0_f64.to_radians() + 1e-9
                };
                let newest = heard.iter().rev().filter(valid).find(of_the_way);
                prop_assert!(newest.is_some(), "not heard along the way");
                let newest = newest.expect("found");
                let speed = command.linear.abs();
                let t = now - newest.ping.stamp + 0.07;
                let stops = |d: f64| -p.braking * t
                    + ((p.braking * t).powi(2) + 2.0 * p.braking * (d - 0.15)).sqrt();
                match newest.ping.reading {
                    Reading::Echo { range } => {
                        silent_way = 0.0;
                        prop_assert!(speed <= stops(range - p.radius) + 1e-9);
                    }
                    Reading::NoEcho { .. } => {
                        if speed > 0.1 + 1e-9 {
                            prop_assert!(speed <= stops(witnessed.min(1.5 - p.radius)) + 1e-9);
                            silent_way = 0.0;
                        } else if witnessed < 0.2 {
                            silent_way += way;
                            prop_assert!(silent_way <= 0.5 + 0.05, "{}", silent_way);
                        }
                    }
                    Reading::TooClose | Reading::Fault => prop_assert!(false, "drove on"),
                }
            }
        }

        /// S6: what needs a person is lifted by nothing else.
        #[test]
        fn trouble_is_final(steps in steps(), bump in 0_usize..4) {
            let mut safety = Safety::new(SafetyParams::default());
            let status = BaseStatus {
                bump_left: bump == 0,
                bump_right: bump == 1,
                cliff: bump == 2,
                wheel_drop: bump == 3,
                ..BaseStatus::default()
            };
            safety.admit(&SafetyInput { status, ..input(0.0, Pose2::default()) }, Twist2::default());
            let mut now = 0.0;
            for (time, answer, wish, witnessed) in steps {
                now += time + 1.0;
                if let Some((bearing, _, reading)) = answer {
                    safety.hear(&sounding(now - 0.02, bearing, reading, Pose2::default()));
                }
                prop_assert!(!safety.resume(now));
                let given = SafetyInput { witnessed, ..input(now, Pose2::default()) };
                prop_assert_eq!(safety.admit(&given, wish).command, Twist2::default());
            }
        }
    }

    #[test]
    fn silence_is_crept_through_for_half_a_metre_and_no_more() {
        let mut safety = Safety::new(SafetyParams::default());
        let (mut now, mut at, mut command) = (0.0, Pose2::default(), Twist2::default());
        let mut cause = None;
        for _ in 0..400 {
            now += 0.05;
            at = moved(at, command, 0.05);
            let silence = Reading::NoEcho { listened: 5.0 };
            safety.hear(&sounding(now - 0.01, 0.0, silence, at));
            let admitted = safety.admit(&input(now, at), Twist2::new(0.4, 0.0));
            assert!(admitted.command.linear <= 0.1 + 1e-9);
            command = admitted.command;
            cause = admitted.cause;
        }
        assert_eq!(cause, Some(StopCause::Silence));
        assert!((0.49..0.51).contains(&at.x), "{}", at.x);
    }

    #[test]
    fn a_lost_sonar_stops_the_robot_in_time_and_one_second_of_health_lets_it_resume() {
        let mut safety = Safety::new(SafetyParams::default());
        let (mut now, mut stopped) = (0.0, None);
        let mut distance = 0.0;
        for k in 0..200 {
            now += 0.05;
            distance += 0.01;
            let at = Pose2::new(distance, 0.0, 0.0);
            if !(2.0..=5.0).contains(&now) {
                // never quite the same, as a real echo
                let range = 4.0 - distance;
                safety.hear(&sounding(now, 0.0, Reading::Echo { range }, at));
            } else {
                safety.fault(now, Device::Sonar, FaultKind::Silent);
            }
            let admitted = safety.admit(&input(now, at), Twist2::new(0.3, 0.0));
            if k > 5 && now < 2.0 {
                assert!(admitted.command.linear > 0.0);
            }
            if let Some(StopCause::RangeStale { .. }) = admitted.cause {
                stopped.get_or_insert(now);
            }
            let resumed = safety.resume(now);
            if !(2.2..=6.1).contains(&now) {
                assert!(resumed, "{now}");
            } else if (2.35..5.9).contains(&now) {
                assert!(!resumed, "{now}");
            }
        }
        let stopped = stopped.expect("it stopped");
        assert!(stopped - 1.95 <= 0.37, "{stopped}");
        assert_eq!(safety.halt(), None);
    }

    #[test]
    fn a_stuck_sonar_is_found_out_within_its_way() {
        let mut safety = Safety::new(SafetyParams::default());
        let (mut now, mut at, mut command) = (0.0, Pose2::default(), Twist2::default());
        for _ in 0..200 {
            now += 0.05;
            at = moved(at, command, 0.05);
            safety.hear(&sounding(now, 0.0, Reading::Echo { range: 2.5 }, at));
            let admitted = safety.admit(&input(now, at), Twist2::new(0.3, 0.0));
            command = admitted.command;
        }
        assert!((0.5..0.56).contains(&at.x), "{}", at.x);
        let cause = safety.halt().expect("halted").cause;
        assert!(matches!(cause, StopCause::RangeStuck { .. }));
    }

    #[test]
    fn an_uncertain_pose_forbids_driving_but_not_looking_round() {
        for confidence in [Confidence::Uncertain, Confidence::Lost] {
            let mut safety = Safety::new(SafetyParams::default());
            let at = Pose2::default();
            safety.hear(&sounding(1.0, 0.0, Reading::Echo { range: 3.0 }, at));
            let given = SafetyInput {
                confidence,
                ..input(1.02, at)
            };
            let drive = safety.admit(&given, Twist2::new(0.2, 0.0));
            assert_eq!(drive.command, Twist2::default());
            assert!(drive.cause.is_some());
            let turn = safety.admit(&given, Twist2::new(0.0, 0.5));
            assert!(turn.command.angular > 0.0);
        }
    }
}
