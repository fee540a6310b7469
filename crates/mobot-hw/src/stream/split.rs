//! Cuts a stream of bytes into JPEG frames, by the structure of ITU-T T.81 annex B: pictures inside of
//! comments and thumbnails do not count, nor does what lies between frames (an HTTP boundary, padding).

use crate::FrameFault;

/// Segments between two scans: far more than any camera writes, few enough that a hostile stream is walked
/// through quickly.
const SEGMENTS: u32 = 64;

/// What was cut.
#[derive(Debug, PartialEq)]
pub(crate) enum Cut<'a> {
    Frame(JpegFrame<'a>),
    Lost(FrameFault),
}

/// One whole JPEG picture, from its start to its end marker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JpegFrame<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) shape: Shape,
}

/// What decoding needs to know of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shape {
    /// Where its first scan begins, if it has no Huffman tables before that.
    pub(crate) tables_wanted_at: Option<usize>,
    /// Its one scan is the last thing before the end marker.
    pub(crate) one_scan: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    /// Between frames.
    Hunt,
    /// At a marker of a frame.
    Marker,
    /// In entropy-coded data.
    Scan,
}

/// Holds at most one frame of the longest length, and what was pushed last.
#[derive(Debug)]
pub(crate) struct Splitter {
    held: Vec<u8>,
    /// Of the frame.
    start: usize,
    /// How far it has been read; beyond what is held where a segment has not come whole.
    at: usize,
    state: State,
    /// Where to look for the next frame if this one fails. Entropy-coded data hides none, segments may.
    resume: usize,
    /// Since the frame's start or its last scan.
    segments: u32,
    has_tables: bool,
    first_scan: Option<usize>,
    scans: u32,
    limit: usize,
}

/// How one step of reading ended.
enum Step {
    On,
    Starved,
    Whole { end: usize },
    Lost,
}

impl Splitter {
    pub(crate) fn new(limit: usize) -> Self {
        Self {
            held: Vec::new(),
            start: 0,
            at: 0,
            state: State::Hunt,
            resume: 0,
            segments: 0,
            has_tables: false,
            first_scan: None,
            scans: 0,
            limit,
        }
    }

    /// Takes bytes; ask [`next`](Self::next) until it has no more.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        self.held.drain(..self.start);
        self.at -= self.start;
        self.resume = self.resume.saturating_sub(self.start);
        self.first_scan = self.first_scan.map(|scan| scan - self.start);
        self.start = 0;
        self.held.extend_from_slice(bytes);
    }

    /// Whether a frame has begun and not ended.
    pub(crate) fn inside(&self) -> bool {
        self.state != State::Hunt
    }

    /// The stream has ended, as seen by a splitter that has no more: the frame in it is lost, others may lie
    /// in its header, so ask [`next`](Self::next) again.
    pub(crate) fn end(&mut self) -> Option<FrameFault> {
        self.inside().then(|| {
            self.give_up();
            FrameFault::CutShort
        })
    }

    pub(crate) fn next(&mut self) -> Option<Cut<'_>> {
        loop {
            let step = match self.state {
                State::Hunt => self.hunt(),
                State::Marker => self.marker(),
                State::Scan => self.scan(),
            };
            match step {
                Step::On => {}
                Step::Starved if self.inside() && self.reach() > self.limit => {
                    self.give_up();
                    return Some(Cut::Lost(FrameFault::TooLong { limit: self.limit }));
                }
                Step::Starved => return None,
                Step::Whole { end } => {
                    let start = self.start;
                    let bare = self.first_scan.filter(|_| !self.has_tables);
                    let shape = Shape {
                        tables_wanted_at: bare.map(|scan| scan - start),
                        one_scan: self.scans == 1 && self.segments == 0,
                    };
                    self.hunt_from(end);
                    return Some(Cut::Frame(JpegFrame {
                        bytes: &self.held[start..end],
                        shape,
                    }));
                }
                Step::Lost => {
                    self.give_up();
                    return Some(Cut::Lost(FrameFault::CutShort));
                }
            }
        }
    }

    fn reach(&self) -> usize {
        self.at.max(self.held.len()) - self.start
    }

    fn give_up(&mut self) {
        let resume = match self.state {
            State::Scan => self.at.min(self.held.len()),
            State::Hunt | State::Marker => self.resume,
        };
        self.hunt_from(resume);
    }

    fn hunt_from(&mut self, at: usize) {
        self.state = State::Hunt;
        self.start = at;
        self.at = at;
        self.first_scan = None;
    }

    fn hunt(&mut self) -> Step {
        let held = &self.held[self.at..];
        if let Some(p) = held.windows(3).position(|w| w == [0xFF, 0xD8, 0xFF]) {
            self.begin(self.at + p);
            return Step::On;
        }
        // the last two bytes may be the beginning of a start
        self.hunt_from(self.held.len().saturating_sub(2).max(self.at));
        Step::Starved
    }

    fn begin(&mut self, start: usize) {
        self.state = State::Marker;
        self.start = start;
        self.at = start + 2;
        self.resume = start + 2;
        self.segments = 0;
        self.has_tables = false;
        self.first_scan = None;
        self.scans = 0;
    }

    fn marker(&mut self) -> Step {
        let (Some(&ff), Some(&code)) = (self.held.get(self.at), self.held.get(self.at + 1)) else {
            return Step::Starved;
        };
        match (ff, code, self.first_scan) {
            (0xFF, 0xFF, _) => {
                self.at += 1; // fill
                return Step::On;
            }
            (0xFF, 0xD9, Some(_)) => return Step::Whole { end: self.at + 2 },
            (0xFF, 0x02..=0xCF | 0xDA..=0xFE, None) => {}
            // tables, restart interval, number of lines, comment, the next scan
            (0xFF, 0xC4 | 0xDA..=0xDD | 0xFE, Some(_)) => {}
            (0xFF, 0xD8, _) => {
                self.resume = self.at;
                return Step::Lost;
            }
            _ => return Step::Lost,
        }
        let (Some(&high), Some(&low)) = (self.held.get(self.at + 2), self.held.get(self.at + 3))
        else {
            return Step::Starved;
        };
        let length = usize::from(u16::from_be_bytes([high, low]));
        if length < 2 || self.segments >= SEGMENTS {
            return Step::Lost;
        }
        if code == 0xDA {
            // A scan's header is short, four components at most, and has no FF, where a marker may hide.
            let Some(header) = self.held.get(self.at + 4..self.at + 2 + length) else {
                return if length > 14 {
                    Step::Lost
                } else {
                    Step::Starved
                };
            };
            if length > 14 || header.contains(&0xFF) {
                return Step::Lost;
            }
        }
        self.has_tables |= code == 0xC4 && self.first_scan.is_none();
        if code == 0xDA {
            self.first_scan.get_or_insert(self.at);
            self.scans += 1;
            self.state = State::Scan;
        }
        self.segments += 1;
        self.at += 2 + length;
        Step::On
    }

    fn scan(&mut self) -> Step {
        let Some(data) = self.held.get(self.at..) else {
            return Step::Starved;
        };
        let Some(p) = data.iter().position(|byte| *byte == 0xFF) else {
            self.at = self.held.len();
            return Step::Starved;
        };
        self.at += p;
        match self.held.get(self.at + 1) {
            None => return Step::Starved,
            Some(0x00 | 0xD0..=0xD7) => self.at += 2,
            Some(0xFF) => self.at += 1,
            Some(_) => {
                self.state = State::Marker;
                self.segments = 0;
                self.resume = self.at + 1;
            }
        }
        Step::On
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_than_a_frame_is_held() {
        let limit = 100_000;
        let begun = [0xFF, 0xD8, 0xFF, 0xDA, 0, 2];
        for endless in [
            &[0x55][..],
            &[0xFF],
            &[0xFF, 0xE0, 0xFF, 0xFF],
            &[0xFF, 0xD8],
            &begun,
        ] {
            let mut splitter = Splitter::new(limit);
            splitter.push(&begun);
            let chunk = endless.repeat(65_536 / endless.len());
            for _ in 0..200 {
                splitter.push(&chunk);
                while splitter.next().is_some() {}
                assert!(splitter.held.capacity() <= 4 * limit, "{endless:?}");
            }
        }
    }
}
