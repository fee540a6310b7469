//! Localization while driving: wheels predict, frames and echoes correct, and contradictions are counted.
//!
//! What is sensed can contradict the pose: a frame that shows walls where none can be, an echo from behind a
//! wall. A few of those in a row and the pose is called lost; the robot then stands until two frames in a row
//! say the same place, near where it was lost.

use mobot_hw::{BaseStatus, CameraFrame};
use monocal::{FixStatus, FloorPlan, PoseFix, Prior};
use occgrid::{OccupancyMap, Pose2, Reading, SonarModel};

use super::angle::wrap;
use super::echo::wall_echo;
use super::sight::Sight;
use super::swath::SwathMap;
use super::sweep::Sweep;
use super::{
    Confidence, Cue, Entry, Mover, PoseEstimate, PoseFilter, RunLog, Sounding, SweepMatcher,
    SweepParams, SweepStatus,
};

/// How the pose is corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalizerParams {
    /// The sonar: its beam, and where it sits.
    pub sonar: SonarModel,
    /// How a sweep of it is matched with the map.
    pub sweep: SweepParams,
    /// How far echoes of walls are trusted [m]; 0 for never.
    pub echo_reach: f64,
    /// One sigma of a range and of a wall of the plan together [m], above 0.
    pub echo_sigma: f64,
    /// Frames older than this when they can be used are left [s].
    pub frame_age: f64,
    /// So many contradictions in a row at least before the pose is lost.
    pub contradictions: u32,
    /// And over this way [m]. Raised: fewer false alarms where the floor is full of lines; a robot that was
    /// carried off drives on as far.
    pub contradicted_way: f64,
    /// A lost pose is looked for around where it was lost, one sigma [m].
    pub lost_sigma: f64,
    /// One sigma of its heading [rad].
    pub lost_heading_sigma: f64,
}

impl Default for LocalizerParams {
    fn default() -> Self {
        Self {
            sonar: SonarModel::default(),
            sweep: SweepParams::default(),
            echo_reach: 4.5,
            echo_sigma: 0.02,
            frame_age: 0.2,
            contradictions: 4,
            contradicted_way: 0.6,
            lost_sigma: 0.45,
            lost_heading_sigma: 10.0_f64.to_radians(),
        }
    }
}

/// Share that each frame or echo has in the record of what fitted.
const FORGET: f64 = 0.1;
/// From this share on, what does not fit is a contradiction.
const FITTED: f64 = 0.5;

/// Contradictions in a row.
#[derive(Debug, Clone, Copy, Default)]
struct Streak {
    count: u32,
    /// Way over which they came, and what counts like way [m].
    way: f64,
    at: Option<Pose2>,
}

/// What each kind of contradiction counts beside the way [m]: a frame whose fix was refused, an echo from
/// behind a wall. A frame that merely fits nothing counts no more than the way.
const REFUSED: [f64; 2] = [0.15, 0.05];

/// How much is new in a measurement: frames and echoes from the same place err alike, by what the plan and
/// the calibration have wrong there.
#[derive(Debug, Clone, Copy)]
struct News {
    last: Option<Pose2>,
}

/// What is wrong in one place is another matter after this way [m] and after this turn [rad].
const APART: [f64; 2] = [0.5, 0.35];

/// Less news than this is waited with.
const LEAST_NEWS: f64 = 0.02;

impl News {
    /// The share of a measurement's information that is not in those before.
    fn weight(&mut self, odom_from_base: Pose2) -> f64 {
        let moved = self.last.map_or(1.0, |last| {
            last.position().distance(odom_from_base.position()) / APART[0]
                + (last.theta - odom_from_base.theta).abs() / APART[1]
        });
        if moved >= LEAST_NEWS {
            self.last = Some(odom_from_base);
        }
        moved.min(1.0)
    }
}

/// Below this sigma of the position a sweep has nothing to add [m].
const WELL_KNOWN: f64 = 0.05;
/// So many echoes add to a pose that is about known.
const FEW: usize = 3;
/// Two sweeps say the same place within this [m], [rad].
const AGREED: [f64; 2] = [0.15, 0.1];

/// Knows where the robot is, as far as that can be known.
#[derive(Debug)]
pub struct Localizer {
    params: LocalizerParams,
    filter: PoseFilter,
    sight: Option<Sight>,
    plan: FloorPlan,
    /// In a row, of frames and of echoes.
    contradicted: [Streak; 2],
    /// Share of what fitted, lately.
    record: [f64; 2],
    /// Since the last correction of each.
    news: [News; 3],
    /// The last frame's place while the pose is lost.
    candidate: Option<Pose2>,
    /// Frames in a row that fit where the lost pose was thought to be.
    agreed: u32,
    /// What was heard since the robot last drove on.
    sweep: Sweep,
    /// Where the last sweep of a robot that is lost puts the odometry's frame.
    swept: Option<Pose2>,
    last_bytes: Vec<u8>,
}

impl Localizer {
    /// Dead reckoning, corrected by echoes of the plan's walls, and by frames where there is a camera.
    #[must_use]
    pub fn new(
        filter: PoseFilter,
        plan: FloorPlan,
        sight: Option<Sight>,
        params: LocalizerParams,
    ) -> Self {
        Self {
            params,
            filter,
            sight,
            plan,
            contradicted: [Streak::default(); 2],
            record: [0.0; 2],
            news: [News { last: None }; 3],
            candidate: None,
            agreed: 0,
            sweep: Sweep::default(),
            swept: None,
            last_bytes: Vec::new(),
        }
    }

    /// The filter.
    #[must_use]
    pub const fn filter(&self) -> &PoseFilter {
        &self.filter
    }

    /// Where the robot is thought to be.
    #[must_use]
    pub fn estimate(&self) -> PoseEstimate {
        self.filter.estimate()
    }

    /// Takes the base's word.
    pub fn roll(&mut self, status: &BaseStatus) {
        self.filter.predict(status);
    }

    /// Takes a firing of the sonar.
    pub fn hear(&mut self, sounding: &Sounding, log: &mut dyn RunLog) {
        let ping = &sounding.ping;
        let Reading::Echo { range } = ping.reading else {
            return;
        };
        if !ping.settled || self.plan.walls.is_empty() || self.filter.is_lost() {
            return;
        }
        let estimate = self.filter.estimate();
        // worse than this, walls are taken for others
        if estimate.heading_sigma() > 0.2 || estimate.position_sigma() > 0.35 {
            return;
        }
        let then = self.filter.map_from_base_at(ping.stamp);
        let p = &self.params;
        let echo = wall_echo(
            &self.plan.walls,
            then,
            p.sonar.mount,
            ping.bearing,
            p.echo_reach,
        );
        let Some(echo) = echo else { return };
        let sigma = (self.filter.range_sigma(echo.gradient)).hypot(p.echo_sigma);
        let off = range - echo.range;
        if off < -3.0 * sigma {
            // something stands before the wall
            return;
        }
        // another direction is another wall
        let odom = sounding.odom_from_base;
        let weight = self.news[1].weight(Pose2 {
            theta: odom.theta + ping.bearing,
            ..odom
        });
        if weight < LEAST_NEWS {
            return;
        }
        let sigma = p.echo_sigma / weight.sqrt();
        let correction = self
            .filter
            .correct_range(range, echo.range, echo.gradient, sigma);
        log.record(ping.stamp, Entry::Correction(&correction));
        self.judge(1, correction.accepted, REFUSED[1]);
    }

    /// Takes a firing towards a sweep; one that is whole is matched with the map while the robot stands.
    pub fn look_round(
        &mut self,
        sounding: &Sounding,
        standing: bool,
        map: &OccupancyMap,
        log: &mut dyn RunLog,
    ) {
        self.sweep.take(sounding);
        let estimate = self.filter.estimate();
        let unsure = self.filter.is_lost() || estimate.confidence != Confidence::Tracking;
        if !standing || !unsure && estimate.position_sigma() < WELL_KNOWN {
            return;
        }
        let Some(sweep) = self.sweep.whole() else {
            return;
        };
        let stamp = sounding.ping.stamp;
        let lost = self.filter.is_lost();
        let prior = if lost {
            self.wide_prior(stamp)
        } else {
            self.filter.prior_at(stamp)
        };
        let p = &self.params;
        let echoes = if lost {
            p.sweep.echoes
        } else {
            p.sweep.echoes.min(FEW)
        };
        let matching = SweepParams { echoes, ..p.sweep };
        let spread = prior.covariance[0][0].max(prior.covariance[1][1]).sqrt();
        let reach = p.sweep.reach + 3.0 * spread + 0.5;
        let matcher = SweepMatcher::new(map, prior.pose.position(), reach, matching);
        let fix = matcher.fix(&p.sonar, &sweep, &prior);
        if fix.status != SweepStatus::Found {
            return;
        }
        let odom = self.filter.odom_from_base_at(stamp);
        if !lost {
            let weight = self.news[2].weight(odom);
            if weight < LEAST_NEWS {
                return;
            }
            let (pose, covariance) = (fix.map_from_base, fix.covariance);
            let correction = self
                .filter
                .correct_to(Cue::Sweep, stamp, pose, covariance, weight);
            log.record(stamp, Entry::Correction(&correction));
            return;
        }
        // one sweep may be explained elsewhere, too; two from different headings hardly at the same place
        let map_from_odom = fix.map_from_base.compose(odom.inverse());
        let again = self.swept.replace(map_from_odom).is_some_and(|before| {
            let there = before.compose(odom);
            there.position().distance(fix.map_from_base.position()) < AGREED[0]
                && wrap(there.theta - fix.map_from_base.theta).abs() < AGREED[1]
        });
        if again {
            self.filter.place(stamp, fix.map_from_base, fix.covariance);
            self.found();
        }
    }

    /// Takes a frame; `newest` is the time of the base's last word [s]. Gives what moves.
    pub fn see(
        &mut self,
        frame: &CameraFrame,
        newest: f64,
        standing: bool,
        map: &impl SwathMap,
        log: &mut dyn RunLog,
    ) -> Option<Vec<Mover>> {
        let sight = self.sight.as_mut()?;
        let fresh = newest - frame.stamp <= self.params.frame_age && frame.stamp <= newest + 1e-9;
        if !fresh || !sight.accepts(frame) || self.is_frozen(frame) {
            return None;
        }
        let prior = self.filter.prior_at(frame.stamp);
        let wide = self.filter.is_lost().then(|| self.wide_prior(frame.stamp));
        let sight = self.sight.as_mut()?;
        let fix = sight.fix(frame, &prior);
        let odom = self.filter.odom_from_base_at(frame.stamp);
        if let Some(wide) = wide {
            let wide = sight.fix_again(&wide);
            self.find_again(frame.stamp, &wide, &fix, standing);
        } else {
            self.take(frame.stamp, &fix, log);
        }
        let map_from_odom = self
            .filter
            .map_from_base_at(frame.stamp)
            .compose(odom.inverse());
        let sight = self.sight.as_mut()?;
        Some(sight.follow(frame, odom, map_from_odom, map))
    }

    fn take(&mut self, stamp: f64, fix: &PoseFix, log: &mut dyn RunLog) {
        match fix.status {
            FixStatus::Lost => self.judge(0, false, 0.0),
            FixStatus::NoMatch => {}
            _ => {
                let weight = self.news[0].weight(self.filter.odom_from_base_at(stamp));
                if weight < LEAST_NEWS {
                    return;
                }
                let correction = self.filter.correct(stamp, fix, weight);
                if correction.freedom > 0 {
                    log.record(stamp, Entry::Correction(&correction));
                    self.judge(0, correction.accepted, REFUSED[0]);
                }
            }
        }
    }

    /// Counts contradictions. They say something only where what came before did fit: a floor full of lines
    /// that are in no plan contradicts any pose.
    fn judge(&mut self, kind: usize, fits: bool, counts: f64) {
        let record = &mut self.record[kind];
        let before = *record;
        *record += (f64::from(u8::from(fits)) - *record) * FORGET;
        if fits {
            self.contradicted[kind] = Streak::default();
            if kind == 0 {
                self.contradicted[1] = Streak::default();
            }
            return;
        }
        let streak = &mut self.contradicted[kind];
        if streak.count == 0 && before < FITTED {
            return;
        }
        let here = self.filter.odom_from_base();
        let moved = streak.at.replace(here);
        streak.way += counts + moved.map_or(0.0, |at| at.position().distance(here.position()));
        streak.count += 1;
        let p = &self.params;
        if streak.count >= p.contradictions && streak.way >= p.contradicted_way {
            self.filter.set_lost(true);
            self.agreed = 0;
            self.candidate = None;
        }
    }

    fn wide_prior(&self, stamp: f64) -> Prior {
        let mut prior = self.filter.prior_at(stamp);
        let p = &self.params;
        let variances = [p.lost_sigma, p.lost_sigma, p.lost_heading_sigma].map(|s| s * s);
        prior.covariance = [[0.0; 3]; 3];
        for (k, variance) in variances.into_iter().enumerate() {
            prior.covariance[k][k] = variance;
        }
        prior
    }

    /// Two frames in a row that alone say the same place find the pose again; three in a row that fit where
    /// it was thought to be take back that it was lost.
    fn find_again(&mut self, stamp: f64, wide: &PoseFix, near: &PoseFix, standing: bool) {
        if !standing {
            self.candidate = None;
            self.agreed = 0;
            return;
        }
        let fits = matches!(near.status, FixStatus::Ok | FixStatus::Partial);
        self.agreed = if fits { self.agreed + 1 } else { 0 };
        if self.agreed >= 3 {
            let odom = self.filter.odom_from_base_at(stamp);
            self.news[0].last = Some(odom);
            if self.filter.correct(stamp, near, 1.0).accepted {
                self.found();
                return;
            }
        }
        if wide.status != FixStatus::Ok {
            self.candidate = None;
            return;
        }
        let same = self.candidate.is_some_and(|before| {
            before.position().distance(wide.pose.position()) < 0.05
                && wrap(before.theta - wide.pose.theta).abs() < 0.03
        });
        self.candidate = Some(wide.pose);
        if same {
            self.filter.place(stamp, wide.pose, wide.covariance);
            self.found();
        }
    }

    fn found(&mut self) {
        self.filter.set_lost(false);
        self.swept = None;
        self.contradicted = [Streak::default(); 2];
        self.candidate = None;
        self.agreed = 0;
    }

    /// Whether a camera sends the same picture again; noise alone makes two of one scene differ.
    fn is_frozen(&mut self, frame: &CameraFrame) -> bool {
        let bytes = frame.image.as_raw();
        let same = *bytes == self.last_bytes;
        if !same {
            self.last_bytes.clone_from(bytes);
        }
        same
    }
}
