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

/// Interrupted, the robot stops; the log knows when, and its replay stops there, too.
#[cfg(unix)]
#[test]
fn an_interrupted_drive_is_interrupted_again() {
    use std::process::{Command, Stdio};

    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("office.yaml");
    let site = Site::without_people("office");
    save_map(&map, &site.map, None, &SaveOptions::default()).unwrap();
    let out = folder.path().join("out");
    let mut child = Command::new(env!("CARGO_BIN_EXE_mobot"))
        .args([
            "drive", "--world", "office", "--start", "1.5,0,0", "--to", "14,-2",
        ])
        .args(arguments!["--map", &map, "--out", &out])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let log = out.join("run.mcap");
    let moved = || {
        let decisions = LogReader::open(&log).ok().map(|log| {
            let decision =
                |e: &mobot_cli::run_log::Entry| matches!(e.message, Message::Decision(_));
            log.flatten().filter(decision).count()
        });
        decisions > Some(100)
    };
    for _ in 0..2000 {
        if moved() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let pid = rustix::process::Pid::from_raw(i32::try_from(child.id()).unwrap()).unwrap();
    let sent = rustix::process::kill_process(pid, rustix::process::Signal::INT);
    let status = child.wait().unwrap();
    assert!(sent.is_ok() && status.success(), "{status:?}");
    let (_, answer) = replay(&log);
    assert_eq!(answer["difference"], Value::Null, "{answer}");
    assert_eq!(answer["decisions_equal"], true);
    assert_eq!(answer["cut_off"], false);
}
