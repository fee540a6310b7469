use mobot_hw::serial::maestro::{Command, answer};
use mobot_hw::serial::{Burst, Maestro, MaestroParams};
use mobot_hw::{DeviceError as _, FaultKind, PanActuator as _};

use super::battery::{self, ANY_DAMAGE, Dice, Outcome};
use super::rig::{Rig, fails_in_time, timed};

/// Pololu's manual 0J40, section 5.e: 84 02 70 2E sets channel 2 to 1500 us, 87 05 0C 01 the speed of
/// channel 5 to 140.
#[test]
fn the_bytes_of_the_manual() {
    assert_eq!(Command::Target(2, 6000).bytes(), [0x84, 0x02, 0x70, 0x2E]);
    assert_eq!(Command::Speed(5, 140).bytes(), [0x87, 0x05, 0x0C, 0x01]);
    assert_eq!(
        Command::Acceleration(5, 140).bytes(),
        [0x89, 0x05, 0x0C, 0x01]
    );
    assert_eq!(Command::Position(2).bytes(), [0x90, 2]);
    assert_eq!(Command::Moving.bytes(), [0x93]);
    assert_eq!(Command::Errors.bytes(), [0xA1]);
    assert_eq!(Command::Home.bytes(), [0xA2]);
    assert_eq!(answer(0x1234), [0x34, 0x12]);
}

fn driver(rig: &Rig) -> Maestro<Rig, Rig> {
    Maestro::new(rig.clone(), rig.clone(), MaestroParams::default())
}

fn device(errors: u16, position: u16) -> Rig {
    Rig::with(move |bytes| match bytes[0] {
        0xA1 => vec![(0.002, answer(errors).to_vec())],
        0x90 => vec![(0.002, answer(position).to_vec())],
        _ => Vec::new(),
    })
}

#[test]
fn a_turn_takes_as_long_as_it_is_wide() {
    let rig = device(0, 7000);
    let mut pan = driver(&rig);
    let bearing = 250.0 / MaestroParams::default().us_per_rad;
    pan.turn_to(bearing).unwrap();
    assert_eq!(rig.written()[0], Command::Target(0, 7000).bytes());
    let (there, took) = timed(&rig, || pan.turn_to(bearing).unwrap());
    assert!((there - bearing).abs() < 1e-9);
    assert!(took < 0.1, "no turn took {took} s");
    assert!(pan.turn_to(3.0).is_err());
}

#[test]
fn a_servo_elsewhere_is_refused() {
    for rig in [device(0x20, 6000), device(0, 5000)] {
        let error = driver(&rig).turn_to(0.0).unwrap_err();
        assert_eq!(error.kind(), FaultKind::Refused, "{error}");
    }
}

#[test]
fn any_command_and_answer_in_any_pieces() {
    let mut dice = Dice(10);
    for _ in 0..battery::cases() {
        let (channel, value) = (dice.byte() & 0x7F, dice.word() & 0x3FFF);
        let [command, back, low, high] = Command::Target(channel, value).bytes()[..] else {
            panic!("four bytes");
        };
        // as the manual says: bit 7 set in the command alone, seven bits a data byte
        assert!(command >= 0x80 && [back, low, high].iter().all(|b| *b < 0x80));
        assert_eq!(
            (back, u16::from(low) + 128 * u16::from(high)),
            (channel, value)
        );
        let found = battery::in_pieces(&mut Burst::<2>::default(), &answer(value), &mut dice);
        assert_eq!(found, [value.to_le_bytes()]);
    }
}

#[test]
fn answers_damaged_on_the_line() {
    // a servo that stands where it was told, 7000; then one that stands elsewhere
    let there = |bytes: &[u8]| match bytes[0] {
        0xA1 => answer(0).to_vec(),
        0x90 => answer(7000).to_vec(),
        _ => Vec::new(),
    };
    let bearing = 250.0 / MaestroParams::default().us_per_rad;
    let turn = |pan: &mut Maestro<Rig, Rig>| {
        pan.turn_to(bearing).map(|there| {
            if (there - bearing).abs() < 1e-9 {
                Outcome::Right
            } else {
                Outcome::Wrong
            }
        })
    };
    let longest = 1008.0 / MaestroParams::default().us_per_rad / 5.0 + 0.2 + 0.22;
    let [wrong, calls] = battery::exchanges(&ANY_DAMAGE, longest, there, driver, turn);
    assert_eq!((wrong, calls), (0, 20_000));
    let mut dice = Dice(11);
    for elsewhere in [6000, 7100, 8000] {
        for _ in 0..1000 {
            let how = dice.below(3);
            let place = dice.below(2);
            let bit = 1 << dice.below(8);
            let rig = Rig::with(move |bytes| match bytes[0] {
                0xA1 => vec![(0.002, answer(0).to_vec())],
                0x90 => {
                    let mut bytes = answer(elsewhere).to_vec();
                    match how {
                        0 => drop(bytes.remove(place)),
                        1 => bytes.insert(place, bytes[place]),
                        _ => bytes[place] ^= bit,
                    }
                    vec![(0.002, bytes)]
                }
                _ => Vec::new(),
            });
            let result = driver(&rig).turn_to(bearing);
            assert!(result.is_err(), "{elsewhere} {how} {place} {bit}");
        }
    }
    let [found, pieces] = battery::garbage_in_pieces(Burst::<2>::default());
    assert!(found < pieces / 30, "{found} of {pieces}");
}

#[test]
fn failures_are_named_in_time() {
    // the whole turn comes before the first answer
    let turn = 1008.0 / MaestroParams::default().us_per_rad / 5.0 + 0.2;
    fails_in_time(turn + 0.1, &[1, 2, 3], driver, |pan| {
        pan.turn_to(0.0).map(drop)
    });
}
