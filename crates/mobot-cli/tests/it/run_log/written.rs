//! What goes in comes out.

use std::path::Path;

use mobot_cli::run_log::mcap::McapReader;
use mobot_cli::run_log::{Level, LogParams, LogReader, LogWriter, Message, Stamps};
use mobot_hw::{CameraFrame, Ping};
use occgrid::{Pose2, Reading};

use super::{Memory, START, entries, params, picture, second, seconds};

#[test]
fn every_topic_comes_back_as_it_was_written() {
    let bytes = seconds(1);
    let reader = McapReader::new(&bytes[..]).unwrap();
    let mut counts = std::collections::BTreeMap::new();
    for message in reader {
        let message = message.unwrap();
        let seen = counts.entry(message.topic.to_string()).or_insert(0_u32);
        assert_eq!(message.sequence, *seen, "{}", message.topic);
        *seen += 1;
    }
    let found: Vec<(&str, u32)> = counts.iter().map(|(t, n)| (t.as_str(), *n)).collect();
    assert_eq!(
        found,
        [
            ("/camera/image_raw/compressed", 1),
            ("/map", 1),
            ("/mobot/calls", 21),
            ("/mobot/decisions", 20),
            ("/mobot/inputs", 1),
            ("/odom", 20),
            ("/plan", 1),
            ("/pose", 20),
            ("/rosout", 1),
            ("/sonar", 20),
            ("/tf", 40),
        ]
    );
    let mut ranges = Vec::new();
    for entry in LogReader::new(&bytes[..]).unwrap() {
        let entry = entry.unwrap();
        match entry.message {
            Message::Pose(pose) => {
                let flat = pose.pose.flat();
                assert!((flat[1][1] - 0.02).abs() < 1e-15 && (flat[0][1] - 0.001).abs() < 1e-15);
                assert!((pose.pose.pose.flat().theta - 0.3).abs() < 1e-12);
                assert_eq!(pose.header.frame_id, "map");
                let stamp = u64::from(pose.header.stamp.sec.cast_unsigned()) * 1_000_000_000
                    + u64::from(pose.header.stamp.nanosec);
                assert_eq!(stamp, entry.published);
                assert!(entry.logged == entry.published);
            }
            Message::Range(range) => {
                // when it fired, not when it was written
                assert_eq!(entry.logged - entry.published, 30_000_000);
                ranges.push(range.range);
            }
            Message::Map(map) => {
                assert_eq!((map.info.width, map.info.height), (3, 2));
                // the lower row first
                assert_eq!(map.data, [-1, 73, 27, 98, -1, 2]);
                assert_eq!(
                    map.info.origin.flat(),
                    Pose2::new(-1.0, 2.0, map.info.origin.flat().theta)
                );
            }
            Message::Path(path) => {
                assert_eq!(path.poses.len(), 2);
                let yaw = path.poses[0].pose.orientation.yaw();
                assert!((yaw - std::f64::consts::FRAC_PI_4).abs() < 1e-12);
            }
            Message::Frame(frame) => {
                let image = image::load_from_memory(&frame.data).unwrap().into_luma8();
                assert_eq!(image, picture(10));
            }
            Message::Event(event) => {
                assert_eq!((event.level, event.name.as_str()), (30, "stop"));
                assert_eq!(event.msg, "obstacle 0.3 m ahead — grün");
            }
            Message::Input(input) => {
                assert_eq!((input.name.as_str(), input.data.len()), ("job.json", 2))
            }
            _ => {}
        }
    }
    assert_eq!(ranges[..3], [1.25, f32::INFINITY, f32::NEG_INFINITY]);
    assert!(ranges[3].is_nan());
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    assert_eq!(seconds(2), seconds(2));
}

#[test]
fn stamps_are_wall_time_unless_told_otherwise() {
    let memory = Memory::default();
    let log = LogWriter::to(Box::new(memory.clone()), LogParams::default()).unwrap();
    let wall = || {
        let since = std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap();
        since.as_nanos() as u64
    };
    let before = wall();
    log.tick(1000.0);
    log.pose(1000.0, Pose2::default(), &[[0.0; 3]; 3]);
    log.pose(999.0, Pose2::default(), &[[0.0; 3]; 3]);
    log.pose(f64::NAN, Pose2::default(), &[[0.0; 3]; 3]);
    let after = wall();
    log.finish().unwrap();
    let stamps: Vec<u64> = LogReader::new(&memory.bytes()[..])
        .unwrap()
        .map(Result::unwrap)
        .filter(|entry| matches!(entry.message, Message::Pose(_)))
        .map(|entry| entry.published)
        .collect();
    assert!(before <= stamps[0] && stamps[0] <= after);
    assert_eq!(stamps[0] - stamps[1], 1_000_000_000);
    assert_eq!(stamps[0], stamps[2]);
}

#[test]
fn a_frame_that_is_handed_over_twice_is_written_once() {
    let memory = Memory::default();
    let log = LogWriter::to(Box::new(memory.clone()), params()).unwrap();
    let frame = |sequence| CameraFrame {
        stamp: 0.5,
        sequence,
        image: picture(1),
    };
    for sequence in [1, 1, 2] {
        log.frame(&frame(sequence));
    }
    log.finish().unwrap();
    assert_eq!(entries(&memory.bytes()).len(), 2);
}

#[test]
fn what_waits_goes_out_within_a_fifth_of_a_second() {
    let memory = Memory::default();
    let log = LogWriter::to(Box::new(memory.clone()), params()).unwrap();
    let mut newest = 0;
    for k in 0..100_u32 {
        let now = f64::from(k) * 0.03;
        log.tick(now);
        log.event(now, Level::Info, "k", &k.to_string());
        for message in entries(&memory.bytes()) {
            if let Message::Event(event) = message {
                newest = event.msg.parse().unwrap();
            }
        }
        assert!(f64::from(k - newest) * 0.03 < 0.24, "{k} {newest}");
    }
}

#[test]
fn a_log_that_cannot_be_written_keeps_quiet_until_it_is_asked() {
    let full = Path::new("/dev/full");
    if !full.exists() {
        println!("skipped: no /dev/full");
        return;
    }
    // the first bytes do not get there
    assert!(LogWriter::create(full, params()).is_err());
    /// A disk with room for so much.
    struct Room(usize);
    impl std::io::Write for Room {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            if self.0 < bytes.len() {
                return Err(std::io::ErrorKind::StorageFull.into());
            }
            self.0 -= bytes.len();
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    for room in [100, 10_000, 30_000] {
        let log = LogWriter::to(Box::new(Room(room)), params()).unwrap();
        second(&log, 0);
        second(&log, 1);
        assert!(log.fault().is_some(), "{room}");
        let error = log.finish().unwrap_err();
        assert_eq!(error.kind(), std::io::ErrorKind::StorageFull);
    }
}

#[test]
fn nothing_that_a_device_says_breaks_it() {
    let memory = Memory::default();
    let log = LogWriter::to(Box::new(memory.clone()), params()).unwrap();
    for time in [f64::NAN, f64::INFINITY, f64::MIN, f64::MAX, -1e300, 0.0] {
        log.tick(time);
        log.pose(time, Pose2::new(time, time, time), &[[time; 3]; 3]);
        log.range(&Ping {
            stamp: time,
            bearing: time,
            settled: false,
            reading: Reading::Echo { range: time },
        });
        log.tf(time, "", "\0", Pose2::default());
        log.event(time, Level::Debug, "\0\n", "\u{feff}");
    }
    log.finish().unwrap();
    assert_eq!(entries(&memory.bytes()).len(), 6 * 6);
}

#[test]
fn stamps_of_a_log_begin_where_they_are_told() {
    let Stamps::From(start) = params().stamps else {
        panic!("a start");
    };
    assert_eq!(start, START);
    let first = LogReader::new(&seconds(1)[..])
        .unwrap()
        .nth(1)
        .unwrap()
        .unwrap();
    assert_eq!(first.logged, START);
}
