//! Saves a small map twice and reads it back; with arguments, one save or one load, which is how the
//! crash tests use it: `save_map save MAP.yaml SEED [plain|scale|raw]..`, `save_map load MAP.yaml`,
//! `save_map churn MAP.yaml SEED` (save after save, until killed).
#![expect(clippy::print_stdout, reason = "an example speaks to the terminal")]

use std::process::ExitCode;
use std::time::{Duration, Instant};

use occgrid::{
    LoadOptions, MapFrame, MapMode, OccupancyMap, Pose2, SaveOptions, load_map, save_map,
};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match words.as_slice() {
        [] => demonstrate(),
        ["save", path, seed, flags @ ..] => save(path, seed, flags),
        ["load", path] => load(path),
        ["churn", path, seed] => churn(path, seed),
        _ => Err(
            "usage: save_map [save MAP.yaml SEED [FLAG].. | load MAP.yaml | churn MAP.yaml SEED]"
                .into(),
        ),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn demonstrate() -> Result<(), String> {
    let folder = std::env::temp_dir().join(format!("occgrid-save-map-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    let yaml = folder.join("map.yaml");
    let yaml = yaml
        .to_str()
        .ok_or("a temporary folder with a UTF-8 name")?;
    let outcome = ["1", "2"].iter().try_for_each(|seed| save(yaml, seed, &[]));
    let outcome = outcome.and_then(|()| load(yaml));
    std::fs::remove_dir_all(&folder).map_err(|e| e.to_string())?;
    outcome
}

/// A map and log-odds that differ in every cell from those of another seed.
fn made_from(seed: u32) -> Result<(OccupancyMap, Vec<f32>), String> {
    let (width, height) = (40 + seed % 7, 30);
    let origin = Pose2::new(-1.5, f64::from(seed) / 7.0, 0.25);
    let frame = MapFrame::new(width, height, 0.05, origin).map_err(|e| e.to_string())?;
    let cells = 0..width * height;
    let values = cells
        .clone()
        .map(|i| [-1, 0, 100][((i + seed) % 3) as usize]);
    let log_odds = cells.map(|i| (i + seed) as f32 / 3.0).collect();
    Ok((OccupancyMap::new(frame, values.collect(), 0, 100), log_odds))
}

fn save(path: &str, seed: &str, flags: &[&str]) -> Result<(), String> {
    let seed = seed.parse().map_err(|_| "SEED is a whole number")?;
    let (map, log_odds) = made_from(seed)?;
    let mode = match flags {
        f if f.contains(&"scale") => MapMode::Scale,
        f if f.contains(&"raw") => MapMode::Raw,
        _ => MapMode::Trinary,
    };
    let options = SaveOptions {
        mode,
        plain_names: flags.contains(&"plain"),
    };
    let saved = save_map(path, &map, Some(&log_odds), &options).map_err(|e| e.to_string())?;
    for note in &saved.notes {
        eprintln!("{note}");
    }
    println!("{}", saved.image.display());
    Ok(())
}

fn churn(path: &str, seed: &str) -> Result<(), String> {
    let first: u32 = seed.parse().map_err(|_| "SEED is a whole number")?;
    for seed in first.. {
        let (map, log_odds) = made_from(seed)?;
        save_map(path, &map, Some(&log_odds), &SaveOptions::default())
            .map_err(|e| e.to_string())?;
    }
    Ok(())
}

fn load(path: &str) -> Result<(), String> {
    let before = (cpu_time(), Instant::now());
    let loaded = load_map(path, &LoadOptions::default());
    let elapsed = match (before.0, cpu_time()) {
        (Some(start), Some(end)) => end - start,
        _ => before.1.elapsed(),
    };
    // the tests hold time and peak memory to the documented bounds
    println!(
        "{} us, peak {} kB",
        elapsed.as_micros(),
        peak_kib().unwrap_or(0)
    );
    let frame = *loaded.map_err(|e| e.to_string())?.map.frame();
    println!("{} x {} cells", frame.width(), frame.height());
    Ok(())
}

/// How long this process has been running on a processor, on Linux: other programs do not count.
fn cpu_time() -> Option<Duration> {
    let times = std::fs::read_to_string("/proc/self/schedstat").ok()?;
    let nanoseconds = times.split_whitespace().next()?.parse().ok()?;
    Some(Duration::from_nanos(nanoseconds))
}

/// The most memory that this process has held [KiB], on Linux.
fn peak_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}
