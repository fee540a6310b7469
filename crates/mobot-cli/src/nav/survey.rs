//! The paper's survey: one sonar fired all round at equal steps while the robot stands still (§2.1).

use occgrid::{Reading, Shot};

use super::angle::wrap;
use super::{Action, Observation};
use mobot_hw::Twist2;

/// How the robot looks around.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurveyParams {
    /// Shots of a survey, 1 or more. Default 20, the paper's. More take longer.
    pub shots: u32,
    /// Angle from shot to shot [rad]. Default 18 degrees, the paper's: 20 shots see all round.
    pub step: f64,
    /// Firings after which a direction that only gives faults is left out, 1 or more.
    pub tries: u32,
}

impl Default for SurveyParams {
    fn default() -> Self {
        Self {
            shots: 20,
            step: 18.0_f64.to_radians(),
            tries: 3,
        }
    }
}

/// A survey under way. Directions beyond the sonar's reach are brought into it by turning the robot on the
/// spot; a sonar that cannot be aimed is turned so all the time.
#[derive(Debug, Clone)]
pub struct Survey {
    params: SurveyParams,
    /// Heading by dead reckoning when it began [rad].
    from: Option<f64>,
    next: u32,
    failed: u32,
    /// Where the last firing was told to go [rad, base frame].
    aimed: Option<f64>,
    shots: Vec<Shot>,
}

/// The robot turns on the spot to within this of where a shot should go [rad].
const TURNED: f64 = 0.02;
/// It stands where it turns slower than this [rad/s], and drives slower than this [m/s].
const STANDS: f64 = 0.01;
/// Speed of turns between shots [rad/s].
const TURN: f64 = 0.8;

impl Survey {
    /// About to begin.
    #[must_use]
    pub const fn new(params: SurveyParams) -> Self {
        Self {
            params,
            from: None,
            next: 0,
            failed: 0,
            aimed: None,
            shots: Vec::new(),
        }
    }

    /// What to do next; `None` when all directions were fired at.
    pub fn step(&mut self, seen: &Observation<'_>) -> Option<Action> {
        let heading = seen.odom_from_base.theta;
        let from = *self.from.get_or_insert(heading);
        self.take(seen);
        if self.next >= self.params.shots {
            return None;
        }
        // half a turn behind to half a turn ahead of straight on, so that a pan sweeps once
        let middle = f64::from(self.params.shots - 1) / 2.0;
        let direction = from + (f64::from(self.next) - middle) * self.params.step;
        let wanted = wrap(direction - heading);
        let aim = wanted.clamp(seen.bearings.from, seen.bearings.to);
        let off = wanted - aim;
        if off.abs() > TURNED {
            self.aimed = None;
            let rate = (2.0 * off).clamp(-TURN, TURN);
            let rate = rate.abs().max(0.1).copysign(rate);
            return Some(Action::drive(Twist2::new(0.0, rate)));
        }
        let stands = seen.twist.angular.abs() < STANDS && seen.twist.linear.abs() < STANDS;
        self.aimed = stands.then_some(aim);
        Some(Action::stand("survey").aiming(aim))
    }

    /// The shots so far; all of them once [`Self::step`] gave `None`.
    #[must_use]
    pub fn into_shots(self) -> Vec<Shot> {
        self.shots
    }

    /// Takes the firing that was asked for.
    fn take(&mut self, seen: &Observation<'_>) {
        let Some(aimed) = self.aimed.take() else {
            return;
        };
        let good = seen.sounding.filter(|s| {
            s.ping.settled
                && (s.ping.bearing - aimed).abs() < TURNED
                && !matches!(s.ping.reading, Reading::Fault)
        });
        self.failed += 1;
        if let Some(sounding) = good {
            self.shots.push(sounding.shot());
        }
        if good.is_some() || self.failed >= self.params.tries {
            self.next += 1;
            self.failed = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nav::{AvoidParams, Motion, PoseFilter, Sounding, Surprises};
    use mobot_hw::{BaseStatus, Bearings, Ping};
    use occgrid::{OccupancyGrid, Pose2};

    /// Surveys with a sonar of this reach on a base that turns as told; the world directions of the shots.
    fn directions(bearings: Bearings, faults: bool) -> Vec<f64> {
        let mut survey = Survey::new(SurveyParams::default());
        let grid = OccupancyGrid::new(0.1).expect("a grid");
        let surprises = Surprises::new(AvoidParams::default());
        let pose = PoseFilter::new(Pose2::default(), 0.2, crate::nav::FilterParams::default());
        let (mut heading, mut turning, mut aim) = (0.3_f64, 0.0_f64, 0.0);
        let mut now = 0.0;
        for step in 0..5000 {
            let at = Pose2::new(1.0, 2.0, heading);
            let faulty = faults && step % 2 == 0;
            let ping = Ping {
                stamp: now,
                bearing: aim,
                settled: true,
                reading: if faulty {
                    Reading::Fault
                } else {
                    Reading::Echo { range: 1.0 }
                },
            };
            let sounding = Sounding {
                ping,
                map_from_base: at,
                odom_from_base: at,
            };
            let seen = Observation {
                now,
                pose: pose.estimate(),
                odom_from_base: at,
                status: BaseStatus::default(),
                twist: Twist2::new(0.0, turning),
                sounding: Some(sounding),
                ahead: None,
                bearings,
                map: &grid,
                movers: &[],
                surprises: &surprises,
                halt: None,
                stopped: None,
            };
            let Some(action) = survey.step(&seen) else {
                let shots = survey.into_shots();
                return shots
                    .iter()
                    .map(|s| wrap(s.map_from_base.theta + s.bearing))
                    .collect();
            };
            turning = match action.motion {
                Motion::Drive(twist) => twist.angular,
                _ => 0.0,
            };
            heading += 0.05 * turning;
            aim = action.aim.clamp(bearings.from, bearings.to);
            now += 0.05;
        }
        panic!("the survey does not end");
    }

    #[test]
    fn every_turret_and_none_sees_all_round_at_equal_steps() {
        use std::f64::consts::PI;
        let all = Bearings { from: -PI, to: PI };
        let half = Bearings {
            from: -1.0,
            to: 1.3,
        };
        for (bearings, faults) in [
            (all, false),
            (all, true),
            (half, false),
            (Bearings::fixed(0.0), false),
        ] {
            let found = directions(bearings, faults);
            assert_eq!(found.len(), 20, "{bearings:?}");
            for (k, direction) in found.iter().enumerate() {
                let expected = 0.3 + (k as f64 - 9.5) * 18.0_f64.to_radians();
                let off = wrap(direction - expected);
                assert!(off.abs() <= TURNED + 1e-9, "{bearings:?} {k}: {off}");
            }
        }
    }
}
