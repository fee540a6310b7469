//! Logs that are run again, and those that are not.

use std::path::Path;

use mobot_cli::run_log::{LogReader, LogWriter, Recipe, RecipeError};

use super::{Memory, params, second};
use crate::run::mobot;

fn logged(recipe: &Recipe) -> Vec<u8> {
    let memory = Memory::default();
    let log = LogWriter::to(Box::new(memory.clone()), params()).expect("a log");
    recipe.write(&log);
    second(&log, 0);
    log.finish().expect("written");
    memory.bytes()
}

fn drive() -> Recipe {
    Recipe::of("drive")
        .with("--to", "1.5,2")
        .with("--radius", 0.1 + 0.2)
        .with_file("--map", "map.yaml", b"image: map.pgm\n".to_vec())
        .beside("map.pgm", vec![0, 255, 7])
}

#[test]
fn a_recipe_comes_back_with_its_files() {
    let bytes = logged(&drive());
    let read = Recipe::read(LogReader::new(&bytes[..]).unwrap()).unwrap();
    assert_eq!(read, drive());
    let folder = tempfile::tempdir().unwrap();
    let words = read.unpack(folder.path()).unwrap();
    let map = format!("--map={}", folder.path().join("map.yaml").display());
    let expected = ["--to=1.5,2", "--radius=0.30000000000000004", &map];
    assert_eq!(words, expected.map(std::ffi::OsString::from));
    let image = std::fs::read(folder.path().join("map.pgm")).unwrap();
    assert_eq!(image, [0, 255, 7]);
}

#[test]
fn files_stay_in_their_folder() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    for name in [
        "../out", "/tmp/out", "a/b", "..", ".", "", "a\0", "a b", ".hidden",
    ] {
        let recipe = Recipe::of("drive").with_file("--map", name, b"x".to_vec());
        let error = recipe.unpack(&inner).unwrap_err();
        assert!(matches!(error, RecipeError::File { .. }), "{name:?}");
    }
    let named =
        r#"{"command":"drive","options":[{"name":"--map","value":"/etc/passwd","file":true}]}"#;
    let recipe: Recipe = serde_json::from_str(named).unwrap();
    assert!(matches!(
        recipe.unpack(&inner),
        Err(RecipeError::File { .. })
    ));
    assert_eq!(std::fs::read_dir(&inner).unwrap().count(), 0);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn what_is_no_mission_s_log_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let elsewhere = folder.path().join("elsewhere.yaml");
    let harm = Recipe::of("map").with("-o", elsewhere.display());
    let writes = Recipe::of("drive").with("--out", folder.path().display());
    let reads = Recipe::of("drive").with("--map", "/etc/passwd");
    let cases = [
        (folder.path().join("none.mcap"), "No such file"),
        (file("text.mcap", b"hello, world"), "expected an MCAP file"),
        (
            file("empty.mcap", b""),
            "expected the log of a mission, found no command in it",
        ),
        (
            file("other.mcap", &logged(&Recipe::of("map"))),
            "expected a log of drive or explore",
        ),
        (
            file("harm.mcap", &logged(&harm)),
            "expected a log of drive or explore, found one of \"map\"",
        ),
        (
            file("writes.mcap", &logged(&writes)),
            "expected options of a mission, found \"--out\"",
        ),
        (
            file("reads.mcap", &logged(&reads)),
            "expected options of a mission, found \"--map\"",
        ),
    ];
    for (path, expected) in cases {
        let run = mobot([Path::new("replay"), &path]);
        assert_eq!(run.status, 2, "{}", run.stderr);
        assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
        let named = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(run.stderr.contains(&named), "{}", run.stderr);
        assert!(run.stderr.contains(expected), "{} {expected}", run.stderr);
    }
    assert!(!elsewhere.exists());
}
