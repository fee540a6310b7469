use mobot_hw::RangeFinder as _;
use mobot_hw::serial::urm37::{Decoder, INVALID, RANGE, TEMPERATURE, answer, command};
use mobot_hw::serial::{Urm37, Urm37Params};
use occgrid::Reading;

use super::battery::{self, ANY_DAMAGE, Dice};
use super::rig::{Rig, fails_in_time, timed};

/// wiki.dfrobot.com/sen0001: 22 angle 00 sum, three steps are 18 degrees; 11 00 00 11 asks for the
/// temperature; 22 FF FF sum says that nothing was measured.
#[test]
fn the_frames_of_the_makers_page() {
    // the manual's sample
    assert_eq!(command(0), [0x22, 0x00, 0x00, 0x22]);
    assert_eq!(command(3), [0x22, 0x03, 0x00, 0x25]);
    assert_eq!(answer(TEMPERATURE, 0), [0x11, 0x00, 0x00, 0x11]);
    let mut decoder = Decoder::default();
    let stream = [0x22, 0x00, 0x64, 0x86, 0x22, 0xFF, 0xFF, 0x20];
    let found = battery::in_pieces(&mut decoder, &stream, &mut Dice(4));
    assert_eq!(found, [100, INVALID]);
}

fn any(dice: &mut Dice) -> (u16, Vec<u8>) {
    let cm = match dice.below(20) {
        0 => INVALID,
        _ => dice.word() % 1024,
    };
    (cm, answer(RANGE, cm).to_vec())
}

#[test]
fn any_answer_in_any_pieces_and_no_wrong_one() {
    battery::round_trip(Decoder::default, any);
    assert_eq!(battery::garbage(Decoder::default()), 0);
    battery::damaged(&ANY_DAMAGE, Decoder::default, any);
}

fn driver(rig: &Rig) -> Urm37<Rig, Rig> {
    Urm37::new(rig.clone(), rig.clone(), Urm37Params::default())
}

#[test]
fn a_turn_is_one_command_and_the_reading_another() {
    let rig = Rig::with(|bytes| {
        assert_eq!(bytes[0], 0x22);
        vec![(0.05, answer(RANGE, 100 + u16::from(bytes[1])).to_vec())]
    });
    let mut sonar = driver(&rig);
    let bearing = 18.0_f64.to_radians();
    let ping = sonar.ping(bearing).unwrap();
    assert_eq!(rig.written(), [command(26), command(26)]);
    assert_eq!(ping.reading, Reading::Echo { range: 1.26 });
    assert!((ping.bearing - bearing).abs() < 1e-12);
    let (again, took) = timed(&rig, || sonar.ping(bearing).unwrap());
    assert_eq!((again.reading, rig.written().len()), (ping.reading, 3));
    assert!(took < 0.1);
    assert!(sonar.ping(2.5).is_err());
}

#[test]
fn failures_are_named_in_time() {
    fails_in_time(0.3, &[0x22, 0x00, 0x64, 0x00], driver, |sonar| {
        sonar.ping(0.0).map(drop)
    });
}
