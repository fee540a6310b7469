//! `mobot drive`, and `mobot replay` of its log.

use std::path::{Path, PathBuf};

use mobot_cli::run_log::{Decision, Level, LogReader, LogWriter, Message, Recipe};
use mobot_hw::wrap::Sink as _;
use occgrid::{SaveOptions, save_map};
use serde_json::Value;

use super::params;
use crate::arguments;
use crate::nav_worlds::Site;
use crate::run::{Run, mobot};

fn drive(folder: &Path, more: &[&str]) -> (Run, PathBuf) {
    let map = folder.join("office.yaml");
    let site = Site::without_people("office");
    save_map(&map, &site.map, None, &SaveOptions::default()).expect("a map");
    let out = folder.join("out");
    let mut words = arguments![
        "drive", "--json", "--world", "office", "--start", "1.5,0,0", "--map", &map, "--out", &out
    ]
    .to_vec();
    words.extend(more.iter().map(std::ffi::OsString::from));
    // the original map must not be needed again
    let run = mobot(words);
    std::fs::remove_file(&map).expect("removed");
    (run, out.join("run.mcap"))
}

fn replay(log: &Path) -> (Run, Value) {
    let run = mobot(arguments!["replay", "--json", log]);
    assert!(run.status < 2, "{}", run.stderr);
    let answer = run.json();
    (run, answer)
}

/// The log again, each decision as `change` makes it.
fn rewritten(from: &Path, to: &Path, change: impl Fn(u64, Decision) -> Decision) {
    let log = LogWriter::create(to, params()).expect("a log");
    Recipe::read(LogReader::open(from).expect("a log"))
        .expect("a recipe")
        .write(&log);
    let replayed = mobot_cli::run_log::calls(from).expect("a log");
    for call in replayed {
        log.take(call.expect("a call"));
    }
    let mut count = 0;
    for entry in LogReader::open(from).expect("a log") {
        if let Message::Decision(decision) = entry.expect("an entry").message {
            log.decision(&change(count, decision));
            count += 1;
        }
    }
    log.event(0.0, Level::Info, "test", "rewritten");
    log.finish().expect("written");
}

#[test]
fn a_drive_with_a_camera_decides_the_same_from_its_log() {
    let folder = tempfile::tempdir().unwrap();
    let (run, log) = drive(folder.path(), &["--camera", "sim:", "--to", "3,0.2,1.5"]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let (run, answer) = replay(&log);
    assert_eq!(answer["difference"], Value::Null, "{answer}");
    assert_eq!(answer["decisions_equal"], true);
    assert_eq!(answer["cut_off"], false);
    assert!(answer["decisions"].as_u64() > Some(300), "{answer}");
    assert_eq!(run.status, 0);

    // a log whose decisions are not those of its devices is found out
    let other = folder.path().join("other.mcap");
    rewritten(&log, &other, |count, mut decision| {
        if count == 100 {
            decision.time = decision.time.next_up();
        }
        decision
    });
    let (run, answer) = replay(&other);
    assert_eq!(
        (run.status, &answer["decisions_equal"]),
        (1, &Value::Bool(false))
    );
    assert_eq!(answer["decisions"], 100, "{answer}");
    rewritten(&log, &other, |_, decision| decision);
    assert_eq!(replay(&other).1["decisions_equal"], true);

    // cut off anywhere, what is left is decided again
    let bytes = std::fs::read(&log).unwrap();
    for tenths in [3, 6, 9] {
        std::fs::write(&log, &bytes[..bytes.len() * tenths / 10]).unwrap();
        let (_, answer) = replay(&log);
        assert_eq!(answer["decisions_equal"], true, "{answer}");
        assert_eq!(answer["cut_off"], true);
    }
}

/// The log of a drive that gets this signal under way, and whether it ended in order.
#[cfg(unix)]
fn stopped_by(folder: &Path, signal: rustix::process::Signal) -> (PathBuf, bool) {
    use std::process::{Command, Stdio};

    let map = folder.join("office.yaml");
    let site = Site::without_people("office");
    save_map(&map, &site.map, None, &SaveOptions::default()).expect("a map");
    let out = folder.join("out");
    let mut child = Command::new(env!("CARGO_BIN_EXE_mobot"))
        .args(["drive", "--world", "office", "--start", "1.5,0,0"])
        .args(["--camera", "sim:", "--to", "14,-2"])
        .args(arguments!["--map", &map, "--out", &out])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("it starts");
    let log = out.join("run.mcap");
    let under_way = || {
        let decision = |e: &mobot_cli::run_log::Entry| matches!(e.message, Message::Decision(_));
        LogReader::open(&log).is_ok_and(|log| log.flatten().filter(decision).count() > 100)
    };
    for _ in 0..2000 {
        if under_way() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let pid = i32::try_from(child.id()).expect("a process");
    let pid = rustix::process::Pid::from_raw(pid).expect("a process");
    rustix::process::kill_process(pid, signal).expect("it runs");
    let status = child.wait().expect("it ends");
    (log, status.success())
}

/// Interrupted, the robot stops; the log knows when, and its replay stops there, too.
#[cfg(unix)]
#[test]
fn an_interrupted_drive_is_interrupted_again() {
    let folder = tempfile::tempdir().unwrap();
    let (log, in_order) = stopped_by(folder.path(), rustix::process::Signal::INT);
    assert!(in_order);
    let (_, answer) = replay(&log);
    assert_eq!(answer["difference"], Value::Null, "{answer}");
    assert_eq!(answer["decisions_equal"], true);
    assert_eq!(answer["cut_off"], false);
}

/// What a killed drive left is decided again.
#[cfg(unix)]
#[test]
fn a_killed_drive_leaves_a_log_that_replays() {
    let folder = tempfile::tempdir().unwrap();
    let (log, in_order) = stopped_by(folder.path(), rustix::process::Signal::KILL);
    assert!(!in_order);
    let (_, answer) = replay(&log);
    assert_eq!(answer["difference"], Value::Null, "{answer}");
    assert_eq!(answer["decisions_equal"], true);
    assert_eq!(answer["cut_off"], true);
    assert!(answer["decisions"].as_u64() > Some(100), "{answer}");
}
