//! Every frame of a file, in order.

use std::io::{ErrorKind, Read};
use std::time::Instant;

use super::split::{Cut, Splitter};
use super::{Coded, Next};

const CHUNK: usize = 1 << 16;

pub(super) struct Played {
    reader: Box<dyn Read + Send>,
    splitter: Splitter,
    chunk: Vec<u8>,
    cuts: u64,
}

impl Played {
    pub(super) fn new(reader: Box<dyn Read + Send>, frame_limit: usize) -> Self {
        Self {
            reader,
            splitter: Splitter::new(frame_limit),
            chunk: vec![0; CHUNK],
            cuts: 0,
        }
    }

    /// A frame, or the fault of a lost one, or nothing yet: reads once at most.
    pub(super) fn next(&mut self) -> Next {
        if let Some(cut) = self.splitter.next() {
            let sequence = self.cuts;
            self.cuts += 1;
            return match cut {
                Cut::Frame(frame) => Next::Frame(Coded {
                    bytes: frame.bytes.to_vec(),
                    shape: frame.shape,
                    arrived: Instant::now(),
                    sequence,
                }),
                Cut::Lost(fault) => Next::Lost(fault),
            };
        }
        match self.reader.read(&mut self.chunk) {
            Ok(0) => match self.splitter.end() {
                Some(fault) => {
                    self.cuts += 1;
                    Next::Lost(fault)
                }
                None => Next::End(None),
            },
            Ok(count) => {
                self.splitter.push(&self.chunk[..count]);
                Next::Nothing
            }
            Err(error) => match error.kind() {
                ErrorKind::Interrupted | ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                    Next::Nothing
                }
                kind => Next::End(Some(kind)),
            },
        }
    }
}
