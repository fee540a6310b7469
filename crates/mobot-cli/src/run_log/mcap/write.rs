//! Writing: records are gathered in a chunk, and a chunk goes out in one piece.

use std::collections::BTreeMap;
use std::io::{self, Write};

use super::{MAGIC, op};

/// What a channel carries.
pub(crate) struct ChannelInfo<'a> {
    pub(crate) topic: &'a str,
    /// Full name of the message type.
    pub(crate) schema: &'a str,
    /// Its definition.
    pub(crate) definition: &'a str,
}

/// A chunk that is being filled.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    /// Times of the first and last message, in time [ns].
    span: Option<(u64, u64)>,
    /// Of each channel: time of a message [ns], and where it is in the chunk.
    index: BTreeMap<u16, Vec<(u64, u64)>>,
}

/// Where a chunk went.
struct ChunkPlace {
    span: (u64, u64),
    start: u64,
    length: u64,
    /// Where each channel's index of the chunk is.
    indexes: BTreeMap<u16, u64>,
    indexes_length: u64,
    records_length: u64,
}

/// Writes an MCAP file to anything that takes bytes.
pub(crate) struct McapWriter<W> {
    out: W,
    /// Bytes that went out.
    position: u64,
    chunk: Chunk,
    /// Schema and channel records, to be told again at the end.
    schemas: Vec<u8>,
    channels: Vec<u8>,
    /// Messages of each channel; ids count from 1.
    counts: Vec<u64>,
    span: Option<(u64, u64)>,
    places: Vec<ChunkPlace>,
}

impl<W: Write> McapWriter<W> {
    /// Begins a file.
    pub(crate) fn new(out: W, profile: &str, library: &str) -> io::Result<Self> {
        let mut writer = Self {
            out,
            position: 0,
            chunk: Chunk::default(),
            schemas: Vec::new(),
            channels: Vec::new(),
            counts: Vec::new(),
            span: None,
            places: Vec::new(),
        };
        let mut head = MAGIC.to_vec();
        record(&mut head, op::HEADER, |body| {
            text(body, profile);
            text(body, library);
        });
        writer.put(&head)?;
        Ok(writer)
    }

    /// Adds a channel with a schema of its own; gives its number.
    pub(crate) fn channel(&mut self, info: &ChannelInfo<'_>) -> u16 {
        self.counts.push(0);
        let id = self.counts.len() as u16;
        let schemas = self.schemas.len();
        record(&mut self.schemas, op::SCHEMA, |body| {
            body.extend(id.to_le_bytes());
            text(body, info.schema);
            text(body, "ros2msg");
            text(body, info.definition);
        });
        let channels = self.channels.len();
        record(&mut self.channels, op::CHANNEL, |body| {
            body.extend(id.to_le_bytes());
            body.extend(id.to_le_bytes());
            text(body, info.topic);
            text(body, "cdr");
            body.extend(0_u32.to_le_bytes());
        });
        let records = &mut self.chunk.records;
        records.extend_from_slice(&self.schemas[schemas..]);
        records.extend_from_slice(&self.channels[channels..]);
        id
    }

    /// Adds a message to the chunk. Times in nanoseconds.
    pub(crate) fn message(&mut self, channel: u16, logged: u64, published: u64, data: &[u8]) {
        let Some(count) = usize::from(channel)
            .checked_sub(1)
            .and_then(|i| self.counts.get_mut(i))
        else {
            return;
        };
        let sequence = *count as u32;
        *count += 1;
        let offset = self.chunk.records.len() as u64;
        let index = self.chunk.index.entry(channel).or_default();
        index.push((logged, offset));
        record(&mut self.chunk.records, op::MESSAGE, |body| {
            body.extend(channel.to_le_bytes());
            body.extend(sequence.to_le_bytes());
            body.extend(logged.to_le_bytes());
            body.extend(published.to_le_bytes());
            body.extend_from_slice(data);
        });
        let later = |span: Option<(u64, u64)>| {
            let (first, last) = span.unwrap_or((logged, logged));
            Some((first.min(logged), last.max(logged)))
        };
        self.chunk.span = later(self.chunk.span);
        self.span = later(self.span);
    }

    /// Bytes of the chunk so far.
    pub(crate) fn waiting(&self) -> usize {
        self.chunk.records.len()
    }

    /// Sends the chunk and its indexes out in one piece.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        if self.chunk.records.is_empty() {
            return Ok(());
        }
        let chunk = std::mem::take(&mut self.chunk);
        let span = chunk.span.unwrap_or_default();
        let start = self.position;
        let mut bytes = Vec::with_capacity(chunk.records.len() + 256);
        record(&mut bytes, op::CHUNK, |body| {
            body.extend(span.0.to_le_bytes());
            body.extend(span.1.to_le_bytes());
            body.extend((chunk.records.len() as u64).to_le_bytes());
            body.extend(crc32fast::hash(&chunk.records).to_le_bytes());
            text(body, "");
            body.extend((chunk.records.len() as u64).to_le_bytes());
            body.extend_from_slice(&chunk.records);
        });
        let length = bytes.len() as u64;
        let mut indexes = BTreeMap::new();
        for (channel, entries) in &chunk.index {
            indexes.insert(*channel, start + bytes.len() as u64);
            record(&mut bytes, op::MESSAGE_INDEX, |body| {
                body.extend(channel.to_le_bytes());
                body.extend((entries.len() as u32 * 16).to_le_bytes());
                for (time, offset) in entries {
                    body.extend(time.to_le_bytes());
                    body.extend(offset.to_le_bytes());
                }
            });
        }
        self.places.push(ChunkPlace {
            span,
            start,
            length,
            indexes,
            indexes_length: bytes.len() as u64 - length,
            records_length: chunk.records.len() as u64,
        });
        self.put(&bytes)
    }

    /// Sends out what waits, and the summary by which readers find their way.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.flush()?;
        let mut end = Vec::new();
        record(&mut end, op::DATA_END, |body| {
            // no checksum of the whole: every chunk has its own
            body.extend(0_u32.to_le_bytes());
        });
        let summary = end.len();
        let summary_start = self.position + summary as u64;
        let mut groups = Vec::new();
        let mut group = |end: &mut Vec<u8>, opcode: u8, write: &dyn Fn(&mut Vec<u8>)| {
            let start = end.len();
            write(end);
            if end.len() > start {
                groups.push((opcode, start, end.len() - start));
            }
        };
        group(&mut end, op::SCHEMA, &|end| {
            end.extend_from_slice(&self.schemas)
        });
        group(&mut end, op::CHANNEL, &|end| {
            end.extend_from_slice(&self.channels)
        });
        group(&mut end, op::STATISTICS, &|end| self.statistics(end));
        group(&mut end, op::CHUNK_INDEX, &|end| self.chunk_indexes(end));
        let offsets_start = self.position + end.len() as u64;
        for (opcode, start, length) in groups {
            record(&mut end, op::SUMMARY_OFFSET, |body| {
                body.push(opcode);
                body.extend((self.position + start as u64).to_le_bytes());
                body.extend((length as u64).to_le_bytes());
            });
        }
        end.push(op::FOOTER);
        end.extend(20_u64.to_le_bytes());
        end.extend(summary_start.to_le_bytes());
        end.extend(offsets_start.to_le_bytes());
        let checksum = crc32fast::hash(&end[summary..]);
        end.extend(checksum.to_le_bytes());
        end.extend(MAGIC);
        self.put(&end)?;
        self.out.flush()?;
        Ok(self.out)
    }

    fn statistics(&self, end: &mut Vec<u8>) {
        let (first, last) = self.span.unwrap_or_default();
        record(end, op::STATISTICS, |body| {
            body.extend(self.counts.iter().sum::<u64>().to_le_bytes());
            body.extend((self.counts.len() as u16).to_le_bytes());
            body.extend((self.counts.len() as u32).to_le_bytes());
            // attachments and metadata
            body.extend(0_u64.to_le_bytes());
            body.extend((self.places.len() as u32).to_le_bytes());
            body.extend(first.to_le_bytes());
            body.extend(last.to_le_bytes());
            body.extend((self.counts.len() as u32 * 10).to_le_bytes());
            for (channel, count) in (1_u16..).zip(&self.counts) {
                body.extend(channel.to_le_bytes());
                body.extend(count.to_le_bytes());
            }
        });
    }

    fn chunk_indexes(&self, end: &mut Vec<u8>) {
        for place in &self.places {
            record(end, op::CHUNK_INDEX, |body| {
                body.extend(place.span.0.to_le_bytes());
                body.extend(place.span.1.to_le_bytes());
                body.extend(place.start.to_le_bytes());
                body.extend(place.length.to_le_bytes());
                body.extend((place.indexes.len() as u32 * 10).to_le_bytes());
                for (channel, at) in &place.indexes {
                    body.extend(channel.to_le_bytes());
                    body.extend(at.to_le_bytes());
                }
                body.extend(place.indexes_length.to_le_bytes());
                text(body, "");
                body.extend(place.records_length.to_le_bytes());
                body.extend(place.records_length.to_le_bytes());
            });
        }
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.out.write_all(bytes)?;
        self.position += bytes.len() as u64;
        Ok(())
    }
}

/// A record: its kind, its length, its body.
fn record(out: &mut Vec<u8>, opcode: u8, body: impl FnOnce(&mut Vec<u8>)) {
    out.push(opcode);
    let length = out.len();
    out.extend(0_u64.to_le_bytes());
    let start = out.len();
    body(out);
    let found = (out.len() - start) as u64;
    out[length..start].copy_from_slice(&found.to_le_bytes());
}

fn text(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend_from_slice(text.as_bytes());
}
