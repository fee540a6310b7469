//! Reading from front to back, as much as there is.

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read};
use std::sync::Arc;

use thiserror::Error;

use super::{MAGIC, MAX_RECORD, op};

/// Why a file is not read, or not to its end.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum McapError {
    /// The system says no.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Not an MCAP file.
    #[error("expected an MCAP file, found other bytes at its start")]
    Magic,
    /// Too long a record.
    #[error(
        "byte {at}: expected a record of at most {} bytes, found {found}",
        MAX_RECORD
    )]
    TooLong {
        /// Where the record begins.
        at: u64,
        /// What it says of itself.
        found: u64,
    },
    /// A record that contradicts itself.
    #[error("byte {at}: expected {expected}")]
    Torn {
        /// Where the record begins, or the chunk that holds it.
        at: u64,
        /// What should have been there.
        expected: &'static str,
    },
    /// A chunk that is not as it was written.
    #[error("byte {at}: checksum of the chunk: expected {expected:08x}, found {found:08x}")]
    Checksum {
        /// Where the chunk begins.
        at: u64,
        /// What was written.
        expected: u32,
        /// Of what is there.
        found: u32,
    },
    /// A chunk that is compressed.
    #[error("byte {at}: expected a chunk without compression, found {found:?}")]
    Compressed {
        /// Where the chunk begins.
        at: u64,
        /// The compression's name.
        found: String,
    },
}

/// A message as it was logged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoggedMessage {
    /// Its channel's topic.
    pub topic: Arc<str>,
    /// Its message type; empty where the channel has none.
    pub schema: Arc<str>,
    /// Counts up along the channel.
    pub sequence: u32,
    /// When it was written [ns].
    pub logged: u64,
    /// When it was true [ns].
    pub published: u64,
    /// The message.
    pub data: Vec<u8>,
}

/// What is known of a channel.
struct Channel {
    topic: Arc<str>,
    schema: Arc<str>,
}

/// The messages of an MCAP file, in the order of the file. A file that ends too early gives all that its
/// whole chunks hold, and then ends: [`McapReader::is_cut_off`] tells. Memory: one record.
pub struct McapReader<R> {
    source: R,
    /// Where the next record begins.
    position: u64,
    /// Chunk at hand: where it begins in the file, its records, how far they are read.
    chunk: Option<(u64, Vec<u8>, usize)>,
    schemas: BTreeMap<u16, Arc<str>>,
    channels: BTreeMap<u16, Channel>,
    ended: bool,
    cut_off: bool,
}

impl<R> std::fmt::Debug for McapReader<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("McapReader")
            .field("position", &self.position)
            .field("ended", &self.ended)
            .field("cut_off", &self.cut_off)
            .finish_non_exhaustive()
    }
}

impl<R: Read> McapReader<R> {
    /// Reads the start of a file.
    ///
    /// # Errors
    /// [`McapError::Magic`], [`McapError::Io`]. A file shorter than its magic is cut off, not wrong.
    pub fn new(source: R) -> Result<Self, McapError> {
        let mut reader = Self {
            source,
            position: 0,
            chunk: None,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            ended: false,
            cut_off: false,
        };
        let start = reader.up_to(MAGIC.len())?;
        if !MAGIC.starts_with(&start) {
            return Err(McapError::Magic);
        }
        if start.len() < MAGIC.len() {
            reader.cut();
        }
        Ok(reader)
    }

    /// Whether the file ends before its end was written, as far as it was read.
    #[must_use]
    pub const fn is_cut_off(&self) -> bool {
        self.cut_off
    }

    fn cut(&mut self) {
        self.cut_off = true;
        self.ended = true;
    }

    /// So many bytes, or what is left of them. Grows with what comes, not with what was promised.
    fn up_to(&mut self, length: usize) -> Result<Vec<u8>, McapError> {
        let mut bytes = Vec::new();
        let mut limited = self.source.by_ref().take(length as u64);
        loop {
            match limited.read_to_end(&mut bytes) {
                Ok(_) => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
        }
        self.position += bytes.len() as u64;
        Ok(bytes)
    }

    /// The next message, or `None` at the end.
    fn step(&mut self) -> Result<Option<LoggedMessage>, McapError> {
        loop {
            if let Some((at, records, read)) = self.chunk.take() {
                if read == records.len() {
                    continue;
                }
                let torn = McapError::Torn {
                    at,
                    expected: "records that fill their chunk",
                };
                let (opcode, body, rest) = split(&records[read..]).ok_or(torn)?;
                let after = records.len() - rest;
                let message = self.record(opcode, body, at)?;
                self.chunk = Some((at, records, after));
                if message.is_some() {
                    return Ok(message);
                }
                continue;
            }
            if self.ended {
                return Ok(None);
            }
            let at = self.position;
            let Some((opcode, body)) = self.outer()? else {
                return Ok(None);
            };
            match opcode {
                op::CHUNK => self.chunk = Some((at, chunk(body, at)?, 0)),
                op::FOOTER => self.end()?,
                _ => {
                    if let Some(message) = self.record(opcode, &body, at)? {
                        return Ok(Some(message));
                    }
                }
            }
        }
    }

    /// What comes behind the footer.
    fn end(&mut self) -> Result<(), McapError> {
        let at = self.position;
        let end = self.up_to(MAGIC.len())?;
        if !MAGIC.starts_with(&end) {
            let expected = "the magic again at the end";
            return Err(McapError::Torn { at, expected });
        }
        self.ended = true;
        self.cut_off = end.len() < MAGIC.len();
        Ok(())
    }

    /// A record of the file itself; `None` where the file ends in it.
    fn outer(&mut self) -> Result<Option<(u8, Vec<u8>)>, McapError> {
        let at = self.position;
        let head = self.up_to(9)?;
        let Some((&opcode, length)) = head.split_first() else {
            self.cut();
            return Ok(None);
        };
        let Ok(length) = <[u8; 8]>::try_from(length) else {
            self.cut();
            return Ok(None);
        };
        let found = u64::from_le_bytes(length);
        if found > MAX_RECORD as u64 {
            return Err(McapError::TooLong { at, found });
        }
        if opcode == 0 {
            let expected = "a record, found a zero byte";
            return Err(McapError::Torn { at, expected });
        }
        let body = self.up_to(found as usize)?;
        if (body.len() as u64) < found {
            self.cut();
            return Ok(None);
        }
        Ok(Some((opcode, body)))
    }

    /// Learns from a schema or a channel; gives a message.
    fn record(
        &mut self,
        opcode: u8,
        body: &[u8],
        at: u64,
    ) -> Result<Option<LoggedMessage>, McapError> {
        let torn = |expected| McapError::Torn { at, expected };
        let mut fields = Fields(body);
        match opcode {
            op::SCHEMA => {
                let (id, name) = fields
                    .u16()
                    .zip(fields.text())
                    .ok_or(torn("a schema's number and name"))?;
                self.schemas.insert(id, name.into());
            }
            op::CHANNEL => {
                let expected = "a channel's number, schema and topic";
                let (id, schema) = fields.u16().zip(fields.u16()).ok_or(torn(expected))?;
                let topic: Arc<str> = fields.text().ok_or(torn(expected))?.into();
                let schema = self.schemas.get(&schema).cloned().unwrap_or_default();
                self.channels.insert(id, Channel { topic, schema });
            }
            op::MESSAGE => {
                let expected = "a message's channel, number and times";
                let (id, sequence) = fields.u16().zip(fields.u32()).ok_or(torn(expected))?;
                let (logged, published) = fields.u64().zip(fields.u64()).ok_or(torn(expected))?;
                let channel = self
                    .channels
                    .get(&id)
                    .ok_or(torn("the channel of a message before the message"))?;
                return Ok(Some(LoggedMessage {
                    topic: channel.topic.clone(),
                    schema: channel.schema.clone(),
                    sequence,
                    logged,
                    published,
                    data: fields.0.to_vec(),
                }));
            }
            _ => {}
        }
        Ok(None)
    }
}

impl<R: Read> Iterator for McapReader<R> {
    type Item = Result<LoggedMessage, McapError>;

    /// After an error there is nothing more.
    fn next(&mut self) -> Option<Self::Item> {
        let step = self.step();
        if step.is_err() {
            self.ended = true;
            self.chunk = None;
        }
        step.transpose()
    }
}

/// The records of a chunk, as they were written.
fn chunk(body: Vec<u8>, at: u64) -> Result<Vec<u8>, McapError> {
    let torn = McapError::Torn {
        at,
        expected: "a chunk's times, sizes and records",
    };
    let mut fields = Fields(&body);
    let Some((checksum, compression, size)) = fields.chunk_head() else {
        return Err(torn);
    };
    if !compression.is_empty() {
        let found = compression.chars().take(32).collect();
        return Err(McapError::Compressed { at, found });
    }
    if size > fields.0.len() as u64 {
        return Err(torn);
    }
    let start = body.len() - fields.0.len();
    let mut records = body;
    records.truncate(start + size as usize);
    records.drain(..start);
    let found = crc32fast::hash(&records);
    if checksum != 0 && found != checksum {
        return Err(McapError::Checksum {
            at,
            expected: checksum,
            found,
        });
    }
    Ok(records)
}

/// The first record of some bytes: its kind, its body, and how many bytes come after it.
fn split(bytes: &[u8]) -> Option<(u8, &[u8], usize)> {
    let (&opcode, after) = bytes.split_first()?;
    let (length, after) = after.split_first_chunk::<8>()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    let (body, rest) = after.split_at_checked(length)?;
    Some((opcode, body, rest.len()))
}

/// The fields of a record, one after another.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*bytes)
    }

    fn u16(&mut self) -> Option<u16> {
        self.bytes().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.bytes().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.bytes().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        let (text, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        std::str::from_utf8(text).ok()
    }

    /// Checksum, compression, and size of the records.
    fn chunk_head(&mut self) -> Option<(u32, &'a str, u64)> {
        let _first = self.u64()?;
        let _last = self.u64()?;
        let _size = self.u64()?;
        Some((self.u32()?, self.text()?, self.u64()?))
    }
}
