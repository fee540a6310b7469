//! The MCAP container (mcap.dev/spec), as far as a run log needs it: uncompressed chunks, their indexes, a
//! summary. Written so that a file that was never finished is whole up to its last chunk; read without
//! trusting a single length.

mod read;
mod write;

pub use read::{LoggedMessage, McapError, McapReader};
pub(crate) use write::{ChannelInfo, McapWriter};

/// What a file begins and ends with.
const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// Longest record that is read or written [bytes].
pub const MAX_RECORD: usize = 64 << 20;

/// First bytes of records.
mod op {
    pub(super) const HEADER: u8 = 0x01;
    pub(super) const FOOTER: u8 = 0x02;
    pub(super) const SCHEMA: u8 = 0x03;
    pub(super) const CHANNEL: u8 = 0x04;
    pub(super) const MESSAGE: u8 = 0x05;
    pub(super) const CHUNK: u8 = 0x06;
    pub(super) const MESSAGE_INDEX: u8 = 0x07;
    pub(super) const CHUNK_INDEX: u8 = 0x08;
    pub(super) const STATISTICS: u8 = 0x0B;
    pub(super) const SUMMARY_OFFSET: u8 = 0x0E;
    pub(super) const DATA_END: u8 = 0x0F;
}
