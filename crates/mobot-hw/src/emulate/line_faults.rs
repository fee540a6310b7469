//! What a bad line does.

use std::collections::VecDeque;

use crate::dice::Dice;

/// What a bad line does to the bytes that a device sends.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LineFaults {
    /// Nothing comes through, in either direction.
    pub silent: bool,
    /// The terminal is gone. Plugged in again it has a new one, under the same link.
    pub unplugged: bool,
    /// Probability that a byte is lost.
    pub dropped: f64,
    /// Probability that a byte comes twice.
    pub doubled: f64,
    /// Probability that one bit of a byte is turned.
    pub flipped: f64,
    /// Bytes come so much later [s].
    pub delay: f64,
}

impl LineFaults {
    fn through(&self, bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
        let mut out = Vec::with_capacity(bytes.len());
        for byte in bytes {
            let turned = dice.chance(self.flipped);
            let bit = 1_u8 << (dice.next() & 7);
            let byte = if turned { byte ^ bit } else { *byte };
            if !dice.chance(self.dropped) {
                out.push(byte);
            }
            if dice.chance(self.doubled) {
                out.push(byte);
            }
        }
        out
    }
}

/// A line with its faults and the bytes that are still on it.
#[derive(Debug)]
pub(super) struct FaultyLine {
    dice: Dice,
    /// When they arrive [s].
    on_their_way: VecDeque<(f64, Vec<u8>)>,
}

impl FaultyLine {
    pub(super) const fn new(dice: Dice) -> Self {
        Self {
            dice,
            on_their_way: VecDeque::new(),
        }
    }

    /// What arrives until `now` [s], after these bytes were sent.
    pub(super) fn carry(&mut self, sent: &[u8], faults: &LineFaults, now: f64) -> Vec<u8> {
        if faults.silent || faults.unplugged {
            self.on_their_way.clear();
            return Vec::new();
        }
        if !sent.is_empty() {
            let bytes = faults.through(sent, &mut self.dice);
            self.on_their_way.push_back((now + faults.delay, bytes));
        }
        let mut arrived = Vec::new();
        while self
            .on_their_way
            .front()
            .is_some_and(|(due, _)| *due <= now)
        {
            arrived.extend(
                self.on_their_way
                    .pop_front()
                    .into_iter()
                    .flat_map(|way| way.1),
            );
        }
        arrived
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_line_keeps_order_and_bytes() {
        let mut line = FaultyLine::new(Dice::new(1));
        let late = LineFaults {
            delay: 0.25, // sums of eighths are exact
            ..LineFaults::default()
        };
        assert!(line.carry(b"one", &late, 0.0).is_empty());
        assert!(line.carry(b"two", &late, 0.125).is_empty());
        assert_eq!(line.carry(&[], &late, 0.25), b"one");
        // quick again, but not past what is on its way
        assert!(line.carry(b"!", &LineFaults::default(), 0.3125).is_empty());
        assert_eq!(line.carry(&[], &late, 0.375), b"two!");
    }

    #[test]
    fn what_is_on_a_line_that_falls_silent_is_lost() {
        let mut line = FaultyLine::new(Dice::new(1));
        let silent = LineFaults {
            silent: true,
            ..LineFaults::default()
        };
        line.carry(
            b"x",
            &LineFaults {
                delay: 1.0,
                ..LineFaults::default()
            },
            0.0,
        );
        assert!(line.carry(b"y", &silent, 0.5).is_empty());
        assert_eq!(line.carry(b"z", &LineFaults::default(), 2.0), b"z");
    }
}
