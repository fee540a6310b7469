use mobot_hw::serial::asked::{Decoder, encode};
use mobot_hw::serial::{Decode as _, FrameFault, Srf02, Srf02Params, Us100, Us100Params};
use mobot_hw::{Ping, RangeFinder as _};
use occgrid::Reading;

use super::battery::{self, Damage, Dice, Outcome};
use super::rig::{Rig, fails_in_time, is_garbled};

fn us100(rig: &Rig) -> Us100<Rig, Rig> {
    Us100::new(rig.clone(), rig.clone(), Us100Params::default())
}

fn srf02(rig: &Rig) -> Srf02<Rig, Rig> {
    let params = Srf02Params {
        address: 3,
        ..Srf02Params::default()
    };
    Srf02::new(rig.clone(), rig.clone(), params)
}

/// US-100: 55 is answered by millimetres, high byte first (the Python package adafruit_us100, and
/// arduibots.wordpress.com/2014/10/12/us-100-ultrasonic-sensor-in-serial-mode).
/// SRF02: an address and a command (robot-electronics.co.uk/htm/srf02techSer.htm); 54h, "automatically Tx range
/// back", in the maker's table as Arduino programs for SRF01 and SRF02 quote it; two bytes, high byte first
/// (wiki.dfrobot.com, SEN0005); 0 is no echo.
#[test]
fn the_bytes_of_the_makers_pages() {
    let rig = Rig::with(|bytes| {
        assert_eq!(bytes, [0x55]);
        vec![(0.02, vec![0x04, 0xD2])]
    });
    let reading = us100(&rig).ping(0.0).unwrap().reading;
    assert_eq!(reading, Reading::Echo { range: 1.234 });

    let rig = Rig::with(|bytes| {
        assert_eq!(bytes, [3, 0x54]);
        vec![(0.07, vec![0x01, 0x2C])]
    });
    assert_eq!(
        srf02(&rig).ping(0.0).unwrap().reading,
        Reading::Echo { range: 3.0 }
    );

    let rig = Rig::with(|_| vec![(0.07, vec![0, 0])]);
    let silence = Reading::NoEcho { listened: 6.0 };
    assert_eq!(srf02(&rig).ping(0.0).unwrap().reading, silence);
}

#[test]
fn any_answer_and_only_whole_ones() {
    let mut dice = Dice(5);
    for _ in 0..battery::cases() {
        let value = dice.word();
        let found = battery::in_pieces(&mut Decoder::default(), &encode(value), &mut dice);
        assert_eq!(found, [value.to_be_bytes()]);
        let wrong = &[1, 2, 3, 4][..[1, 3, 4][dice.below(3)]];
        let found = battery::in_pieces(&mut Decoder::default(), wrong, &mut dice);
        assert_eq!(found, [[0; 2]; 0]);
    }
    // never quiet: never an answer
    assert_eq!(battery::garbage(Decoder::default()), 0);
    let mut decoder = Decoder::default();
    decoder.reset();
    decoder.quiet();
    assert_eq!(decoder.poll(), None);
}

#[test]
fn answers_that_differ_are_a_fault() {
    let mut answers = [100_u16, 900, 101, 100, 900, 2000].into_iter();
    let rig = Rig::with(move |_| vec![(0.02, answers.next().unwrap().to_be_bytes().to_vec())]);
    let mut sonar = us100(&rig);
    assert_eq!(
        sonar.ping(0.0).unwrap().reading,
        Reading::Echo { range: 0.101 }
    );
    assert_eq!(sonar.ping(0.0).unwrap().reading, Reading::Fault);
}

/// A sonar that hears a wall at 1.5 m, in its number.
fn of_the_wall(ping: Ping) -> Outcome {
    match ping.reading {
        Reading::Echo { range } if (range - 1.5).abs() <= 0.1 => Outcome::Right,
        Reading::Fault => Outcome::Fault,
        _ => Outcome::Wrong,
    }
}

#[test]
fn answers_damaged_on_the_line() {
    for how in [Damage::Dropped, Damage::Doubled] {
        let us = battery::exchanges(
            &[how],
            0.51,
            |_| encode(1500).to_vec(),
            us100,
            |sonar| sonar.ping(0.0).map(of_the_wall),
        );
        let srf = battery::exchanges(
            &[how],
            0.51,
            |_| encode(150).to_vec(),
            srf02,
            |sonar| sonar.ping(0.0).map(of_the_wall),
        );
        assert_eq!((us[0], srf[0]), (0, 0), "the number of bytes tells");
    }
    // a bit turned in a protocol without a checksum: two of three answers agree
    let flipped = [Damage::Flipped];
    let us = battery::exchanges(
        &flipped,
        0.51,
        |_| encode(1500).to_vec(),
        us100,
        |sonar| sonar.ping(0.0).map(of_the_wall),
    );
    let srf = battery::exchanges(
        &flipped,
        0.51,
        |_| encode(150).to_vec(),
        srf02,
        |sonar| sonar.ping(0.0).map(of_the_wall),
    );
    println!("wrong of all with a bit turned in every sixth answer: {us:?} {srf:?}");
    assert!(us[0].max(srf[0]) <= us[1] / 200);
}

#[test]
fn random_bytes_and_quiet() {
    // one in forty pieces has two bytes
    let [found, pieces] = battery::garbage_in_pieces(Decoder::default());
    assert!(found < pieces / 30, "{found} of {pieces}");
    // and then two of three must agree
    let mut dice = Dice(9);
    let rig = Rig::with(move |_| {
        let bytes = (0..1 + dice.below(40)).map(|_| dice.byte()).collect();
        vec![(0.004, bytes)]
    });
    let mut sonar = us100(&rig);
    let calls = battery::cases() / 10;
    let readings: Vec<_> = (0..calls)
        .filter_map(|_| sonar.ping(0.0).ok())
        .filter(|ping| ping.reading != Reading::Fault)
        .collect();
    println!("{} readings of {calls} pings into noise", readings.len());
    assert!(readings.len() <= calls / 200);
}

#[test]
fn failures_are_named_in_time() {
    fails_in_time(0.5, &[1, 2, 3], us100, |sonar| sonar.ping(0.0).map(drop));
    fails_in_time(0.5, &[1, 2, 3], srf02, |sonar| sonar.ping(0.0).map(drop));
    let rig = Rig::with(|_| vec![(0.02, vec![4])]);
    assert!(is_garbled(&us100(&rig).ping(0.0), FrameFault::Half));
}
