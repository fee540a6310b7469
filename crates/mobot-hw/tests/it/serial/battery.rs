//! What every decoder must bear: any split, random bytes, and streams with bytes dropped, doubled, flipped.

use mobot_hw::serial::{Decode, Event};

/// SplitMix64.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    pub(crate) fn byte(&mut self) -> u8 {
        self.next() as u8
    }

    pub(crate) fn word(&mut self) -> u16 {
        self.next() as u16
    }
}

/// Cases of a property: 100 000 where the long batteries are asked for.
pub(crate) fn cases() -> usize {
    let long = std::env::var_os("MOBOT_LONG").is_some();
    if long { 100_000 } else { 5_000 }
}

pub(crate) fn messages<D: Decode>(decoder: &mut D, bytes: &[u8]) -> Vec<D::Message> {
    let found = decoder.push(bytes).filter_map(|event| match event {
        Event::Message(message) => Some(message),
        Event::Fault(_) => None,
    });
    found.collect()
}

/// All messages of a stream that then goes quiet, fed in random pieces.
pub(crate) fn in_pieces<D: Decode>(
    decoder: &mut D,
    bytes: &[u8],
    dice: &mut Dice,
) -> Vec<D::Message> {
    let mut found = Vec::new();
    let mut rest = bytes;
    while !rest.is_empty() {
        let (piece, after) = rest.split_at(1 + dice.below(rest.len().min(40)));
        found.extend(messages(decoder, piece));
        rest = after;
    }
    decoder.quiet();
    found.extend(messages(decoder, &[]));
    found
}

/// Any messages, in any pieces: they come out as they went in.
pub(crate) fn round_trip<D: Decode<Message: PartialEq + std::fmt::Debug>>(
    mut fresh: impl FnMut() -> D,
    mut any: impl FnMut(&mut Dice) -> (D::Message, Vec<u8>),
) {
    let mut dice = Dice(1);
    for _ in 0..cases() {
        let count = 1 + dice.below(4);
        let sent: Vec<_> = (0..count).map(|_| any(&mut dice)).collect();
        let stream: Vec<u8> = sent.iter().flat_map(|s| s.1.iter().copied()).collect();
        let found = in_pieces(&mut fresh(), &stream, &mut dice);
        assert!(
            found.iter().eq(sent.iter().map(|s| &s.0)),
            "{found:?} of {stream:?}"
        );
    }
}

/// Random bytes, 10 MB in the long battery: how many of them were taken for messages. Never a panic.
pub(crate) fn garbage<D: Decode>(mut decoder: D) -> usize {
    let mut dice = Dice(2);
    let mut found = 0;
    for _ in 0..cases() / 10 {
        let block: Vec<u8> = (0..1000).map(|_| dice.byte()).collect();
        found += messages(&mut decoder, &block).len();
    }
    found
}

/// How a byte of a frame is damaged.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Damage {
    Dropped,
    Doubled,
    Flipped,
}

pub(crate) const ANY_DAMAGE: [Damage; 3] = [Damage::Dropped, Damage::Doubled, Damage::Flipped];

fn damage(frame: &mut Vec<u8>, how: Damage, dice: &mut Dice) {
    let place = dice.below(frame.len());
    match how {
        Damage::Dropped => {
            frame.remove(place);
        }
        Damage::Doubled => frame.insert(place, frame[place]),
        Damage::Flipped => frame[place] ^= 1 << dice.below(8),
    }
}

/// A thousand streams of which every sixth frame is damaged in one byte: nothing is found that was not
/// sent, and an undamaged frame between undamaged ones is found, which is the second after a fault.
pub(crate) fn damaged<D: Decode<Message: PartialEq + std::fmt::Debug + Copy>>(
    hows: &[Damage],
    mut fresh: impl FnMut() -> D,
    mut any: impl FnMut(&mut Dice) -> (D::Message, Vec<u8>),
) {
    let mut dice = Dice(3);
    for _ in 0..1000 {
        let mut decoder = fresh();
        let (mut sent, mut whole, mut stream) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..60 {
            let (message, mut frame) = std::iter::repeat_with(|| any(&mut dice))
                .find(|(message, _)| !sent.contains(message))
                .expect("there are messages enough");
            let damaged = dice.below(6) == 0;
            if damaged {
                damage(&mut frame, hows[dice.below(hows.len())], &mut dice);
            }
            sent.push(message);
            whole.push(!damaged);
            stream.extend(frame);
        }
        let found = in_pieces(&mut decoder, &stream, &mut dice);
        check(&sent, &whole, &found);
    }
}

fn check<M: PartialEq + std::fmt::Debug>(sent: &[M], whole: &[bool], found: &[M]) {
    let mut due = sent.iter().enumerate();
    let skip = |passed: &M, index: usize| {
        let near = &whole[index.saturating_sub(1)..(index + 2).min(whole.len())];
        assert!(
            !near.iter().all(|w| *w),
            "{passed:?} was lost between whole frames"
        );
    };
    for message in found {
        loop {
            let (index, next) = due
                .next()
                .unwrap_or_else(|| panic!("{message:?} was never sent"));
            if next == message {
                break;
            }
            skip(next, index);
        }
    }
    for (index, next) in due {
        skip(next, index);
    }
}
