//! The loop: ask the devices, estimate, decide, make safe, drive. The only place that touches devices.

use mobot_hw::{
    BaseStatus, Camera, CameraFrame, Clock, DeviceError as _, DifferentialDrive, FaultKind,
    RangeFinder, Twist2,
};
use monocal::FloorPlan;
use occgrid::{FrameError, OccupancyGrid, OccupancyMap, Pose2, Reading};

use super::safety::travel_bearing;
use super::swath::swath;
use super::{
    Action, Behaviour, Confidence, Device, Devices, Entry, Event, Localizer, Motion, Mover,
    Observation, Outcome, PoseFilter, RunLog, RunnerParams, Safety, SafetyInput, Sight, Sounding,
    StopCause, Surprises,
};

/// The robot at work.
#[derive(Debug)]
pub struct Runner<B, S, C, K> {
    devices: Devices<B, S, C, K>,
    params: RunnerParams,
    safety: Safety,
    localizer: Localizer,
    /// The map that the robot came with.
    known: Option<OccupancyMap>,
    /// What stands there that is not on it.
    surprises: Surprises,
    map: OccupancyGrid,
    /// What echoes alone showed, and sweeps made standing still: what may bear witness to silence.
    witness: OccupancyGrid,
    status: BaseStatus,
    twist: Twist2,
    ahead: Option<Sounding>,
    movers: Vec<Mover>,
    confidence: Confidence,
    aim: f64,
    command: Twist2,
    /// The cause of the present stop.
    standing: Option<StopCause>,
    failing: [Option<FaultKind>; 3],
    now: f64,
    period: f64,
    steps: u32,
}

impl<B, S, C, K> Runner<B, S, C, K>
where
    B: DifferentialDrive,
    S: RangeFinder,
    C: Camera,
    K: Clock,
{
    /// A robot that stands at `map_from_base`.
    ///
    /// # Errors
    /// [`FrameError::Resolution`]
    pub fn new(
        devices: Devices<B, S, C, K>,
        map_from_base: Pose2,
        params: RunnerParams,
    ) -> Result<Self, FrameError> {
        let track = devices.base.track();
        let now = devices.clock.now();
        let filter = PoseFilter::new(map_from_base, track, params.filter);
        Ok(Self {
            devices,
            params,
            safety: Safety::new(params.safety),
            localizer: Localizer::new(filter, FloorPlan::default(), None, params.localizer),
            known: None,
            surprises: Surprises::new(params.avoid),
            map: OccupancyGrid::new(params.resolution)?,
            witness: OccupancyGrid::new(params.resolution)?,
            status: BaseStatus::default(),
            twist: Twist2::default(),
            ahead: None,
            movers: Vec::new(),
            confidence: Confidence::Tracking,
            aim: 0.0,
            command: Twist2::default(),
            standing: None,
            failing: [None; 3],
            now,
            period: 0.0,
            steps: 0,
        })
    }

    /// In a building of which a map and a plan are known: the map bears witness where the sonar is silent, the
    /// plan's walls correct the pose, by echoes and, where the camera is calibrated, by what it sees.
    #[must_use]
    pub fn knowing(mut self, map: OccupancyMap, plan: FloorPlan, sight: Option<Sight>) -> Self {
        self.known = Some(map);
        let filter = self.localizer.filter().clone();
        self.localizer = Localizer::new(filter, plan, sight, self.params.localizer);
        self
    }

    /// The time of the last step [s].
    #[must_use]
    pub const fn now(&self) -> f64 {
        self.now
    }

    /// The same, taking a frame every so many steps from now on.
    #[must_use]
    pub const fn looking_every(mut self, steps: u32) -> Self {
        self.params.frame_every = steps;
        self
    }

    /// The map made so far.
    #[must_use]
    pub const fn map(&self) -> &OccupancyGrid {
        &self.map
    }

    /// Where the robot is thought to be.
    #[must_use]
    pub const fn filter(&self) -> &PoseFilter {
        self.localizer.filter()
    }

    /// Runs a behaviour until it is done, or until `interrupted`; either way the robot stands at the end.
    pub fn run(
        &mut self,
        behaviour: &mut dyn Behaviour,
        log: &mut dyn RunLog,
        interrupted: &dyn Fn() -> bool,
    ) -> Outcome {
        loop {
            if interrupted() {
                self.halt(StopCause::Interrupted, log);
                return Outcome::Interrupted;
            }
            if let Some(outcome) = self.step(behaviour, log) {
                return outcome;
            }
        }
    }

    /// One round; `Some` when the behaviour is done and the robot stands.
    pub fn step(&mut self, behaviour: &mut dyn Behaviour, log: &mut dyn RunLog) -> Option<Outcome> {
        let frame = self.look(log);
        let ping = self.listen(log);
        self.feel(log);
        self.tick(log);
        if let Some(frame) = frame {
            self.see(&frame, log);
        }
        let sounding = ping.map(|ping| self.place(ping));
        if let Some(sounding) = &sounding {
            self.localizer.hear(sounding, log);
            let standing = self.stands();
            if let Some(map) = &self.known {
                self.localizer.look_round(sounding, standing, map, log);
            }
            self.take(sounding, log);
        }
        self.notice_confidence(log);
        let action = self.decide(behaviour, sounding);
        if let Some(event) = &action.say {
            log.record(self.now, Entry::Event(event));
            if let Event::Planned { points, .. } = event {
                log.record(self.now, Entry::Route(points));
            }
        }
        self.act(action, log)
    }

    /// A frame, every so many steps.
    fn look(&mut self, log: &mut dyn RunLog) -> Option<CameraFrame> {
        let due = self.steps.is_multiple_of(self.params.frame_every.max(1));
        self.steps = self.steps.wrapping_add(1);
        let camera = self.devices.camera.as_mut().filter(|_| due)?;
        match camera.frame() {
            Ok(frame) => {
                self.answered(Device::Camera, log);
                log.record(frame.stamp, Entry::Frame(&frame));
                Some(frame)
            }
            Err(error) => {
                self.failed(Device::Camera, error.kind(), log);
                None
            }
        }
    }

    fn listen(&mut self, log: &mut dyn RunLog) -> Option<mobot_hw::Ping> {
        match self.devices.sonar.ping(self.aim) {
            Ok(ping) => {
                self.answered(Device::Sonar, log);
                Some(ping)
            }
            Err(error) => {
                self.failed(Device::Sonar, error.kind(), log);
                None
            }
        }
    }

    /// The wheels' word; the pose goes on with it.
    fn feel(&mut self, log: &mut dyn RunLog) {
        match self.devices.base.status() {
            Ok(status) => {
                self.answered(Device::Base, log);
                log.record(status.stamp, Entry::Status(&status));
                self.twist = velocity(&self.status, &status, self.devices.base.track());
                self.status = status;
                self.localizer.roll(&status);
                log.record(
                    status.stamp,
                    Entry::Odometry(self.filter().odom_from_base()),
                );
            }
            Err(error) => self.failed(Device::Base, error.kind(), log),
        }
    }

    fn place(&self, ping: mobot_hw::Ping) -> Sounding {
        Sounding {
            ping,
            map_from_base: self.filter().map_from_base_at(ping.stamp),
            odom_from_base: self.filter().odom_from_base_at(ping.stamp),
        }
    }

    /// Takes a frame: the pose is corrected, and what moves is followed.
    fn see(&mut self, frame: &CameraFrame, log: &mut dyn RunLog) {
        let stands = self.stands();
        let newest = self.status.stamp;
        let movers = match &self.known {
            Some(map) => self.localizer.see(frame, newest, stands, map, log),
            None => self.localizer.see(frame, newest, stands, &self.map, log),
        };
        if let Some(movers) = movers {
            self.movers = movers;
        }
    }

    fn stands(&self) -> bool {
        let Twist2 { linear, angular } = self.twist;
        self.command == Twist2::default() && linear.abs() < 1e-3 && angular.abs() < 1e-2
    }

    fn notice_confidence(&mut self, log: &mut dyn RunLog) {
        let confidence = self.localizer.estimate().confidence;
        if confidence != self.confidence {
            self.confidence = confidence;
            log.record(self.now, Entry::Event(&Event::Confidence(confidence)));
        }
    }

    /// Reads the clock, once a step.
    fn tick(&mut self, log: &mut dyn RunLog) {
        let now = self.devices.clock.now();
        let took = (now - self.now).max(0.0);
        self.now = now;
        // the longest of late: a slow step every few is expected again
        self.period = took.max(self.period * 0.9);
        log.record(now, Entry::Now(now));
    }

    /// Takes a sounding into safety's memory and into the maps.
    fn take(&mut self, sounding: &Sounding, log: &mut dyn RunLog) {
        log.record(sounding.ping.stamp, Entry::Ping(sounding));
        self.safety.hear(sounding);
        let ping = &sounding.ping;
        if !ping.settled || matches!(ping.reading, Reading::Fault) {
            return;
        }
        if ping.bearing.abs() <= self.params.safety.cone {
            self.ahead = Some(*sounding);
        }
        let tracking = self.confidence == Confidence::Tracking;
        if let Some(map) = self.known.as_ref().filter(|_| tracking) {
            self.surprises.hear(sounding, map);
        }
        let shot = sounding.shot();
        // a map that is full only grows no more
        let _ = self.map.update(&self.params.sonar, &shot);
        let stood = self.stands();
        let testimony = match shot.reading {
            Reading::Echo { .. } => Some(shot),
            Reading::NoEcho { listened } if stood => Some(occgrid::Shot {
                reading: Reading::NoEcho {
                    listened: listened.min(self.params.safety.silent_reach),
                },
                ..shot
            }),
            _ => None,
        };
        if let Some(shot) = testimony {
            let _ = self.witness.update(&self.params.sonar, &shot);
        }
    }

    fn decide(&mut self, behaviour: &mut dyn Behaviour, sounding: Option<Sounding>) -> Action {
        behaviour.step(&Observation {
            now: self.now,
            pose: self.localizer.estimate(),
            odom_from_base: self.filter().odom_from_base(),
            status: self.status,
            twist: self.twist,
            sounding,
            ahead: self.ahead,
            bearings: self.devices.sonar.bearings(),
            map: &self.map,
            movers: &self.movers,
            surprises: &self.surprises,
            halt: self.safety.halt(),
            stopped: self.standing,
        })
    }

    fn act(&mut self, action: Action, log: &mut dyn RunLog) -> Option<Outcome> {
        let estimate = self.localizer.estimate();
        log.record(self.now, Entry::Pose(&estimate));
        if let Some(map) = action.learnt {
            self.known = Some(*map);
        }
        let (wanted, why) = match action.motion {
            Motion::Drive(wanted) => (wanted, None),
            Motion::Stand(why) => (Twist2::default(), Some(StopCause::Wanted(why))),
            Motion::Resume => {
                let halted = self.safety.halt().is_some();
                if halted && self.safety.resume(self.now) {
                    log.record(self.now, Entry::Event(&Event::Resumed));
                }
                (Twist2::default(), Some(StopCause::Wanted("resuming")))
            }
            Motion::Done(outcome) => {
                self.halt(StopCause::Wanted("done"), log);
                return Some(outcome);
            }
        };
        let input = self.safety_input(wanted);
        let admitted = self.safety.admit(&input, wanted);
        self.drive(admitted.command, admitted.cause.or(why), log);
        self.aim_next(action.aim);
        None
    }

    fn safety_input(&self, wanted: Twist2) -> SafetyInput {
        let estimate = self.localizer.estimate();
        let along = travel_bearing(wanted);
        let way = Pose2 {
            theta: estimate.map_from_base.theta + along,
            ..estimate.map_from_base
        };
        let radius = self.params.safety.radius;
        let (mut witnessed, mut known_clear) = (0.0, f64::INFINITY);
        if wanted.linear != 0.0 {
            let reach = self.params.look_ahead;
            witnessed = swath(&self.witness, way, radius, reach).free;
            if let Some(map) = &self.known {
                witnessed = swath(map, way, radius, reach).free.max(witnessed);
            }
            // beside the beam, near the body, nothing new is heard: what was heard there before counts
            let clear = match &self.known {
                Some(map) => {
                    let walls = swath(map, way, radius, reach).clear;
                    walls.min(self.surprises.clear(way, radius))
                }
                None => swath(&self.map, way, radius, reach).clear,
            };
            if clear < reach {
                known_clear = clear;
            }
        }
        SafetyInput {
            now: self.now,
            status: self.status,
            odom_from_base: self.filter().odom_from_base(),
            confidence: estimate.confidence,
            period: self.period,
            witnessed,
            known_clear,
        }
    }

    fn drive(&mut self, command: Twist2, cause: Option<StopCause>, log: &mut dyn RunLog) {
        let stands = command == Twist2::default();
        if stands {
            let cause = cause.unwrap_or(StopCause::Wanted("wish of zero"));
            let news = self.standing.is_none_or(|before| !before.is_like(&cause));
            if news {
                log.record(self.now, Entry::Event(&Event::Stop(cause)));
            }
            self.standing = Some(cause);
        } else if self.standing.take().is_some() {
            log.record(self.now, Entry::Event(&Event::Go));
        }
        self.command = command;
        log.record(self.now, Entry::Command(command));
        let sent = if stands {
            self.devices.base.stop()
        } else {
            self.devices.base.drive(command)
        };
        if let Err(error) = sent {
            self.failed(Device::Base, error.kind(), log);
        }
    }

    /// Where the next firing goes: along the way while the wheels drive, as a turn of the sonar takes longer
    /// than a reading stays fresh (S1); else where it is wished.
    fn aim_next(&mut self, wanted: f64) {
        let reach = self.devices.sonar.bearings();
        let driving = self.command.linear != 0.0 || self.twist.linear.abs() > 0.02;
        let aim = if driving && self.command.linear != 0.0 {
            self.safety.aim_along(self.command)
        } else if driving {
            0.0
        } else {
            wanted
        };
        let aim = if aim.is_finite() { aim } else { 0.0 };
        self.aim = aim.clamp(reach.from, reach.to);
    }

    /// Stops the robot and waits until it stands.
    fn halt(&mut self, cause: StopCause, log: &mut dyn RunLog) {
        self.drive(Twist2::default(), Some(cause), log);
        for _ in 0..100 {
            self.devices.clock.sleep(0.02);
            self.feel(log);
            if self.twist.linear.abs() < 1e-3 && self.twist.angular.abs() < 1e-2 {
                break;
            }
        }
        self.tick(log);
    }

    fn failed(&mut self, device: Device, kind: FaultKind, log: &mut dyn RunLog) {
        log.record(self.now, Entry::Fault(device, kind));
        let now = self.devices.clock.now();
        self.safety.fault(now, device, kind);
        if self.failing[device as usize].replace(kind) != Some(kind) {
            log.record(now, Entry::Event(&Event::Fault(device, kind)));
        }
    }

    fn answered(&mut self, device: Device, log: &mut dyn RunLog) {
        if self.failing[device as usize].take().is_some() {
            log.record(self.now, Entry::Event(&Event::Healthy(device)));
        }
    }
}

/// Velocity between two words of a base; zero where no time passed.
fn velocity(before: &BaseStatus, after: &BaseStatus, track: f64) -> Twist2 {
    let time = after.stamp - before.stamp;
    if time <= 0.0 {
        return Twist2::default();
    }
    let rolled = [
        (after.travel.left - before.travel.left) / time,
        (after.travel.right - before.travel.right) / time,
    ];
    Twist2::from_wheels(rolled, track)
}
