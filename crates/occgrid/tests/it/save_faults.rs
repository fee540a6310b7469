//! A save that is killed or fails at any system call leaves the old map or the new map, whole.

#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests, which fail by panicking"
)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use occgrid::{LoadOptions, LoadedMap, MapFileError, load_map};

/// The traced program, `examples/save_map.rs`: built by `cargo test`, or now where only this test is.
pub(crate) fn example() -> PathBuf {
    static BUILT: std::sync::Once = std::sync::Once::new();
    let test = std::env::current_exe().unwrap();
    let profile = test.parent().and_then(Path::parent).unwrap().to_path_buf();
    let example = profile.join("examples").join("save_map");
    BUILT.call_once(|| {
        if is_fresh(&example) {
            return;
        }
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut build = Command::new(cargo);
        build.args([
            "build",
            "--quiet",
            "--package",
            "occgrid",
            "--example",
            "save_map",
        ]);
        if profile.ends_with("release") {
            build.arg("--release");
        }
        build.arg("--target-dir").arg(profile.parent().unwrap());
        build.current_dir(env!("CARGO_MANIFEST_DIR"));
        assert!(build.status().unwrap().success(), "{build:?}");
    });
    example
}

/// Whether the example is younger than every source that it is made from.
fn is_fresh(example: &Path) -> bool {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let age = |path: &Path| fs::metadata(path).and_then(|m| m.modified());
    let Ok(built) = age(example) else {
        return false;
    };
    let sources = fs::read_dir(package.join("src")).unwrap();
    let sources = sources.map(|entry| entry.unwrap().path());
    sources
        .chain([package.join("examples/save_map.rs")])
        .all(|source| age(&source).is_ok_and(|changed| changed < built))
}

fn is_long() -> bool {
    std::env::var_os("MOBOT_LONG").is_some()
}

/// The seed of a map that `examples/save_map.rs` made, after checking that every part is of that one.
fn whole(loaded: &LoadedMap) -> u32 {
    let log_odds = loaded.log_odds.as_deref().expect("saved with log-odds");
    let seed = (log_odds[0] * 3.0).round() as u32;
    let frame = loaded.map.frame();
    assert_eq!((frame.width(), frame.height()), (40 + seed % 7, 30));
    assert!((frame.origin().y - f64::from(seed) / 7.0).abs() < 1e-12);
    for (i, (&value, &odds)) in loaded.map.values().iter().zip(log_odds).enumerate() {
        let i = i as u32 + seed;
        assert_eq!(value, [-1, 0, 100][(i % 3) as usize]);
        assert_eq!(odds.to_bits(), (i as f32 / 3.0).to_bits());
    }
    seed
}

fn load(path: &Path) -> Result<u32, MapFileError> {
    load_map(path, &LoadOptions::default()).map(|loaded| whole(&loaded))
}

fn save(path: &Path, seed: u32, flags: &[&str]) {
    let status = Command::new(example())
        .arg("save")
        .arg(path)
        .arg(seed.to_string())
        .args(flags)
        .stdout(Stdio::null())
        .status();
    assert!(status.unwrap().success());
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort_unstable();
    names
}

/// Calls that a save makes, on any architecture; those that the machine has not are left out.
const CALLS: &str = "?open,openat,?creat,write,?pwrite64,fsync,fdatasync,?rename,renameat,renameat2,\
                     ?link,linkat,?unlink,unlinkat,?chmod,fchmod,?fchmodat,?stat,?lstat,?newfstatat,\
                     ?fstat,statx,flock,getdents64,close,lseek,?fallocate,?copy_file_range,?read";

fn strace() -> bool {
    let works = Command::new("strace")
        .args([
            "-f",
            "-o",
            "/dev/null",
            "-e",
            &format!("trace={CALLS}"),
            "true",
        ])
        .output()
        .is_ok_and(|output| output.status.success());
    if !works {
        eprintln!("skipped: strace cannot trace here");
    }
    works
}

/// A folder with the old map (seed 1), in which the new one (seed 2) is to be saved.
struct Scene {
    folder: tempfile::TempDir,
    path: PathBuf,
    flags: &'static [&'static str],
    old: Vec<(String, Vec<u8>)>,
}

impl Scene {
    fn new(flags: &'static [&'static str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.yaml");
        save(&path, 1, flags);
        let old = names_in(folder.path())
            .into_iter()
            .map(|name| {
                let bytes = fs::read(folder.path().join(&name)).unwrap();
                (name, bytes)
            })
            .collect();
        Self {
            folder,
            path,
            flags,
            old,
        }
    }

    fn reset(&self) {
        for name in names_in(self.folder.path()) {
            fs::remove_file(self.folder.path().join(name)).unwrap();
        }
        for (name, bytes) in &self.old {
            fs::write(self.folder.path().join(name), bytes).unwrap();
        }
    }

    /// Saves the new map under strace with further options; true if the save said that it did.
    fn traced(&self, options: &[&str], log: &Path) -> bool {
        let output = Command::new("strace")
            .args(["-f", "-o"])
            .arg(log)
            .args(options)
            .arg(example())
            .arg("save")
            .arg(&self.path)
            .arg("2")
            .args(self.flags)
            .output();
        output.unwrap().status.success()
    }

    /// Which calls of which name, counted from 1, fall into the save.
    fn calls(&self) -> BTreeMap<String, std::ops::RangeInclusive<usize>> {
        self.reset();
        let log = tempfile::NamedTempFile::new().unwrap();
        assert!(self.traced(&["-e", &format!("trace={CALLS}")], log.path()));
        let text = fs::read_to_string(log.path()).unwrap();
        let folder = self.folder.path().to_str().unwrap();
        let mut inside = false;
        let mut found: BTreeMap<String, (usize, Option<usize>)> = BTreeMap::new();
        for line in text.lines() {
            let Some((name, _)) = line.split_once('(') else {
                continue;
            };
            let name = name.rsplit(' ').next().unwrap().to_owned();
            inside |= line.contains(folder);
            let (count, first) = found.entry(name).or_default();
            *count += 1;
            if inside && first.is_none() {
                *first = Some(*count);
            }
        }
        found
            .into_iter()
            .filter_map(|(name, (count, first))| Some((name, first?..=count)))
            .collect()
    }

    /// After a fault: the old map or the new one, and the next save finds nothing in its way.
    fn check(&self, fault: &str, reported_done: bool) -> u32 {
        let is_plain = self.flags.contains(&"plain");
        let seed = match load(&self.path) {
            Ok(seed) => seed,
            // what plain names lose, and that it is noticed
            Err(MapFileError::Mismatch { .. }) if is_plain && !reported_done => 0,
            Err(e) => panic!("after {fault}: {e}"),
        };
        assert!(seed <= 2, "after {fault}: seed {seed}");
        assert!(
            !reported_done || seed == 2,
            "{fault}: saved, but seed {seed} is there"
        );
        save(&self.path, 3, self.flags);
        assert_eq!(load(&self.path).expect(fault), 3);
        let names = names_in(self.folder.path());
        assert_eq!(names.len(), self.old.len(), "after {fault}: {names:?}");
        seed
    }
}

fn every_call(flags: &'static [&'static str], faults: &[&str]) {
    let scene = Scene::new(flags);
    let log = tempfile::NamedTempFile::new().unwrap();
    let calls = scene.calls();
    let total: usize = calls.values().map(|range| range.clone().count()).sum();
    for name in ["write", "fsync", "close"] {
        assert!(calls.contains_key(name), "{calls:?}");
    }
    let mut seen = [0; 3];
    let mut turn = 0;
    for (name, range) in calls {
        for k in range {
            let chosen = if is_long() {
                faults.to_vec()
            } else {
                // one of the faults a call, in turn
                turn += 1;
                vec![faults[turn % faults.len()]]
            };
            for fault in chosen {
                scene.reset();
                let inject = format!("inject={name}:{fault}:when={k}");
                let trace = format!("trace={name}");
                let done = scene.traced(&["-e", &trace, "-e", &inject], log.path());
                seen[scene.check(&inject, done) as usize] += 1;
            }
        }
    }
    eprintln!("{flags:?}: {total} calls; refused, old, new: {seen:?}");
    assert!(seen[1] > 0 && seen[2] > 0, "both outcomes occur: {seen:?}");
}

#[test]
fn killed_at_any_call_a_save_leaves_a_whole_map() {
    if strace() {
        every_call(&[], &["signal=KILL"]);
    }
}

#[test]
fn failing_at_any_call_a_save_leaves_a_whole_map() {
    if strace() {
        every_call(&[], &["error=ENOSPC", "error=EIO", "error=EDQUOT"]);
    }
}

#[test]
fn with_plain_names_a_mixed_pair_is_noticed() {
    if strace() {
        let faults = ["signal=KILL", "error=ENOSPC", "error=EIO", "error=EDQUOT"];
        every_call(&["plain"], &faults);
    }
}

/// A small generator for waiting times, so that a run can be repeated.
fn mixed(seed: u32) -> u32 {
    let x = seed.wrapping_mul(0x9e37_79b9) ^ 0x85eb_ca6b;
    (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35) >> 8
}

#[test]
fn killed_at_random_a_save_leaves_a_whole_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.yaml");
    save(&path, 1, &[]);
    let mut newest = 1;
    // adapts to the machine, so that some rounds end before their first save and some after many
    let mut longest = Duration::from_millis(20);
    for round in 0..if is_long() { 1000 } else { 30 } {
        let mut child = Command::new(example())
            .args(["churn", path.to_str().unwrap(), &(newest + 1).to_string()])
            .spawn()
            .unwrap();
        std::thread::sleep(longest.mul_f64(f64::from(mixed(round) % 1000) / 1000.0));
        // a reader beside the writer sees whole maps, too
        let during = load(&path).unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
        let after = load(&path).unwrap();
        assert!(
            newest <= during && during <= after,
            "{newest} {during} {after}"
        );
        let step = if after == newest { 1.5 } else { 0.8 };
        longest = longest.mul_f64(step).min(Duration::from_secs(2));
        newest = after;
    }
    assert!(newest > 1, "no save got through");
    save(&path, newest, &[]);
    assert_eq!(names_in(folder.path()).len(), 4);
}

#[test]
fn saves_at_the_same_time_do_not_mix() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.yaml");
    save(&path, 1, &[]);
    let mut writers: Vec<_> = ["1000", "500000"]
        .map(|seed| {
            Command::new(example())
                .args(["churn", path.to_str().unwrap(), seed])
                .spawn()
                .unwrap()
        })
        .into();
    let mut seen = [false; 2];
    let start = std::time::Instant::now();
    let long = Duration::from_millis(if is_long() { 20_000 } else { 500 });
    while start.elapsed() < long || (seen != [true; 2] && start.elapsed() < 20 * long) {
        let seed = load(&path).unwrap();
        if seed > 1 {
            seen[usize::from(seed >= 500_000)] = true;
        }
    }
    for writer in &mut writers {
        assert!(writer.try_wait().unwrap().is_none(), "a writer gave up");
        writer.kill().unwrap();
        writer.wait().unwrap();
    }
    assert_eq!(seen, [true; 2]);
    load(&path).unwrap();
}
