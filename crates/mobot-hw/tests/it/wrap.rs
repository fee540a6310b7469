//! Wrappers around devices: what is recorded is what was answered, a replay gives the same, faults come
//! as planned.

mod faulty;
mod replayed;

use mobot_hw::sim::{RobotParams, Simulation, World};

/// A corridor of 4 m by 2 m, the robot at its west end.
pub(crate) const CORRIDOR: &str = "
start = [1.0, 0.0, 0.0]
walls = [
    { from = [0, 1], to = [4, 1] },
    { from = [0, -1], to = [4, -1] },
    { from = [0, -1], to = [0, 1] },
    { from = [4, -1], to = [4, 1] },
]
";

fn simulation(seed: u64) -> Simulation {
    let world = World::from_toml(CORRIDOR).expect("a world");
    Simulation::new(world, RobotParams::default(), seed).expect("a world")
}
