//! Messages found in a stream of bytes, whatever came before, between or instead of them.

use thiserror::Error;

/// Why bytes were no message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Error)]
#[non_exhaustive]
pub enum FrameFault {
    /// A frame whose checksum is wrong.
    #[error("checksum: expected {expected:#04x}, found {found:#04x}")]
    Checksum {
        /// What its bytes sum up to.
        expected: u8,
        /// What it says.
        found: u8,
    },
    /// Bytes that begin nothing.
    #[error("bytes that begin no frame")]
    Stray,
    /// A beginning without an end.
    #[error("half a frame")]
    Half,
    /// A frame that the device does not send: a wrong length, a value out of range.
    #[error("a frame of another form")]
    Form,
}

/// What a decoder has found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event<M> {
    /// A message.
    Message(M),
    /// Bytes were dropped; told once for each run of such bytes, with the first reason.
    Fault(FrameFault),
}

/// A state machine that finds messages in a stream of bytes. It has no I/O, no clock, and a bounded
/// buffer. After each byte it is polled until it has no more to tell.
pub trait Decode {
    /// What it finds.
    type Message;

    /// Takes one more byte.
    fn feed(&mut self, byte: u8);

    /// The line has been quiet for longer than a message's bytes are apart: what has begun is complete
    /// or never will be.
    fn quiet(&mut self);

    /// Forgets everything, as before a new question.
    fn reset(&mut self);

    /// What the bytes so far tell.
    fn poll(&mut self) -> Option<Event<Self::Message>>;

    /// Takes more bytes and tells what they tell.
    fn push<'a>(&'a mut self, bytes: &'a [u8]) -> Pushed<'a, Self>
    where
        Self: Sized,
    {
        Pushed {
            decoder: self,
            bytes: bytes.iter(),
        }
    }
}

/// The events of [`Decode::push`]. Bytes that it has not come to are lost when it is dropped.
#[derive(Debug)]
pub struct Pushed<'a, D> {
    decoder: &'a mut D,
    bytes: std::slice::Iter<'a, u8>,
}

impl<D: Decode> Iterator for Pushed<'_, D> {
    type Item = Event<D::Message>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(event) = self.decoder.poll() {
                return Some(event);
            }
            self.decoder.feed(*self.bytes.next()?);
        }
    }
}

/// What a framing says of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict<M> {
    /// They may become a message.
    Wait,
    /// The first of them begins no message.
    Bad(FrameFault),
    /// They begin with a message.
    Good {
        /// The message.
        message: M,
        /// How many bytes it has.
        length: usize,
    },
}

/// The form of a protocol's messages.
pub trait Framing {
    /// What a message is.
    type Message;

    /// No verdict needs more bytes than this.
    fn longest(&self) -> usize;

    /// Whether more than a checksum vouches for a message, so that one right after bad bytes is believed.
    fn self_evident(&self) -> bool {
        false
    }

    /// Judges one or more bytes; `ended` where no more will follow them soon.
    fn inspect(&self, bytes: &[u8], ended: bool) -> Verdict<Self::Message>;
}

/// A decoder for any framing. After bytes that were no message it shifts by one byte, never by a frame,
/// and believes the second of two good messages in a row, as a checksum of eight bits passes one in 256
/// wrong ones, unless the messages are [self-evident](Framing::self_evident).
#[derive(Debug, Clone)]
pub struct Scanner<F> {
    framing: F,
    bytes: Vec<u8>,
    ended: bool,
    in_fault: bool,
    in_doubt: bool,
}

impl<F: Framing> Scanner<F> {
    /// A decoder at the beginning of a stream.
    #[must_use]
    pub fn new(framing: F) -> Self {
        Self {
            bytes: Vec::with_capacity(framing.longest()),
            framing,
            ended: false,
            in_fault: false,
            in_doubt: false,
        }
    }
}

impl<F: Framing + Default> Default for Scanner<F> {
    fn default() -> Self {
        Self::new(F::default())
    }
}

impl<F: Framing> Decode for Scanner<F> {
    type Message = F::Message;

    fn feed(&mut self, byte: u8) {
        self.ended = false;
        self.bytes.push(byte);
    }

    fn quiet(&mut self) {
        self.ended = true;
    }

    fn reset(&mut self) {
        self.bytes.clear();
        (self.ended, self.in_fault, self.in_doubt) = (false, false, false);
    }

    fn poll(&mut self) -> Option<Event<F::Message>> {
        while !self.bytes.is_empty() {
            let fault = match self.framing.inspect(&self.bytes, self.ended) {
                Verdict::Good { message, length } => {
                    self.bytes.drain(..length.clamp(1, self.bytes.len()));
                    self.in_fault = false;
                    if !std::mem::take(&mut self.in_doubt) {
                        return Some(Event::Message(message));
                    }
                    continue;
                }
                Verdict::Wait if !self.ended && self.bytes.len() < self.framing.longest() => {
                    return None;
                }
                Verdict::Wait => FrameFault::Half,
                Verdict::Bad(fault) => fault,
            };
            self.bytes.remove(0);
            self.in_doubt = !self.framing.self_evident();
            if !std::mem::replace(&mut self.in_fault, true) {
                return Some(Event::Fault(fault));
            }
        }
        None
    }
}
