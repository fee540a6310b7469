//! Saves a small map twice and reads it back; with arguments, one save or one load, which is how the
//! crash tests use it: `save_map save MAP.yaml SEED [plain|scale|raw]..`, `save_map load MAP.yaml`.

use std::process::ExitCode;

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
        _ => Err("usage: save_map [save MAP.yaml SEED [plain|scale|raw].. | load MAP.yaml]".into()),
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

fn load(path: &str) -> Result<(), String> {
    let loaded = load_map(path, &LoadOptions::default()).map_err(|e| e.to_string())?;
    let frame = loaded.map.frame();
    println!("{} x {} cells", frame.width(), frame.height());
    Ok(())
}
