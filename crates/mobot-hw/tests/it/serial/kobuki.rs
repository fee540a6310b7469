use mobot_hw::serial::kobuki::{
    COUNT, Decoder, Sensors, base_control, encode, frame, speed_and_radius, wheels_of,
};
use mobot_hw::serial::{Decode as _, Event, Kobuki, KobukiParams};
use mobot_hw::{Clock as _, DifferentialDrive as _, Twist2};

use super::battery::{self, ANY_DAMAGE, Dice};
use super::rig::{Rig, fails_in_time};

/// The protocol's page, and kobuki_core's core_sensors.cpp for the order of the basic part: AA 55, length, payload, exclusive or of length and payload; base control is part
/// 01 of 4 bytes, speed and radius low byte first; the basic part is 01 of 15 bytes.
#[test]
fn the_bytes_of_the_protocols_page() {
    assert_eq!(
        base_control(200, 0),
        [0xAA, 0x55, 6, 1, 4, 0xC8, 0, 0, 0, 0xCB]
    );
    assert_eq!(
        base_control(-100, 1),
        [0xAA, 0x55, 6, 1, 4, 0x9C, 0xFF, 1, 0, 0x61]
    );
    // time 0x1234 ms, right bumper, no wheel drop, left cliff, wheels 0x0102 and 0xFFFE, 16.5 V
    let bytes = [
        0xAA, 0x55, 17, 1, 15, 0x34, 0x12, 1, 0, 4, 0x02, 0x01, 0xFE, 0xFF, 0, 0, 0, 0, 165, 0,
        0x9B,
    ];
    let sensors = Sensors {
        time_ms: 0x1234,
        bumpers: 1,
        wheel_drops: 0,
        cliffs: 4,
        left: 0x0102,
        right: 0xFFFE,
        battery: 165,
    };
    assert_eq!(encode(&sensors), bytes);
    let mut decoder = Decoder::default();
    assert_eq!(decoder.push(&bytes).count(), 0);
    decoder.quiet();
    assert_eq!(decoder.push(&[]).next(), Some(Event::Message(sensors)));
}

/// Base control of 100 mm/s and -100 mm in the tests of github.com/rust-aarhus/kobuki-interface
/// (src/tx/protocol.rs), whose authors drive a Kobuki with it.
#[test]
fn a_command_of_another_driver() {
    let bytes = [0xAA, 0x55, 0x06, 0x01, 0x04, 0x64, 0x00, 0x9C, 0xFF, 0x04];
    assert_eq!(base_control(100, -100), bytes);
}

/// Three frames in a row of a Kobuki that drives, and what they say, as recorded in
/// github.com/bus710/tortuga (test/tortuga_test.go, 2019). They have all parts that the firmware sends.
#[test]
fn frames_of_a_real_base() {
    let frames = [
        "aa554d010f90f1000000ed2b58470d0d00129f00030300000004073c1dfcff0000000506f506f90790060602\
         01010d0e8106a1ff0800c8ff90ff0300cfff10100f00dc0fe00fe00fe00fef0f00000000a1",
        "aa554d010fa4f1000000f42b60470d0d00129f00030300000004073d1d21000000000506ec06f50793060602\
         01010d0e830691ff0b00ddff9dff2000f5ff10100f00d90fdf0fdb0fdf0fef0f000000008f",
        "aa554d010fb8f1000000fc2b67470d0d00129f00030300000004073e1d4f000000000506e406f40794060602\
         01010d0e8506a5ff34001200a3ff39002b0010100f00dc0fe40fdb0fdd0ff00f00000000e7",
    ];
    let mut decoder = Decoder::default();
    let mut found = Vec::new();
    for frame in frames {
        let byte = |k: usize| u8::from_str_radix(&frame[2 * k..2 * k + 2], 16).expect("hex");
        let bytes: Vec<u8> = (0..frame.len() / 2).map(byte).collect();
        found.extend(battery::messages(&mut decoder, &bytes));
    }
    decoder.quiet();
    found.extend(battery::messages(&mut decoder, &[]));
    let told = |time_ms, left, right| Sensors {
        time_ms,
        left,
        right,
        battery: 159,
        ..Sensors::default()
    };
    let expected = [
        told(61_840, 11_245, 18_264),
        told(61_860, 11_252, 18_272),
        told(61_880, 11_260, 18_279),
    ];
    assert_eq!(found, expected);
}

/// kobuki_core, src/driver/diff_drive.cpp: radius v/w, speed that of the outer wheel; on the spot radius 1 and speed w times half the track.
#[test]
fn velocities_become_speed_and_radius() {
    assert_eq!(speed_and_radius(Twist2::new(0.3, 0.0)), (300, 0));
    assert_eq!(speed_and_radius(Twist2::new(0.0, 1.0)), (115, 1));
    assert_eq!(speed_and_radius(Twist2::new(0.2, 0.5)), (258, 400));
    assert_eq!(speed_and_radius(Twist2::new(0.2, -0.5)), (258, -400));
    assert_eq!(speed_and_radius(Twist2::new(-0.2, 0.5)), (-258, -400));
    let mut dice = Dice(6);
    for _ in 0..battery::cases() {
        let mut speed = || f64::from(dice.word()) / 65_536.0 - 0.5;
        let wheels = [speed(), speed()];
        let (speed, radius) = speed_and_radius(Twist2::from_wheels(wheels, 0.23));
        let meant = wheels_of(speed, radius);
        for (wheel, meant) in wheels.iter().zip(meant) {
            // a speed in whole mm/s; straight on from 32.767 m of radius, which takes up to 1.8 mm/s off; a
            // radius in whole millimetres, and none below 1.5 but the spot
            let bound = 0.0025 + 0.0016 * (wheels[1] - wheels[0]).abs() / 0.23;
            assert!((wheel - meant).abs() < bound, "{wheels:?} became {meant:?}");
        }
    }
}

fn any(dice: &mut Dice) -> (Sensors, Vec<u8>) {
    let sensors = Sensors {
        time_ms: dice.word(),
        bumpers: dice.byte() & 7,
        wheel_drops: dice.byte() & 3,
        cliffs: dice.byte() & 7,
        left: dice.word(),
        right: dice.word(),
        battery: dice.byte(),
    };
    let mut payload = encode(&sensors)[3..20].to_vec();
    // docking infrared, inertia, and the rest of what a real frame has
    for (id, length) in [(3, 3), (4, 7), (5, 6), (6, 2), (0x0D, 8), (0x10, 16)] {
        if dice.below(2) == 0 {
            payload.extend([id, length]);
            payload.extend((0..length).map(|_| dice.byte()));
        }
    }
    (sensors, frame(&payload))
}

#[test]
fn any_frame_in_any_pieces_and_no_wrong_one() {
    battery::round_trip(Decoder::default, any);
    assert_eq!(battery::garbage(Decoder::default()), 0);
    battery::damaged(&ANY_DAMAGE, Decoder::default, any);
}

fn base(rate: [i32; 2]) -> Rig {
    let rig = Rig::silent();
    for k in 1..400 {
        let sensors = Sensors {
            left: (65_000 + k * rate[0]) as u16,
            right: (100 + k * rate[1]) as u16,
            ..Sensors::default()
        };
        rig.comes(0.02 * f64::from(k), &encode(&sensors));
    }
    rig
}

fn opened(rig: &Rig) -> Kobuki<Rig, Rig> {
    Kobuki::open(rig.clone(), rig.clone(), KobukiParams::default()).expect("a base")
}

#[test]
fn it_stops_first_counts_through_wraps_and_obeys_the_latch() {
    let rig = base([90, -70]);
    let mut base = opened(&rig);
    assert_eq!(rig.written()[0], base_control(0, 0));
    let first = base.status().unwrap();
    let mut clock = rig.clone();
    clock.sleep(2.0);
    let last = base.status().unwrap();
    let frames = ((last.travel.left - first.travel.left) / COUNT / 90.0).round();
    assert!(frames >= 99.0);
    assert!((last.travel.right - first.travel.right + frames * 70.0 * COUNT).abs() < 1e-9);

    clock.sleep(0.1);
    base.drive(Twist2::new(0.1, 0.0)).unwrap();
    assert_eq!(rig.last(), base_control(100, 0));
    clock.sleep(0.21);
    base.status().unwrap();
    assert_eq!(rig.last(), base_control(0, 0));
    base.drive(Twist2::new(0.1, 0.0)).unwrap();
    drop(base);
    assert_eq!(rig.last(), base_control(0, 0));
}

#[test]
fn failures_are_named_in_time() {
    let silent = |rig: &Rig| {
        for k in 1..3 {
            rig.comes(0.02 * f64::from(k), &encode(&Sensors::default()));
        }
        let base = opened(rig);
        let mut clock = rig.clone();
        clock.sleep(1.0);
        base
    };
    fails_in_time(0.1, &[0xAA, 0x55, 17, 1, 15, 1], silent, |base| {
        base.status().map(drop)
    });
}
