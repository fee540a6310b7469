//! Files from strangers: one clear error, in little time and memory, never a panic.

use std::io::Read;
use std::time::Instant;

use mobot_cli::run_log::cdr::{CdrError, from_bytes};
use mobot_cli::run_log::mcap::{MAX_RECORD, McapReader};
use mobot_cli::run_log::{LogReader, ros};

use super::{Dice, seconds};

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Reads as much as there is; the error, if there is one.
fn read_all(bytes: &[u8]) -> Option<String> {
    let reader = match LogReader::new(bytes) {
        Ok(reader) => reader,
        Err(error) => return Some(error.to_string()),
    };
    let mut error = None;
    for entry in reader {
        if let Err(e) = entry {
            // messages of a wrong kind are told one by one; the file's own error ends it
            error = Some(e.to_string());
        }
    }
    error
}

fn record(opcode: u8, length: u64, body: &[u8]) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.push(opcode);
    bytes.extend(length.to_le_bytes());
    bytes.extend_from_slice(body);
    bytes
}

#[test]
fn each_lie_has_its_line() {
    let chunk_of = |records: &[u8], size: u64, checksum: u32, compression: &str| {
        let mut body = vec![0; 16];
        body.extend(size.to_le_bytes());
        body.extend(checksum.to_le_bytes());
        body.extend((compression.len() as u32).to_le_bytes());
        body.extend(compression.as_bytes());
        body.extend(size.to_le_bytes());
        body.extend(records);
        record(0x06, body.len() as u64, &body)
    };
    // a message record that says it is longer than its chunk
    let mut long = vec![0x05];
    long.extend(100_u64.to_le_bytes());
    long.extend([0; 30]);
    let mut orphan = vec![0x05];
    orphan.extend(22_u64.to_le_bytes());
    orphan.extend([7; 22]);
    let cases: [(Vec<u8>, &str); 11] = [
        (
            b"PNG".to_vec(),
            "expected an MCAP file, found other bytes at its start",
        ),
        (
            record(0x05, u64::MAX, b""),
            "byte 8: expected a record of at most 67108864 bytes, found 18446744073709551615",
        ),
        (
            record(0x06, MAX_RECORD as u64 + 1, b""),
            "byte 8: expected a record of at most 67108864 bytes, found 67108865",
        ),
        (
            record(0, 0, b""),
            "byte 8: expected a record, found a zero byte",
        ),
        (
            record(0x03, 3, b"abc"),
            "byte 8: expected a schema's number and name",
        ),
        (
            record(0x04, 8, &[1, 0, 0, 0, 255, 255, 255, 255]),
            "byte 8: expected a channel's number, schema and topic",
        ),
        (
            record(0x05, 22, &[7; 22]),
            "byte 8: expected the channel of a message before the message",
        ),
        (
            chunk_of(&orphan, 1 << 40, 0, ""),
            "byte 8: expected a chunk's times, sizes and records",
        ),
        (
            chunk_of(&long, long.len() as u64, 0, ""),
            "byte 8: expected records that fill their chunk",
        ),
        (
            chunk_of(&orphan, orphan.len() as u64, 1, ""),
            "byte 8: checksum of the chunk: expected 00000001, found ",
        ),
        (
            chunk_of(&orphan, orphan.len() as u64, 0, "zs\ntd"),
            "byte 8: expected a chunk without compression, found \"zs\\ntd\"",
        ),
    ];
    for (bytes, expected) in cases {
        let error = read_all(&bytes).unwrap_or_default();
        assert!(error.starts_with(expected), "{error:?} {expected:?}");
        assert!(!error.chars().any(char::is_control));
    }
}

#[test]
fn a_promise_of_much_takes_no_memory() {
    /// A source that counts what is asked of it.
    struct Counting<'a>(&'a [u8], usize);
    impl Read for Counting<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            self.1 = self.1.max(buffer.len());
            self.0.read(buffer)
        }
    }
    let bytes = record(0x05, MAX_RECORD as u64, &[1; 1000]);
    let mut source = Counting(&bytes, 0);
    let mut reader = McapReader::new(&mut source).unwrap();
    assert!(reader.next().is_none() && reader.is_cut_off());
    assert!(source.1 < 1 << 16, "{}", source.1);
    // a sequence of four thousand million poses in a few bytes
    let mut path = vec![0, 1, 0, 0];
    path.extend([0; 8]);
    path.extend(1_u32.to_le_bytes());
    path.extend([0; 4]);
    path.extend(u32::MAX.to_le_bytes());
    path.extend([0; 200]);
    let began = Instant::now();
    let error = from_bytes::<ros::Path>(&path).unwrap_err();
    assert!(matches!(error, CdrError::End { .. }), "{error}");
    assert!(began.elapsed().as_millis() < 100);
}

#[test]
fn spoilt_logs_are_read_to_the_spot_and_no_further() {
    let bytes = seconds(1);
    let mut dice = Dice(3);
    let (mut refused, mut passed) = (0, 0);
    for _ in 0..3000 {
        let mut spoilt = bytes.clone();
        for _ in 0..=dice.below(3) {
            let at = dice.below(spoilt.len() as u64) as usize;
            match dice.below(4) {
                0 => spoilt[at] ^= 1 << dice.below(8),
                1 => spoilt[at] = dice.next() as u8,
                2 => {
                    spoilt.remove(at);
                }
                _ => spoilt.insert(at, dice.next() as u8),
            }
        }
        if read_all(&spoilt).is_some() {
            refused += 1;
        } else {
            passed += 1;
        }
    }
    // what lies in a chunk is under its checksum; indexes and the summary are not read
    assert!(refused > 1500, "{refused} {passed}");
}

#[test]
fn random_bytes_behind_the_magic() {
    let mut dice = Dice(4);
    for _ in 0..20_000 {
        let mut bytes = MAGIC.to_vec();
        for _ in 0..dice.below(6) {
            bytes.push(dice.below(16) as u8);
            bytes.extend(dice.below(40).to_le_bytes());
            for _ in 0..dice.below(40) {
                bytes.push(dice.below(4) as u8);
            }
        }
        read_all(&bytes);
    }
}

#[test]
fn messages_of_any_bytes_are_read_or_refused() {
    let mut dice = Dice(6);
    for _ in 0..50_000 {
        let mut bytes = vec![0, 1, 0, 0];
        for _ in 0..dice.below(80) {
            bytes.push(if dice.below(3) == 0 {
                dice.next() as u8
            } else {
                0
            });
        }
        let _ = from_bytes::<ros::Path>(&bytes);
        let _ = from_bytes::<ros::Odometry>(&bytes);
        let _ = from_bytes::<ros::OccupancyGrid>(&bytes);
        let _ = from_bytes::<ros::TFMessage>(&bytes);
        let _ = from_bytes::<mobot_cli::run_log::CallRecord>(&bytes);
    }
    assert_eq!(
        from_bytes::<ros::Time>(b"\0\0\0\0").unwrap_err(),
        CdrError::Header
    );
}
