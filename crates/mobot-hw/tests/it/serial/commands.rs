//! Any command, in any pieces, is what the emulated device does.

use mobot_hw::emulate::{
    ArduinoEmulator, Create2Emulator, Emulator, KobukiEmulator, MaestroEmulator, RobotView,
};
use mobot_hw::serial::{ArduinoParams, arduino, create2, kobuki, maestro};
use mobot_hw::sim::{Building, RobotParams, Simulation, World};

use super::battery::{self, Dice};

fn robot() -> RobotView {
    let world = World::new(&Building::default()).expect("a world");
    RobotView::new(&Simulation::new(world, RobotParams::default(), 1).expect("a robot"))
}

/// Feeds a command in random pieces; gives the answers.
fn step(
    emulator: &mut dyn Emulator,
    robot: &mut RobotView,
    bytes: &[u8],
    dice: &mut Dice,
) -> Vec<u8> {
    let (mut rest, mut answers) = (bytes, Vec::new());
    while !rest.is_empty() {
        let (piece, after) = rest.split_at(1 + dice.below(rest.len()));
        answers.extend(emulator.step(piece, robot));
        rest = after;
    }
    answers
}

/// Gives the wheels' speeds that any drive command led to, and those it meant [m/s].
fn drives(
    mut emulator: impl Emulator,
    start: &[u8],
    mut any: impl FnMut(&mut Dice) -> (Vec<u8>, [f64; 2]),
) {
    let (mut robot, mut dice) = (robot(), Dice(12));
    step(&mut emulator, &mut robot, start, &mut dice);
    for _ in 0..battery::cases() {
        let (bytes, meant) = any(&mut dice);
        step(&mut emulator, &mut robot, &bytes, &mut dice);
        let wheels = emulator.wheels().expect("it has wheels");
        let apart = |k: usize| (wheels[k] - meant[k]).abs();
        assert!(apart(0) < 1e-9 && apart(1) < 1e-9, "{bytes:?}: {wheels:?}");
    }
}

#[test]
fn any_drive_command_in_any_pieces() {
    drives(
        Create2Emulator::default(),
        &[create2::START, create2::SAFE],
        |dice| {
            let [left, right] = [0; 2].map(|_| dice.below(1001) as i16 - 500);
            let meant = [left, right].map(|w| f64::from(w) / 1000.0);
            (create2::drive_direct(left, right).to_vec(), meant)
        },
    );
    drives(KobukiEmulator::default(), &[], |dice| {
        let (speed, radius) = (dice.word() as i16, dice.word() as i16);
        let meant = kobuki::wheels_of(speed, radius);
        (kobuki::base_control(speed, radius), meant)
    });
    let params = ArduinoParams::default();
    drives(ArduinoEmulator::new(params), b"", |dice| {
        let (left, right) = (dice.word() as i16, dice.word() as i16);
        let speed = params.frames_per_second / params.counts_per_metre;
        let meant = [left, right].map(|w| f64::from(w) * speed);
        (arduino::Command::Motors(left, right).bytes(), meant)
    });
}

#[test]
fn any_target_in_any_pieces() {
    let (mut robot, mut dice, mut emulator) = (robot(), Dice(13), MaestroEmulator::default());
    for _ in 0..battery::cases() {
        let target = dice.word() & 0x3FFF;
        let bytes = [
            maestro::Command::Target(0, target).bytes(),
            maestro::Command::Position(0).bytes(),
            maestro::Command::Errors.bytes(),
        ]
        .concat();
        let answers = step(&mut emulator, &mut robot, &bytes, &mut dice);
        let [low, high, errors @ ..] = &answers[..] else {
            panic!("{answers:?}");
        };
        // the Maestro's own limits
        let there = u16::from_le_bytes([*low, *high]);
        assert_eq!(there, target.clamp(992 * 4, 2000 * 4));
        assert_eq!(errors, [0, 0]);
    }
}
