//! Files that end anywhere: by a full disk, by `kill -9`.

use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use mobot_cli::run_log::{LogParams, LogReader, LogWriter, Message};

use occgrid::Pose2;

use super::{Dice, Memory, entries, params, second};

/// Messages of a cut file, and whether it knows that it is one.
fn survivors(bytes: &[u8]) -> (Vec<Message>, bool) {
    let mut reader = LogReader::new(bytes).expect("the start of a log");
    let messages = reader
        .by_ref()
        .map(|e| e.expect("a cut is no error").message)
        .collect();
    (messages, reader.is_cut_off())
}

/// A second of poses, and after each step: when it was, how long the file was.
fn poses(seconds: u32) -> (Vec<u8>, Vec<(f64, usize)>) {
    let memory = Memory::default();
    let log = LogWriter::to(Box::new(memory.clone()), params()).expect("a log");
    let mut lengths = Vec::new();
    for step in 0..20 * seconds {
        let now = f64::from(step) * 0.05;
        log.tick(now);
        log.pose(now, Pose2::new(now, 0.0, 0.0), &[[0.0; 3]; 3]);
        lengths.push((now, memory.bytes().len()));
    }
    log.finish().expect("written");
    (memory.bytes(), lengths)
}

/// Every length: what is left is how the whole began, and no more than the last chunk is lost.
#[test]
fn cut_at_every_length() {
    let (bytes, _) = poses(1);
    let whole = entries(&bytes);
    let (mut last, mut steps) = (0, 0);
    for length in 0..bytes.len() {
        let (left, cut) = survivors(&bytes[..length]);
        assert!(cut, "{length}");
        assert!(left.len() >= last, "{length}");
        assert_eq!(left, whole[..left.len()]);
        steps += u32::from(left.len() > last);
        last = left.len();
    }
    assert_eq!(last, whole.len(), "the summary holds no message");
    assert!(steps >= 5, "a chunk at least every fifth of a second");
    assert!(!survivors(&bytes).1);
}

/// A file that ends while it was written holds everything from a fifth of a second before, and a step.
#[test]
fn cut_at_random_lengths_of_a_longer_one() {
    let (bytes, lengths) = poses(20);
    let mut dice = Dice(5);
    for _ in 0..2000 {
        let length = dice.below(bytes.len() as u64) as usize;
        let (left, cut) = survivors(&bytes[..length]);
        assert!(cut);
        let newest = left.iter().rev().find_map(|message| match message {
            Message::Pose(pose) => Some(pose.pose.pose.position.x),
            _ => None,
        });
        // the step that was being written
        let then = lengths.iter().find(|(_, after)| *after > length);
        let lost = then.map_or(20.0, |then| then.0) - newest.unwrap_or(0.0);
        assert!(lost < 0.31, "{length}: {lost} s");
    }
}

/// Not a test: the process that is killed. Prints a number whenever that second is logged.
#[test]
#[ignore = "run by the test below"]
fn writes_until_it_is_killed() {
    let Some(path) = std::env::var_os("MOBOT_TEST_LOG") else {
        return;
    };
    let log = LogWriter::create(path.as_ref(), LogParams::default()).expect("a log");
    let began = Instant::now();
    for count in 0.. {
        let now = began.elapsed().as_secs_f64();
        log.tick(now);
        log.event(
            now,
            mobot_cli::run_log::Level::Info,
            "count",
            &count.to_string(),
        );
        println!("count {count} {now}");
        std::thread::sleep(Duration::from_millis(5));
    }
    second(&log, 0);
}

#[test]
fn killed_at_any_moment_it_is_readable_up_to_the_last_second() {
    let folder = tempfile::tempdir().unwrap();
    let mut dice = Dice(9);
    for trial in 0..8 {
        let path = folder.path().join(format!("{trial}.mcap"));
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--ignored", "--exact", "--nocapture"])
            .arg("run_log::cut::writes_until_it_is_killed")
            .env("MOBOT_TEST_LOG", &path)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(child.stdout.take().unwrap());
        std::thread::sleep(Duration::from_millis(300 + dice.below(700)));
        // SIGKILL
        child.kill().unwrap();
        child.wait().unwrap();
        let (mut told, mut line) = (0.0_f64, String::new());
        while said.read_line(&mut line).unwrap() > 0 {
            if let Some(rest) = line.strip_prefix("count ")
                && line.ends_with('\n')
            {
                told = rest.trim().split(' ').nth(1).unwrap().parse().unwrap();
            }
            line.clear();
        }
        let reader = LogReader::open(&path).unwrap();
        let mut found = (0_u64, 0_u64);
        for entry in reader {
            let entry = entry.unwrap();
            if found.0 == 0 {
                found.0 = entry.published;
            }
            found.1 = entry.published;
        }
        let covered = (found.1 - found.0) as f64 * 1e-9;
        assert!(told > 0.1, "it ran: {told}");
        assert!(
            told - covered < 0.5,
            "trial {trial}: told {told} s, found {covered} s"
        );
    }
}
