//! `mobot drive` from outside.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use mobot_cli::run_log::{LogReader, Message};
use occgrid::{SaveOptions, save_map};
use serde_json::Value;

use crate::nav_worlds::Site;

fn drive(map: &Path, out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mobot"));
    command
        .args(["drive", "--json", "--camera", "sim:", "--world", "office"])
        // a turn more is the same heading
        .args(["--start", "1.5,0,6.283185307179586"])
        .arg("--map")
        .arg(map)
        .arg("--out")
        .arg(out)
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn mapped(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("office.yaml");
    let site = Site::without_people("office");
    save_map(&path, &site.map, None, &SaveOptions::default()).expect("a map");
    path
}

#[test]
fn a_simulated_robot_drives_to_its_goal() {
    let folder = tempfile::tempdir().expect("a folder");
    let map = mapped(folder.path());
    let out = folder.path().join("out");
    let answer = drive(&map, &out, &["--to", "4.5,0.2,1.5"])
        .output()
        .expect("it runs");
    assert!(answer.status.success(), "{answer:?}");
    let answer: Value = serde_json::from_slice(&answer.stdout).expect("one JSON object");
    assert_eq!(answer["ok"], true, "{answer}");
    assert_eq!(answer["drive"]["reached"], true);
    assert_eq!(answer["drive"]["collisions"], 0);
    assert!(answer["drive"]["min_clearance_m"].as_f64() > Some(0.05));
    assert!(answer["drive"]["distance_m"].as_f64() > Some(2.9));
    assert!(answer["localization"]["max_m"].as_f64() < Some(0.1));
    assert!(answer["localization"]["mean_m"].is_number());
    assert!(answer["localization"]["odometry_only_max_m"].is_number());
    let summary = std::fs::read(out.join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_slice(&summary).expect("JSON");
    assert_eq!(summary, answer);
    let events = std::fs::read_to_string(out.join("events.jsonl")).expect("events");
    let last = events.lines().last().expect("events");
    assert!(last.contains("stop: done"), "{last}");
    let poses = LogReader::open(&out.join("run.mcap"))
        .expect("a run log")
        .filter(|entry| matches!(entry.as_ref().expect("whole").message, Message::Pose(_)))
        .count();
    assert!(poses > 50, "{poses}");
}

#[test]
fn a_goal_that_cannot_be_reached_is_a_no_with_its_reason() {
    let folder = tempfile::tempdir().expect("a folder");
    let map = mapped(folder.path());
    let out = folder.path().join("out");
    let answer = drive(&map, &out, &["--to", "-40,0"])
        .output()
        .expect("it runs");
    assert_eq!(answer.status.code(), Some(1));
    let answer: Value = serde_json::from_slice(&answer.stdout).expect("one JSON object");
    assert_eq!(answer["outcome"], "outside");
    assert!(answer["drive"]["pose"][2].as_f64() < Some(0.01), "{answer}");
    for bad in [
        ["--to", "1"],
        ["--to", "1,nan"],
        ["--radius", "-1"],
        ["--budget", "0"],
    ] {
        let mut words = vec!["--to", "4.5,0.2"];
        if bad[0] == "--to" {
            words.clear();
        }
        words.extend(bad);
        let answer = drive(&map, &out, &words).output().expect("it runs");
        assert_eq!(answer.status.code(), Some(2), "{bad:?}");
        let lines = String::from_utf8_lossy(&answer.stderr).lines().count();
        assert_eq!(lines, 1, "{bad:?}");
    }
}

/// The robot stands, everything is saved, and the status is 0.
#[cfg(unix)]
#[test]
fn an_interrupted_drive_ends_in_order() {
    let folder = tempfile::tempdir().expect("a folder");
    let map = mapped(folder.path());
    let out = folder.path().join("out");
    // there is no way to this goal within the time the test gives it
    let mut child = drive(&map, &out, &["--to", "14,-2"])
        .spawn()
        .expect("it runs");
    // as soon as it drives: an idle machine simulates the whole mission in a second
    let log = out.join("run.mcap");
    let written = || std::fs::metadata(&log).is_ok_and(|meta| meta.len() > 0);
    let started = Instant::now();
    while !written() && started.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let pid = i32::try_from(child.id()).expect("a process");
    let pid = rustix::process::Pid::from_raw(pid).expect("a process");
    rustix::process::kill_process(pid, rustix::process::Signal::INT).expect("sent");
    let sent = Instant::now();
    let status = child.wait().expect("it ends");
    assert!(sent.elapsed() < Duration::from_secs(20));
    assert!(status.success(), "{status:?}");
    let summary = std::fs::read(out.join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_slice(&summary).expect("JSON");
    assert_eq!(summary["outcome"], "interrupted");
}
