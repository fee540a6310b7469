use mobot_hw::RangeFinder as _;
use mobot_hw::serial::ff::{Decoder, MAX_MM, encode};
use mobot_hw::serial::{Decode as _, Event, FfParams, FfSonar, FrameFault};
use occgrid::Reading;

use super::battery::{self, ANY_DAMAGE, Dice};
use super::rig::{Rig, fails_in_time};

/// wiki.dfrobot.com, SEN0311: FF 07 A1 A7 is 1953 mm.
#[test]
fn the_frame_of_the_makers_page() {
    assert_eq!(encode(1953), [0xFF, 0x07, 0xA1, 0xA7]);
    let mut decoder = Decoder::default();
    assert_eq!(decoder.push(&[0xFF, 0x07, 0xA1, 0xA7]).count(), 0);
    decoder.quiet();
    assert_eq!(decoder.push(&[]).next(), Some(Event::Message(1953)));
    let wrong = decoder.push(&[0xFF, 0x07, 0xA1, 0xA8]).next();
    let expected = FrameFault::Checksum {
        expected: 0xA7,
        found: 0xA8,
    };
    assert_eq!(wrong, Some(Event::Fault(expected)));
}

fn any(dice: &mut Dice) -> (u16, Vec<u8>) {
    let mm = dice.word() % (MAX_MM + 1);
    (mm, encode(mm).to_vec())
}

#[test]
fn any_distance_in_any_pieces_and_no_wrong_one() {
    battery::round_trip(Decoder::default, any);
    assert_eq!(battery::garbage(Decoder::default()), 0);
    battery::damaged(&ANY_DAMAGE, Decoder::default, any);
}

fn driver(rig: &Rig) -> FfSonar<Rig, Rig> {
    FfSonar::new(rig.clone(), rig.clone(), FfParams::default())
}

#[test]
fn a_ping_takes_the_first_firing_after_the_call() {
    let rig = Rig::silent();
    rig.comes(0.0, &encode(300));
    rig.comes(0.05, &encode(400));
    rig.comes(0.15, &encode(1953));
    let ping = driver(&rig).ping(0.0).unwrap();
    assert_eq!(ping.reading, Reading::Echo { range: 1.953 });
    for (mm, reading) in [
        (0, Reading::NoEcho { listened: 4.5 }),
        (4500, Reading::NoEcho { listened: 4.5 }),
        (30, Reading::TooClose),
    ] {
        let rig = Rig::silent();
        rig.comes(0.15, &encode(mm));
        assert_eq!(driver(&rig).ping(0.0).unwrap().reading, reading);
    }
}

#[test]
fn one_that_waits_is_asked() {
    let rig = Rig::with(|bytes| {
        assert_eq!(bytes, [0x55]);
        vec![(0.06, vec![0xFF, 0x07, 0xA1, 0xA7])]
    });
    rig.comes(0.0, &encode(300));
    let params = FfParams {
        ask: true,
        ..FfParams::default()
    };
    let mut sonar = FfSonar::new(rig.clone(), rig.clone(), params);
    assert_eq!(
        sonar.ping(0.0).unwrap().reading,
        Reading::Echo { range: 1.953 }
    );
}

#[test]
fn failures_are_named_in_time() {
    fails_in_time(0.6, &[0xFF, 0x07, 0xA1, 0x00], driver, |sonar| {
        sonar.ping(0.0).map(drop)
    });
}
