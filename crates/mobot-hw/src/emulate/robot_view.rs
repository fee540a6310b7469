//! The simulated robot as one device senses and moves it.

use occgrid::Reading;

use crate::Twist2;
use crate::sim::Simulation;

/// What of a device is stuck.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Stuck {
    /// Nothing.
    #[default]
    Nothing,
    /// All: a sonar repeats its last reading, a servo stands still, both encoders count no more.
    All,
    /// The left encoder.
    Left,
    /// The right encoder.
    Right,
}

/// What is wrong with a device itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceFaults {
    /// What is stuck.
    pub stuck: Stuck,
    /// Its own time passes this many times more slowly, 1 or more: a sonar fires, and everything answers,
    /// that much later.
    pub slow: f64,
}

impl Default for DeviceFaults {
    fn default() -> Self {
        Self {
            stuck: Stuck::Nothing,
            slow: 1.0,
        }
    }
}

/// The simulated robot as one device senses and moves it, its faults included.
#[derive(Debug)]
pub struct RobotView {
    robot: Simulation,
    faults: DeviceFaults,
    /// The device's own time, and the robot's when it was that [s].
    time: [f64; 2],
    reading: Option<Reading>,
    /// Travel at which an encoder is stuck, left and right [m].
    held: [Option<f64>; 2],
}

impl RobotView {
    /// The view of a device without faults.
    #[must_use]
    pub fn new(robot: &Simulation) -> Self {
        let now = robot.lock().time;
        Self {
            robot: robot.clone(),
            faults: DeviceFaults::default(),
            time: [now; 2],
            reading: None,
            held: [None; 2],
        }
    }

    /// Lets the device's time follow the robot's, with these faults from now on.
    pub(crate) fn tick(&mut self, faults: DeviceFaults) {
        if faults.stuck != self.faults.stuck {
            let travel = self.travel();
            let holds = match faults.stuck {
                Stuck::Nothing => [false; 2],
                Stuck::All => [true; 2],
                Stuck::Left => [true, false],
                Stuck::Right => [false, true],
            };
            self.held = [0, 1].map(|side| holds[side].then_some(travel[side]));
        }
        self.faults = faults;
        let now = self.robot.lock().time;
        let passed = (now - self.time[1]) / faults.slow.max(1.0);
        self.time = [self.time[0] + passed, now];
    }

    /// The device's time [s].
    pub(crate) const fn now(&self) -> f64 {
        self.time[0]
    }

    /// Fires the sonar where the pan points.
    pub(crate) fn fire(&mut self) -> Reading {
        let reading = match self.reading {
            Some(last) if self.faults.stuck == Stuck::All => last,
            _ => self.robot.lock().fire(),
        };
        self.reading = Some(reading);
        reading
    }

    /// Sends the pan to a bearing [rad]; it takes its time.
    pub(crate) fn aim(&self, bearing: f64) {
        if self.faults.stuck != Stuck::All {
            self.robot.lock().pan_target = Some(bearing);
        }
    }

    /// Sets the speeds of the robot's wheels [m/s]; it takes its time.
    pub(crate) fn drive(&self, wheels: [f64; 2]) {
        let mut state = self.robot.lock();
        let track = state.params.base.track;
        state.base.command(Twist2::from_wheels(wheels, track));
    }

    fn travel(&self) -> [f64; 2] {
        let travel = self.robot.lock().base.travel();
        [
            self.held[0].unwrap_or(travel.left),
            self.held[1].unwrap_or(travel.right),
        ]
    }

    /// What the robot's wheels have rolled, left and right, in counts of so many metres.
    pub(crate) fn counts(&self, count: f64) -> [i64; 2] {
        self.travel().map(|way| (way / count).round() as i64)
    }

    /// Whether the bumper is pressed, left and right.
    pub(crate) fn bumped(&self) -> [bool; 2] {
        self.robot.lock().base.bumped
    }

    /// Whether the floor ends under the robot.
    pub(crate) fn cliff(&self) -> bool {
        self.robot.lock().base.cliff
    }

    /// Whether its wheels hang in the air.
    pub(crate) fn wheel_drop(&self) -> bool {
        self.robot.lock().base.lifted
    }
}
