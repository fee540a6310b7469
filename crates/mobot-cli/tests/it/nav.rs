//! The robot at work in simulated buildings.

use std::cell::RefCell;

use mobot_cli::nav::{
    Action, Behaviour, Devices, Entry, Event, FilterParams, Observation, Outcome, RunLog, Runner,
    RunnerParams, StopCause,
};
use mobot_hw::Twist2;
use mobot_hw::sim::{
    RobotParams, SimBase, SimCamera, SimClock, SimPan, SimSonar, Simulation, World,
};

pub(crate) type SimDevices =
    Devices<SimBase, mobot_hw::Turret<SimSonar, SimPan>, SimCamera, SimClock>;

pub(crate) fn devices(simulation: &Simulation) -> SimDevices {
    Devices {
        base: simulation.base(),
        sonar: simulation.turret(),
        camera: None,
        clock: simulation.clock(),
    }
}

/// Keeps what happened, as text.
#[derive(Debug, Default)]
pub(crate) struct Events(pub(crate) RefCell<Vec<(f64, Event)>>);

impl RunLog for Events {
    fn record(&mut self, time: f64, entry: Entry<'_>) {
        if let Entry::Event(event) = entry {
            self.0.borrow_mut().push((time, event.clone()));
        }
    }
}

/// Drives straight on until something stops it.
struct Onward;

impl Behaviour for Onward {
    fn step(&mut self, seen: &Observation<'_>) -> Action {
        match seen.stopped {
            Some(StopCause::Obstacle { .. }) => Action::done(Outcome::Done),
            _ => Action::drive(Twist2::new(0.3, 0.0)),
        }
    }
}

const ROOM: &str = r#"
name = "room"
start = [1.0, 2.0, 0.0]
[[walls]]
from = [0.0, 0.0]
to = [5.0, 0.0]
[[walls]]
from = [5.0, 0.0]
to = [5.0, 4.0]
[[walls]]
from = [5.0, 4.0]
to = [0.0, 4.0]
[[walls]]
from = [0.0, 4.0]
to = [0.0, 0.0]
"#;

#[test]
fn a_robot_drives_a_few_metres_and_stops_for_the_wall() {
    let world = World::from_toml(ROOM).expect("a world");
    let simulation = Simulation::new(world, RobotParams::default(), 7).expect("a robot");
    let start = simulation.truth().map_from_base;
    let params = RunnerParams {
        // a base that was calibrated: nothing else corrects the pose here
        filter: FilterParams {
            wheel_sigma: 0.003,
            ..FilterParams::default()
        },
        ..RunnerParams::default()
    };
    let mut runner = Runner::new(devices(&simulation), start, params).expect("a runner");
    let mut log = Events::default();
    let outcome = runner.run(&mut Onward, &mut log, &|| simulation.truth().time > 60.0);
    let truth = simulation.truth();
    assert_eq!(outcome, Outcome::Done, "{:?}", log.0.borrow());
    assert_eq!(truth.collisions, 0);
    assert!(truth.driven > 2.0, "{truth:?}");
    assert!(truth.least_clearance > 0.1, "{truth:?}");
    let caused = |(_, event): &(f64, Event)| matches!(event, Event::Stop(StopCause::Obstacle { clear }) if *clear < 0.2);
    assert!(log.0.borrow().iter().any(caused), "{:?}", log.0.borrow());
    let estimate = runner.filter().estimate();
    assert!(
        estimate
            .map_from_base
            .position()
            .distance(truth.map_from_base.position())
            < 0.1
    );
}

#[test]
fn an_interrupted_robot_stands_before_the_run_ends() {
    let world = World::from_toml(ROOM).expect("a world");
    let simulation = Simulation::new(world, RobotParams::default(), 7).expect("a robot");
    let start = simulation.truth().map_from_base;
    let params = RunnerParams {
        // a base that was calibrated: nothing else corrects the pose here
        filter: FilterParams {
            wheel_sigma: 0.003,
            ..FilterParams::default()
        },
        ..RunnerParams::default()
    };
    let mut runner = Runner::new(devices(&simulation), start, params).expect("a runner");
    let mut log = Events::default();
    let outcome = runner.run(&mut Onward, &mut log, &|| simulation.truth().driven > 1.0);
    assert_eq!(outcome, Outcome::Interrupted);
    assert!(simulation.truth().twist.linear.abs() < 1e-3);
    let last = log.0.borrow().last().cloned();
    assert_eq!(last.map(|l| l.1), Some(Event::Stop(StopCause::Interrupted)));
}
