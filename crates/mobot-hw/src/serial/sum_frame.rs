//! The frame that two families share: a header, two bytes, and the low byte of the sum of the three.

use super::decode::{FrameFault, Framing, Verdict};

/// A frame of four bytes.
#[must_use]
pub(crate) const fn sum_frame(header: u8, high: u8, low: u8) -> [u8; 4] {
    [
        header,
        high,
        low,
        header.wrapping_add(high).wrapping_add(low),
    ]
}

/// Frames that begin with `HEADER`, whose first data byte is not above `HIGHEST`, or both data bytes are `FF`
/// where `ALL_ONES` says that this is a message. A frame counts once the next one begins or the line is
/// quiet: a lost byte would else let a frame end with the next one's header, and one in 256 of those sums is
/// right.
#[derive(Debug, Clone, Copy, Default)]
pub struct SumFraming<const HEADER: u8, const HIGHEST: u8, const ALL_ONES: bool>;

impl<const HEADER: u8, const HIGHEST: u8, const ALL_ONES: bool> Framing
    for SumFraming<HEADER, HIGHEST, ALL_ONES>
{
    type Message = u16;

    fn longest(&self) -> usize {
        5
    }

    fn inspect(&self, bytes: &[u8], ended: bool) -> Verdict<u16> {
        if bytes[0] != HEADER {
            return Verdict::Bad(FrameFault::Stray);
        }
        if let Some(&high) = bytes.get(1)
            && high > HIGHEST
            && !(ALL_ONES && high == 0xFF)
        {
            return Verdict::Bad(FrameFault::Form);
        }
        let Some((frame, rest)) = bytes.split_first_chunk::<4>() else {
            return Verdict::Wait;
        };
        let expected = sum_frame(frame[0], frame[1], frame[2])[3];
        if frame[3] != expected {
            let found = frame[3];
            return Verdict::Bad(FrameFault::Checksum { expected, found });
        }
        if frame[1] > HIGHEST && frame[2] != 0xFF {
            return Verdict::Bad(FrameFault::Form);
        }
        match rest.first() {
            None if !ended => Verdict::Wait,
            Some(&next) if next != HEADER => Verdict::Bad(FrameFault::Form),
            _ => Verdict::Good {
                message: u16::from_be_bytes([frame[1], frame[2]]),
                length: 4,
            },
        }
    }
}
