use mobot_hw::serial::create2::{COUNT, Decoder, Mode, Sensors, drive_direct, encode};
use mobot_hw::serial::{Create2, Create2Params, Decode as _, Event, SerialError};
use mobot_hw::{Clock as _, DifferentialDrive as _, Twist2};

use super::battery::{self, ANY_DAMAGE, Dice};
use super::rig::{Rig, fails_in_time};

/// Commands: pycreate2 0.8.0 writes these bytes for `drive_direct(-200, 200)`, `(500, -500)` and `(-24, 24)`, right
/// wheel first. Streams: the example of the OI specification, opcode 148, for packets 29 and 13, and libcreate's
/// serial_stream.cpp: the length counts ids and data, two bytes are high byte first, all bytes add up to 0.
/// Sizes of packets: libcreate's data.cpp.
#[test]
fn the_bytes_of_the_specification() {
    assert_eq!(drive_direct(200, -200), [145, 255, 56, 0, 200]);
    assert_eq!(drive_direct(-500, 500), [145, 1, 244, 254, 12]);
    assert_eq!(drive_direct(24, -24), [145, 255, 232, 0, 24]);
    let example = [19, 5, 29, 2, 25, 13, 0, 163_u8];
    assert_eq!(example.iter().fold(0_u8, |s, b| s.wrapping_add(*b)), 0);
    assert_eq!(usize::from(example[1]), example.len() - 3);
    // left bumper, left cliff, left wheel 0x1234, right wheel 0xFFFE, safe mode
    let frame = [
        19, 18, 7, 2, 9, 1, 10, 0, 11, 0, 12, 0, 43, 0x12, 0x34, 44, 0xFF, 0xFE, 35, 2, 0xE8,
    ];
    assert_eq!(frame.iter().fold(0_u8, |s, b| s.wrapping_add(*b)), 0);
    let sensors = Sensors {
        bumps_and_drops: 2,
        cliffs: [true, false, false, false],
        left: 0x1234,
        right: 0xFFFE,
        mode: Mode::Safe,
    };
    let found: Vec<_> = Decoder::default().push(&frame).collect();
    assert_eq!(found, [Event::Message(sensors)]);
    assert_eq!(encode(&sensors), frame);
}

fn any(dice: &mut Dice) -> (Sensors, Vec<u8>) {
    let sensors = Sensors {
        bumps_and_drops: dice.byte() & 15,
        cliffs: [0; 4].map(|_: u8| dice.below(2) == 0),
        left: dice.word(),
        right: dice.word(),
        mode: [Mode::Off, Mode::Passive, Mode::Safe, Mode::Full][dice.below(4)],
    };
    (sensors, encode(&sensors))
}

#[test]
fn any_frame_in_any_pieces_and_no_wrong_one() {
    battery::round_trip(Decoder::default, any);
    assert_eq!(battery::garbage(Decoder::default()), 0);
    battery::damaged(&ANY_DAMAGE, Decoder::default, any);
}

/// A base that streams for some seconds once it is asked, its wheels turning at so many counts a frame; it
/// changes its mode after 0.3 s.
fn base(rate: [i32; 2], [first, then]: [Mode; 2]) -> Rig {
    Rig::with(move |bytes| {
        if bytes[0] != 148 {
            return Vec::new();
        }
        let frame = |k: i32| {
            let sensors = Sensors {
                left: (65_000 + k * rate[0]) as u16,
                right: (500 + k * rate[1]) as u16,
                mode: if k < 20 { first } else { then },
                ..Sensors::default()
            };
            (0.015 * f64::from(k), encode(&sensors))
        };
        (1..600).map(frame).collect()
    })
}

fn opened(rig: &Rig) -> Create2<Rig, Rig> {
    Create2::open(rig.clone(), rig.clone(), Create2Params::default()).expect("a base")
}

#[test]
fn it_stops_first_and_enters_safe_mode() {
    let rig = base([0, 0], [Mode::Safe; 2]);
    let base = opened(&rig);
    let written = rig.written();
    assert_eq!(written[0], [145, 0, 0, 0, 0, 145, 0, 0, 0, 0]);
    let rest = [
        &[150, 0][..],
        &[128],
        &[131],
        &[148, 8, 7, 9, 10, 11, 12, 43, 44, 35],
        &[145, 0, 0, 0, 0],
    ];
    assert_eq!(written[1..], rest);
    drop(base);
    assert_eq!(rig.last(), [145, 0, 0, 0, 0]);
}

#[test]
fn counters_wrap_and_nothing_is_lost() {
    let rig = base([7, -5], [Mode::Safe; 2]);
    let mut base = opened(&rig);
    let first = base.status().unwrap();
    let mut clock = rig.clone();
    clock.sleep(3.0);
    let last = base.status().unwrap();
    let frames = ((last.travel.left - first.travel.left) / COUNT / 7.0).round();
    assert!(frames >= 199.0, "{frames}");
    assert!((last.travel.left - first.travel.left - frames * 7.0 * COUNT).abs() < 1e-9);
    assert!((last.travel.right - first.travel.right + frames * 5.0 * COUNT).abs() < 1e-9);
}

#[test]
fn commands_are_millimetres_right_first_and_do_not_outlive_the_latch() {
    let rig = base([0, 0], [Mode::Safe; 2]);
    let mut base = opened(&rig);
    let mut clock = rig.clone();
    clock.sleep(0.1);
    base.drive(Twist2::new(0.0, 0.2)).unwrap();
    assert_eq!(rig.last(), drive_direct(-24, 24));
    clock.sleep(0.19);
    base.status().unwrap();
    assert_eq!(rig.last(), drive_direct(-24, 24));
    clock.sleep(0.05);
    base.status().unwrap();
    assert_eq!(rig.last(), drive_direct(0, 0));
    for command in [Twist2::new(f64::NAN, 0.0), Twist2::new(0.1, f64::INFINITY)] {
        base.drive(Twist2::new(0.05, 0.0)).unwrap();
        base.drive(command).unwrap();
        assert_eq!(rig.last(), drive_direct(0, 0));
    }
}

#[test]
fn a_base_that_leaves_safe_mode_is_not_driven() {
    let rig = base([0, 0], [Mode::Passive; 2]);
    let params = Create2Params::default();
    let refused = Create2::open(rig.clone(), rig.clone(), params).map(drop);
    assert!(matches!(refused, Err(SerialError::Refused { .. })));

    let rig = base([0, 0], [Mode::Safe, Mode::Passive]);
    let mut base = opened(&rig);
    let mut clock = rig.clone();
    clock.sleep(0.4);
    assert!(matches!(base.status(), Err(SerialError::Refused { .. })));
    let refused = base.drive(Twist2::new(0.1, 0.0));
    assert!(matches!(refused, Err(SerialError::Refused { .. })));
    assert_eq!(rig.last(), drive_direct(0, 0));
}

#[test]
fn a_command_cut_off_is_ended_by_stops() {
    let rig = base([0, 0], [Mode::Safe; 2]);
    let mut base = opened(&rig);
    rig.takes(3);
    let result = base.drive(Twist2::new(0.05, 0.0));
    let expected = SerialError::HalfWritten {
        expected: 5,
        found: 3,
    };
    assert_eq!(result, Err(expected));
    assert_eq!(rig.last()[0], 145);
}

#[test]
fn failures_are_named_in_time() {
    // the frames of the opening are over after nine seconds
    let silent = |rig: &Rig| {
        for k in 0..5 {
            let sensors = Sensors {
                mode: Mode::Safe,
                ..Sensors::default()
            };
            rig.comes(0.1 + 0.001 * f64::from(k), &encode(&sensors));
        }
        let base = opened(rig);
        let mut clock = rig.clone();
        clock.sleep(1.0);
        base
    };
    fails_in_time(0.1, &[19, 18, 7, 0, 8], silent, |base| {
        base.status().map(drop)
    });
}
