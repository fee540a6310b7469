//! Answers without any framing: so many bytes, then quiet.

use super::decode::{Decode, Event, FrameFault};

/// Takes exactly N bytes between two quiets for an answer; fewer or more are none.
#[derive(Debug, Clone)]
pub struct Burst<const N: usize> {
    bytes: [u8; N],
    length: usize,
    event: Option<Event<[u8; N]>>,
}

impl<const N: usize> Default for Burst<N> {
    fn default() -> Self {
        Self {
            bytes: [0; N],
            length: 0,
            event: None,
        }
    }
}

impl<const N: usize> Decode for Burst<N> {
    type Message = [u8; N];

    fn feed(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
        }
        self.length = self.length.saturating_add(1);
        if self.length == N + 1 {
            self.event = Some(Event::Fault(FrameFault::Form));
        }
    }

    fn quiet(&mut self) {
        if self.length == N {
            self.event = Some(Event::Message(self.bytes));
        } else if (1..N).contains(&self.length) {
            self.event = Some(Event::Fault(FrameFault::Half));
        }
        self.length = 0;
    }

    fn reset(&mut self) {
        *self = Self::default();
    }

    fn poll(&mut self) -> Option<Event<[u8; N]>> {
        self.event.take()
    }
}
