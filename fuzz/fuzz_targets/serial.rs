//! Any bytes from a serial device: no decoder panics or tells more than it heard, and none is deaf afterwards.
//! The first byte chooses the protocol.
#![no_main]

use std::fmt::Debug;

use libfuzzer_sys::fuzz_target;
use mobot_hw::serial::{
    Decode, Event, MaxBotixModel, arduino, asked, create2, ff, kobuki, maxbotix, urm37,
};

fuzz_target!(|data: &[u8]| {
    let Some((&protocol, noise)) = data.split_first() else {
        return;
    };
    match protocol % 9 {
        0 => {
            let answer = arduino::Answer::Two(-120, i32::MAX);
            // a line begun by the noise ends first
            let bytes = [b"\n", answer.bytes().as_slice()].concat();
            hears(arduino::Decoder::default(), noise, &bytes, &answer);
        }
        1 => {
            let bytes = asked::encode(1234);
            hears(asked::Decoder::default(), noise, &bytes, &bytes);
        }
        2 => {
            let told = create2::Sensors {
                left: 65_535,
                right: 7,
                ..create2::Sensors::default()
            };
            hears(
                create2::Decoder::default(),
                noise,
                &create2::encode(&told),
                &told,
            );
        }
        3 => {
            let told = kobuki::Sensors::default();
            hears(
                kobuki::Decoder::default(),
                noise,
                &kobuki::encode(&told),
                &told,
            );
        }
        4 => hears(ff::Decoder::default(), noise, &ff::encode(1234), &1234),
        5 => {
            let bytes = [0x22, 0, 123, 0x22 + 123];
            hears(urm37::Decoder::default(), noise, &bytes, &123);
        }
        n => {
            let model = [MaxBotixModel::Lv, MaxBotixModel::Xl, MaxBotixModel::Hrlv][n as usize - 6];
            let bytes = maxbotix::encode(model, 123, false);
            let told = maxbotix::Message::Range(123);
            hears(maxbotix::Decoder::new(model), noise, &bytes, &told);
        }
    }
});

/// Feeds noise, then silence, then a message and silence until the decoder trusts the line: the message is told.
fn hears<D>(mut decoder: D, noise: &[u8], message: &[u8], told: &D::Message)
where
    D: Decode<Message: Copy + PartialEq + Debug>,
{
    let events = decoder.push(noise).count();
    assert!(events <= noise.len(), "{events} of {}", noise.len());
    let mut heard = Vec::new();
    for bytes in [&[][..], message, message] {
        heard.extend(decoder.push(bytes));
        decoder.quiet();
        heard.extend(std::iter::from_fn(|| decoder.poll()).take(noise.len() + 2));
    }
    let last = heard.last();
    assert_eq!(last, Some(&Event::Message(*told)));
}
