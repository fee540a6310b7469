use mobot_hw::RangeFinder as _;
use mobot_hw::serial::asked::{Decoder, encode};
use mobot_hw::serial::{Decode as _, FrameFault, Srf02, Srf02Params, Us100, Us100Params};
use occgrid::Reading;

use super::battery::{self, Dice};
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

/// US-100: 55 is answered by millimetres, high byte first. SRF02 (srf02techSer.htm): address, 54h is
/// answered by centimetres, high byte first; 0 is no echo.
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

#[test]
fn failures_are_named_in_time() {
    fails_in_time(0.5, &[1, 2, 3], us100, |sonar| sonar.ping(0.0).map(drop));
    fails_in_time(0.5, &[1, 2, 3], srf02, |sonar| sonar.ping(0.0).map(drop));
    let rig = Rig::with(|_| vec![(0.02, vec![4])]);
    assert!(is_garbled(&us100(&rig).ping(0.0), FrameFault::Half));
}
