use mobot_hw::serial::arduino::{Answer, Command, Decoder};
use mobot_hw::serial::{Arduino, ArduinoParams, SerialError};
use mobot_hw::{Clock as _, DifferentialDrive as _, PanActuator as _, RangeFinder as _, Twist2};
use occgrid::Reading;

use super::battery::{self, ANY_DAMAGE, Dice, Outcome};
use super::rig::{Answer as Scheduled, Rig, fails_in_time};

/// commands.h and runCommand() of the firmware: letter, arguments after spaces, carriage return; println()
/// ends answers with carriage return and line feed; `e` prints two numbers with a space between.
#[test]
fn the_lines_of_the_firmware() {
    assert_eq!(Command::Baud.bytes(), b"b\r");
    assert_eq!(Command::Motors(-12, 40).bytes(), b"m -12 40\r");
    assert_eq!(Command::Servo(0, 90).bytes(), b"s 0 90\r");
    assert_eq!(Command::Ping(4).bytes(), b"p 4\r");
    assert_eq!(Command::Encoders.bytes(), b"e\r");
    let text = b"57600\r\n-120 2147483647\r\nOK\r\nInvalid Command\r\n";
    let expected = [
        Answer::One(57600),
        Answer::Two(-120, i32::MAX),
        Answer::Ok,
        Answer::Invalid,
    ];
    assert_eq!(battery::messages(&mut Decoder::default(), text), expected);
    let wrong = b"OK\n5 \r\n 5\r\n5 6 7\r\n99999999999\r\n+5\r\nO\xFFK\r\n\r\n";
    assert_eq!(battery::messages(&mut Decoder::default(), wrong), []);
    // the firmware's arguments have 16 bytes
    let longest = Command::Motors(i16::MIN, i16::MIN).bytes();
    assert!(longest.split(|b| *b == b' ').all(|a| a.len() < 16));
}

fn any(dice: &mut Dice) -> (Answer, Vec<u8>) {
    let mut number = || dice.next() as i32;
    let answer = match number() & 3 {
        0 => Answer::Ok,
        1 => Answer::Invalid,
        2 => Answer::One(number()),
        _ => Answer::Two(number(), number()),
    };
    (answer, answer.bytes())
}

#[test]
fn any_answer_in_any_pieces() {
    battery::round_trip(Decoder::default, any);
}

#[test]
fn random_bytes_and_lost_bytes() {
    // without a checksum a number and an end may come by chance
    assert!(battery::garbage(Decoder::default()) <= battery::cases() / 1000);
    let [found, pieces] = battery::garbage_in_pieces(Decoder::default());
    assert!(found <= pieces / 1000, "{found} of {pieces}");
    // only what the form tells is found: lines and their ends
    let ends = |dice: &mut Dice| {
        let (left, right) = (1000 + dice.below(9000), 1000 + dice.below(9000));
        let answer = Answer::Two(left as i32, right as i32);
        (answer, answer.bytes())
    };
    let mut dice = Dice(7);
    for _ in 0..1000 {
        let (_, mut bytes) = ends(&mut dice);
        let end = bytes.len() - 1 - dice.below(2);
        bytes.remove(end);
        let (whole, next) = ends(&mut dice);
        let (last, after) = ends(&mut dice);
        let stream = [bytes, next, after].concat();
        let found = battery::in_pieces(&mut Decoder::default(), &stream, &mut dice);
        assert!(found == [whole, last] || found == [last], "{found:?}");
    }
}

#[test]
fn answers_damaged_on_the_line() {
    let firmware = |bytes: &[u8]| firmware(bytes).remove(0).1;
    let status = |base: &mut Arduino<Rig, Rig>| {
        let travel = base.status()?.travel;
        // the wheels stand; a digit may turn into one nearby, of which nothing remains in the end
        let near = travel.left.abs() < 0.2 && travel.right.abs() < 0.2;
        Ok(if near { Outcome::Right } else { Outcome::Wrong })
    };
    let [wrong, calls] = battery::exchanges(&ANY_DAMAGE, 0.3, firmware, opened, status);
    println!("{wrong} wrong states of {calls} with a byte damaged in every sixth answer");
    assert!(wrong <= calls / 1000);
    let ping = |base: &mut Arduino<Rig, Rig>| {
        Ok(match base.ping(0.0)?.reading {
            Reading::Echo { range } if (range - 1.23).abs() <= 0.1 => Outcome::Right,
            Reading::Fault => Outcome::Fault,
            _ => Outcome::Wrong,
        })
    };
    let [wrong, calls] = battery::exchanges(&ANY_DAMAGE, 1.26, firmware, opened, ping);
    println!("{wrong} wrong pings of {calls} with a byte damaged in every sixth answer");
    assert!(wrong <= calls / 100);
}

/// The firmware, as far as it is asked here: late after a reset, one servo, a sonar that hears 123 cm.
fn firmware(bytes: &[u8]) -> Scheduled {
    let text = std::str::from_utf8(bytes).expect("text");
    let answer = match text.trim_end().split(' ').next().expect("a letter") {
        "b" => Answer::One(57_600),
        "e" => Answer::Two(i32::MAX - 10, 250),
        "m" | "s" => Answer::Ok,
        "p" => Answer::One(123),
        _ => Answer::Invalid,
    };
    vec![(0.004, answer.bytes())]
}

fn opened(rig: &Rig) -> Arduino<Rig, Rig> {
    Arduino::open(rig.clone(), rig.clone(), ArduinoParams::default()).expect("a firmware")
}

#[test]
fn base_servo_and_sonar_share_one_line() {
    let rig = Rig::with(firmware);
    let arduino = opened(&rig);
    let (mut base, mut pan, mut sonar) = (arduino.clone(), arduino.clone(), arduino);
    let mut clock = rig.clone();
    clock.sleep(0.1);
    base.drive(Twist2::new(0.09, 0.0)).unwrap();
    // 0.09 m/s of 5000 counts a metre in 30 frames a second
    assert_eq!(rig.last(), b"m 15 15\r");
    pan.turn_to(0.5).unwrap();
    assert_eq!(rig.last(), b"s 0 119\r");
    assert_eq!(
        sonar.ping(0.0).unwrap().reading,
        Reading::Echo { range: 1.23 }
    );
    assert_eq!(rig.last(), b"p 4\r");
    // by now the command to drive is old
    base.status().unwrap();
    let written = rig.written();
    assert_eq!(
        written[written.len() - 3..],
        [&b"m 0 0\r"[..], b"e\r", b"e\r"]
    );
    drop((base, pan));
    assert!(sonar.ping(0.3).is_err());
    drop(sonar);
    assert_eq!(rig.last(), b"m 0 0\r");
}

#[test]
fn counters_wrap_and_nothing_is_lost() {
    let mut count = i32::MAX - 10;
    let rig = Rig::with(move |bytes| {
        if bytes != b"e\r" {
            return firmware(bytes);
        }
        count = count.wrapping_add(7);
        vec![(0.004, Answer::Two(count, count.wrapping_neg()).bytes())]
    });
    let mut base = opened(&rig);
    let first = base.status().unwrap().travel;
    for k in 1..10 {
        let travel = base.status().unwrap().travel;
        assert!((travel.left - first.left - f64::from(k) * 7.0 / 5000.0).abs() < 1e-9);
        assert!((travel.right - first.right + f64::from(k) * 7.0 / 5000.0).abs() < 1e-9);
    }
}

#[test]
fn a_late_answer_is_not_taken_for_the_next_one() {
    let mut lost = 0;
    let rig = Rig::with(move |bytes| {
        if bytes == b"p 4\r" {
            lost += 1;
            // so late that the driver has given up
            let late = if lost == 1 { 1.3 } else { 0.02 };
            return vec![(late, Answer::One(99 + lost).bytes())];
        }
        firmware(bytes)
    });
    let mut sonar = opened(&rig);
    assert!(matches!(sonar.ping(0.0), Err(SerialError::Silent { .. })));
    let mut clock = rig.clone();
    clock.sleep(0.1);
    assert_eq!(
        sonar.ping(0.0).unwrap().reading,
        Reading::Echo { range: 1.02 }
    );
    let written = rig.written();
    let last = [&b"\r"[..], b"b\r", b"p 4\r", b"p 4\r"];
    assert_eq!(written[written.len() - 4..], last);
}

#[test]
fn failures_are_named_in_time() {
    let silent = |rig: &Rig| {
        // answers of the opening: to its "b", and to its "m"
        rig.comes(0.031, b"57600\r\n");
        rig.comes(0.042, b"OK\r\n");
        opened(rig)
    };
    fails_in_time(0.15, b"nothing\r\n", silent, |base| base.status().map(drop));
}
