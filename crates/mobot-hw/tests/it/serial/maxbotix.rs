use mobot_hw::RangeFinder as _;
use mobot_hw::serial::maxbotix::{Decoder, Message, encode};
use mobot_hw::serial::{Decode as _, Event, FrameFault, MaxBotix, MaxBotixModel, MaxBotixParams};
use occgrid::Reading;

use super::battery::{self, Damage, Dice};
use super::rig::{Rig, fails_in_time};

const MODELS: [MaxBotixModel; 6] = [
    MaxBotixModel::Lv,
    MaxBotixModel::Xl,
    MaxBotixModel::XlLong,
    MaxBotixModel::Hrlv,
    MaxBotixModel::Hrxl,
    MaxBotixModel::HrxlLong,
];

/// PD11832: "R", three digits in inches, carriage return; PD11500: "R", four digits in mm, carriage
/// return; PD12141 (HRUSB): a space before the return.
#[test]
fn lines_of_the_makers_sheets() {
    let golden: [(MaxBotixModel, &[u8], u16); 4] = [
        (MaxBotixModel::Lv, b"R006\r", 6),
        (MaxBotixModel::Lv, b"R255\r", 255),
        (MaxBotixModel::Hrlv, b"R1000 \r", 1000),
        (MaxBotixModel::Hrxl, b"R5000\r", 5000),
    ];
    for (model, bytes, value) in golden {
        let mut decoder = Decoder::new(model);
        let found: Vec<_> = decoder.push(bytes).collect();
        assert_eq!(found, [Event::Message(Message::Range(value))]);
        assert_eq!(encode(model, value, bytes.contains(&b' ')), bytes);
    }
}

#[test]
fn start_up_text_and_wrong_lines_are_dropped() {
    let mut decoder = Decoder::new(MaxBotixModel::Lv);
    let text =
        b"\0HRLV-MaxSonar PN:MB1013 Copyright 2011-2013 MaxBotix Inc.\rRoHS 1.8b\rR12\rR1234\r\
                 R12R123\r123\rR 23\rR123\n\rR1.3\rR042\r";
    assert_eq!(battery::messages(&mut decoder, text), [Message::Range(42)]);
    let park: Vec<_> = decoder.push(b"R008 P1\r").collect();
    assert_eq!(park, [Event::Message(Message::ParkSonar)]);
}

fn any(dice: &mut Dice) -> (MaxBotixModel, u16) {
    let model = MODELS[dice.below(MODELS.len())];
    (model, dice.word() % 10_u16.pow(model.digits() as u32))
}

#[test]
fn any_reading_in_any_pieces() {
    for model in MODELS {
        battery::round_trip(
            || Decoder::new(model),
            |dice| {
                let value = dice.word() % 10_u16.pow(model.digits() as u32);
                (
                    Message::Range(value),
                    encode(model, value, dice.below(2) == 0),
                )
            },
        );
    }
}

#[test]
fn random_bytes_and_lost_bytes() {
    // without a checksum some random lines pass: an R, digits and a return by chance
    assert!(battery::garbage(Decoder::new(MaxBotixModel::Lv)) <= battery::cases() / 1000);
    battery::damaged(
        &[Damage::Dropped, Damage::Doubled],
        || Decoder::new(MaxBotixModel::Hrlv),
        |dice| {
            let value = any(dice).1;
            (
                Message::Range(value),
                encode(MaxBotixModel::Hrlv, value, false),
            )
        },
    );
}

fn driver(rig: &Rig) -> MaxBotix<Rig, Rig> {
    MaxBotix::new(rig.clone(), rig.clone(), MaxBotixParams::default())
}

#[test]
fn a_ping_takes_firings_after_the_call_that_agree() {
    let rig = Rig::silent();
    let mut sonar = driver(&rig);
    // old lines wait in the buffer; one is on its way; then a spike; then two that agree
    rig.comes(0.0, b"R010\rR010\rR010\r");
    rig.comes(0.030, b"R010\r");
    rig.comes(0.079, b"R110\r");
    rig.comes(0.128, b"R011\r");
    rig.comes(0.177, b"R110\r");
    rig.comes(0.226, b"R110\r");
    let ping = sonar.ping(0.0).unwrap();
    assert_eq!(
        ping.reading,
        Reading::Echo {
            range: 110.0 * 0.0254
        }
    );
    assert!((ping.stamp - (0.177 - 0.049)).abs() < 1e-9);
    assert_eq!(sonar.counts().messages, 7);

    for k in 0..5 {
        rig.comes(
            0.3 + 0.049 * f64::from(k),
            [b"R050\r", b"R060\r", b"R070\r", b"R080\r", b"R090\r"][k as usize],
        );
    }
    assert_eq!(sonar.ping(0.0).unwrap().reading, Reading::Fault);
}

#[test]
fn the_far_end_is_no_echo_and_the_near_end_too_close() {
    for (line, reading) in [
        (
            b"R255\r",
            Reading::NoEcho {
                listened: 254.0 * 0.0254,
            },
        ),
        (b"R006\r", Reading::TooClose),
    ] {
        let rig = Rig::silent();
        let mut sonar = driver(&rig);
        for k in 1..6 {
            rig.comes(0.049 * f64::from(k), line);
        }
        assert_eq!(sonar.ping(0.0).unwrap().reading, reading);
    }
}

#[test]
fn failures_are_named_in_time() {
    fails_in_time(1.0, b"\xF2\x1E\r", driver, |sonar| {
        sonar.ping(0.0).map(drop)
    });
    let rig = Rig::silent();
    rig.comes(0.1, b"R12");
    let result = driver(&rig).ping(0.0);
    assert!(
        super::rig::is_garbled(&result, FrameFault::Half),
        "{result:?}"
    );
    assert!(driver(&rig).ping(0.5).is_err());
}
