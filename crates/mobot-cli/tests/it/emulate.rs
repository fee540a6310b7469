//! `mobot emulate`: devices on pseudo-terminals, faults while it runs, and `mobot devices` that asks them.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdin, Command, Stdio};
use std::time::{Duration, Instant};

use mobot_hw::serial::{Create2, Create2Params, Port, create2, open};
use mobot_hw::{DifferentialDrive as _, SystemClock, Twist2};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::arguments;
use crate::run::{Run, mobot, testdata};

/// A running `mobot emulate`.
struct Emulator {
    child: Child,
    stdin: ChildStdin,
    stderr: BufReader<ChildStderr>,
    devices: Vec<(String, PathBuf)>,
}

impl Emulator {
    /// Starts it with these arguments, and waits for the lines of so many devices.
    fn start<S: AsRef<std::ffi::OsStr>>(
        arguments: impl IntoIterator<Item = S>,
        devices: usize,
    ) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_mobot"))
            .arg("emulate")
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("mobot starts");
        let stdout = BufReader::new(child.stdout.take().expect("a pipe"));
        let devices = stdout
            .lines()
            .take(devices)
            .map(|line| {
                let line: Value = serde_json::from_str(&line.expect("UTF-8")).expect("JSON");
                let word = |key: &str| line[key].as_str().expect("a word").to_owned();
                (word("kind"), PathBuf::from(word("path")))
            })
            .collect();
        Self {
            stdin: child.stdin.take().expect("a pipe"),
            stderr: BufReader::new(child.stderr.take().expect("a pipe")),
            child,
            devices,
        }
    }

    /// The answer to a line of control.
    fn tell(&mut self, line: &str) -> Value {
        writeln!(self.stdin, "{line}").expect("it listens");
        let mut answer = String::new();
        self.stderr.read_line(&mut answer).expect("UTF-8");
        serde_json::from_str(&answer).expect("JSON")
    }

    fn done(&mut self, line: &str) {
        let answer = self.tell(line);
        assert_eq!(answer["ok"], true, "{answer}");
    }

    fn uri(&self, device: usize) -> String {
        let (kind, path) = &self.devices[device];
        format!("{kind}:{}", path.display())
    }

    /// Ends it by a signal; gives its exit status.
    fn end(mut self, signal: Signal) -> Option<i32> {
        let id = Pid::from_child(&self.child);
        kill_process(id, signal).expect("it runs");
        let status = self.child.wait().expect("it ends");
        for (_, path) in &self.devices {
            assert!(!path.is_symlink(), "{} is left", path.display());
        }
        status.code()
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

const KINDS: [&str; 9] = [
    "create2", "kobuki", "arduino", "maxbotix", "ff", "urm37", "us100", "srf02", "maestro",
];

/// What `mobot devices` says of these, with its exit status.
fn asked(uris: &[String]) -> (i32, Vec<Value>) {
    let mut arguments = arguments!["devices", "--json"].to_vec();
    arguments.extend(uris.iter().map(Into::into));
    let run = mobot(arguments);
    let devices = run.json()["devices"].as_array().expect("a list").clone();
    (run.status, devices)
}

#[test]
fn every_kind_is_ready_at_once_and_answers_mobot_devices() {
    let emulator = Emulator::start(KINDS, KINDS.len());
    let kinds: Vec<&str> = emulator.devices.iter().map(|d| d.0.as_str()).collect();
    assert_eq!(kinds, KINDS);
    let uris: Vec<String> = (0..KINDS.len()).map(|k| emulator.uri(k)).collect();
    // beside busy tests a terminal's bytes may be half a second late, which is a fault to a guard's program: then
    // they are asked again
    let (mut status, mut devices) = asked(&uris);
    for _ in 0..2 {
        if status != 0 {
            (status, devices) = asked(&uris);
        }
    }
    assert_eq!(status, 0, "{devices:?}");
    for (device, uri) in devices.iter().zip(&uris) {
        assert_eq!(device["uri"], uri.as_str());
        assert_eq!(device["ok"], true, "{device}");
        assert!(device["identity"].as_str().is_some_and(|i| !i.is_empty()));
        assert!(device["reading"].as_str().is_some_and(|r| !r.is_empty()));
        let rated = device["rate_hz"].as_f64().is_some_and(|rate| rate > 0.5);
        assert!(rated || device["kind"] == "turret", "{device}");
    }
    let roles: Vec<&str> = devices.iter().flat_map(|d| d["kind"].as_str()).collect();
    assert_eq!(roles[..3], ["base"; 3]);
    assert_eq!(roles[3..8], ["sonar"; 5]);
    assert_eq!(roles[8], "turret");
    assert_eq!(emulator.end(Signal::INT), Some(0));
}

#[test]
fn silence_and_unplugging_are_named_and_pass() {
    let mut emulator = Emulator::start(["maxbotix?model=hrlv", "create2"], 2);
    let uris = [format!("{}?model=hrlv", emulator.uri(0)), emulator.uri(1)];
    emulator.done("all silence on");
    let (status, devices) = asked(&uris);
    assert_eq!(status, 1);
    for device in &devices {
        let error = device["error"].as_str().expect("a reason");
        assert!(error.contains("no answer within"), "{error}");
        assert_eq!(device["ok"], false);
    }
    emulator.done("all ok");
    emulator.done("maxbotix unplug");
    let (status, devices) = asked(&uris);
    assert_eq!(status, 1);
    assert!(
        devices[0]["error"]
            .as_str()
            .expect("a reason")
            .contains("No such file")
    );
    assert_eq!(devices[1]["ok"], true, "{}", devices[1]);
    emulator.done("maxbotix plug");
    let began = Instant::now();
    while asked(&uris[..1]).0 != 0 {
        assert!(began.elapsed() < Duration::from_secs(5));
    }
    assert_eq!(emulator.end(Signal::TERM), Some(0));
}

#[test]
fn a_stuck_sonar_and_a_kidnapped_robot() {
    let arguments = ["ff", "ff", "--world", "hall", "--start", "10,6,0"];
    let mut emulator = Emulator::start(arguments, 2);
    assert_eq!(emulator.devices[1].0, "ff");
    let reading = |emulator: &Emulator, device| {
        let (_, devices) = asked(&[emulator.uri(device)]);
        devices[0]["reading"]
            .as_str()
            .expect("a reading")
            .to_owned()
    };
    let before = reading(&emulator, 0);
    emulator.done("ff stuck on");
    // towards a wall, 1.5 m away
    emulator.done("robot kidnap 18,1.5,-1.5708");
    assert_eq!(reading(&emulator, 0), before);
    let range = reading(&emulator, 1);
    assert!(
        range.starts_with("echo from 1.3") || range.starts_with("echo from 1.2"),
        "{range}"
    );
    let truth = emulator.tell("robot truth");
    assert_eq!(truth["pose"][0], 18.0, "{truth}");
    assert_eq!(truth["collisions"], 0);
}

/// The lines of a log that have this key.
fn logged(path: &Path, key: &str) -> Vec<Value> {
    let text = std::fs::read_to_string(path).expect("a log");
    let lines = text
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    lines.filter(|line| line.get(key).is_some()).collect()
}

#[test]
fn the_log_tells_the_wheel_command_in_force_and_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.jsonl");
    let links = folder.path().join("dev");
    let mut emulator = Emulator::start(
        arguments![
            "create2", "--links", &links, "--log", &log, "--world", "office"
        ],
        1,
    );
    assert_eq!(emulator.devices[0].1, links.join("create2"));
    let port: Port = open(
        links.join("create2").to_str().unwrap(),
        create2::BAUD,
        false,
    )
    .unwrap();
    let clock = SystemClock::start();
    let mut base = Create2::open(port, clock, Create2Params::default()).expect("a base");
    let began = Instant::now();
    while began.elapsed() < Duration::from_millis(700) {
        base.drive(Twist2::new(0.2, 0.0)).expect("a command");
        base.status().expect("a state");
    }
    emulator.done("create2 drop 0.01");
    base.stop().expect("a stop");
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(emulator.end(Signal::INT), Some(0));

    let wheels = logged(&log, "wheels");
    let speed = |line: &Value| line["wheels"][0].as_f64().expect("a number");
    assert!(
        wheels.iter().any(|line| (speed(line) - 0.2).abs() < 1e-3),
        "{wheels:?}"
    );
    assert!(speed(wheels.last().expect("a command")).abs() < 1e-9);
    assert_eq!(wheels[0]["device"], "create2");
    let control = logged(&log, "control");
    assert_eq!(control[0]["control"], "create2 drop 0.01");
    // the stop came right after that, on the same clock as everything in this machine
    let stamp = |line: &Value| line["stamp"].as_f64().expect("a number");
    let late = stamp(wheels.last().unwrap()) - stamp(&control[0]);
    assert!((-0.05..0.2).contains(&late), "{late}");
    let truth = logged(&log, "truth");
    let driven = truth.last().expect("the truth")["truth"]["driven_m"].as_f64();
    assert!(driven.is_some_and(|way| way > 0.05), "{truth:?}");
    assert!(truth.windows(2).all(|t| stamp(&t[0]) < stamp(&t[1])));
}

#[test]
fn control_that_is_not_understood_says_what_was_expected() {
    let mut emulator = Emulator::start(["create2"], 1);
    for (line, words) in [
        ("kobuki ok", "expected create2, all or robot"),
        ("create2", "expected ok, unplug"),
        ("create2 drop", "expected ok, unplug"),
        ("create2 drop 2", "expected 1 of 0 to 1"),
        ("create2 drop nan", "expected 1 of 0 to 1"),
        ("create2 slow 0.5", "expected 1 of 1 to 1000"),
        ("create2 silence maybe", "expected on or off"),
        ("create2 stuck up", "expected on, off, left or right"),
        ("robot kidnap 1,2", "expected 3 of"),
        ("robot slip 0.1,x", "expected 2 of"),
        ("robot dance 1", "expected truth, slip"),
        ("robot", "expected robot truth"),
    ] {
        let answer = emulator.tell(line);
        assert_eq!(answer["ok"], false, "{line}");
        let error = answer["error"].as_str().expect("a reason");
        assert!(error.contains(words), "{line}: {error}");
    }
    emulator.done("create2 slow 2");
}

/// Status 2 and one line that holds all of these words.
fn refused(run: &Run, words: &[&str]) {
    assert_eq!(run.status, 2, "{}{}", run.stdout, run.stderr);
    assert_eq!(run.stderr.lines().count(), 1, "one line: {}", run.stderr);
    assert_eq!(run.stdout, "");
    for word in words {
        assert!(run.stderr.contains(word), "{word:?} not in {}", run.stderr);
    }
}

#[test]
fn emulations_that_cannot_be_are_refused() {
    refused(&mobot(["emulate"]), &["KIND"]);
    refused(
        &mobot(["emulate", "roomba"]),
        &["roomba", "create2, kobuki"],
    );
    refused(
        &mobot(["emulate", "maxbotix?model=hc"]),
        &["model", "lv, xl", "\"hc\""],
    );
    refused(
        &mobot(["emulate", "create2?model=lv"]),
        &["create2", "options none", "model"],
    );
    refused(
        &mobot(["emulate", "create2", "--world", "atlantis"]),
        &["atlantis", "sketch, office, hall"],
    );
    refused(
        &mobot(["emulate", "create2", "--start", "0,0,0"]),
        &["room at its start"],
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("create2"), "a file").unwrap();
    refused(
        &mobot(arguments!["emulate", "create2", "--links", folder.path()]),
        &["links in"],
    );
    assert_eq!(
        std::fs::read_to_string(folder.path().join("create2")).unwrap(),
        "a file"
    );
}

#[test]
fn a_mission_drives_emulated_devices_and_leaves_them_standing() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.jsonl");
    let map = testdata("maps/nav2/depot.yaml");
    let emulator = Emulator::start(
        arguments![
            "create2",
            "maxbotix",
            "maestro",
            "--world",
            &map,
            "--start",
            "4.6,7.7,0",
            "--log",
            &log
        ],
        3,
    );
    // a goal that it does not reach in this time
    let run = mobot(arguments![
        "drive",
        "--base",
        emulator.uri(0),
        "--sonar",
        emulator.uri(1),
        "--turret",
        emulator.uri(2),
        "--map",
        &map,
        "--start",
        "4.6,7.7,0",
        "--to",
        "9,7.7",
        "--budget",
        "8",
        "--out",
        folder.path().join("out"),
        "--json"
    ]);
    assert_eq!(run.status, 1, "{}{}", run.stdout, run.stderr);
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(emulator.end(Signal::INT), Some(0));
    let wheels = logged(&log, "wheels");
    let last = wheels.last().expect("a command");
    assert_eq!(last["wheels"], serde_json::json!([0.0, 0.0]), "{last}");
    let truth = logged(&log, "truth");
    let last = &truth.last().expect("the truth")["truth"];
    assert!(
        last["driven_m"].as_f64().is_some_and(|way| way > 0.3),
        "{last}"
    );
    assert_eq!(last["collisions"], 0);
}

#[test]
fn any_ros_map_is_a_world() {
    let map = testdata("maps/nav2/TenByTen/TenByTen.yaml");
    let emulator = Emulator::start(arguments!["ff", "--world", map], 1);
    let (status, devices) = asked(&[emulator.uri(0)]);
    assert_eq!(status, 0, "{devices:?}");
}
