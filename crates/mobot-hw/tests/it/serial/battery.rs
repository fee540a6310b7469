//! What every decoder must bear: any split, random bytes, and streams with bytes dropped, doubled, flipped.

use std::cell::Cell;
use std::rc::Rc;

use mobot_hw::serial::{Decode, Event, SerialError};

use super::rig::{Rig, timed};

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

/// Random bytes and now and then quiet, 10 MB in the long battery: never a panic. Gives how many pieces of
/// how many were taken for messages.
pub(crate) fn garbage_in_pieces<D: Decode>(mut decoder: D) -> [usize; 2] {
    let mut dice = Dice(8);
    let (mut found, mut pieces, mut bytes) = (0, 0, 0);
    while bytes < cases() * 100 {
        let piece: Vec<u8> = (0..1 + dice.below(40)).map(|_| dice.byte()).collect();
        found += messages(&mut decoder, &piece).len();
        decoder.quiet();
        found += messages(&mut decoder, &[]).len();
        pieces += 1;
        bytes += piece.len();
    }
    [found, pieces]
}

/// What a call of a driver gave, by somebody who knows the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Outcome {
    Right,
    /// Told as such.
    Fault,
    Wrong,
}

/// A thousand lines with a device that is asked, of whose answers every sixth is damaged in one byte: each
/// call ends in time, and the second one after damage is right. Gives how many of all calls were wrong.
pub(crate) fn exchanges<D>(
    hows: &[Damage],
    longest: f64,
    device: impl Fn(&[u8]) -> Vec<u8> + Copy + 'static,
    opened: impl Fn(&Rig) -> D,
    call: impl Fn(&mut D) -> Result<Outcome, SerialError>,
) -> [usize; 2] {
    let (mut wrong, mut calls) = (0, 0);
    for seed in 0..1000 {
        // whether to damage, and whether an answer was
        let hurt = Rc::new(Cell::new([false; 2]));
        let (mut dice, hows, hurts) = (Dice(seed), hows.to_vec(), Rc::clone(&hurt));
        let rig = Rig::with(move |bytes| {
            let mut answer = device(bytes);
            if answer.is_empty() {
                return Vec::new();
            }
            if hurts.get()[0] && dice.below(6) == 0 {
                hurts.set([true; 2]);
                damage(&mut answer, hows[dice.below(hows.len())], &mut dice);
            }
            vec![(0.004, answer)]
        });
        let mut driver = opened(&rig);
        let mut whole = [true; 2];
        for _ in 0..20 {
            hurt.set([true, false]);
            let (result, took) = timed(&rig, || call(&mut driver));
            assert!(took <= longest, "{took} s of {longest} s");
            let outcome = *result.as_ref().unwrap_or(&Outcome::Fault);
            whole = [whole[1], !hurt.get()[1]];
            assert!(
                outcome == Outcome::Right || whole != [true; 2],
                "{result:?} between whole answers"
            );
            wrong += usize::from(outcome == Outcome::Wrong);
            calls += 1;
        }
    }
    [wrong, calls]
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
