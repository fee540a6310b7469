//! Maps read as Nav2 reads them, and written so that Nav2 reads back the same.

#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests, which fail by panicking"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use occgrid::{
    Cell, CellState, LoadOptions, LoadedMap, MapFileError, MapFrame, MapMode, OccupancyMap,
    PgmEncoding, PgmImage, PgmLimits, Pose2, SaveOptions, ThresholdRule, load_map, read_pgm,
    save_map,
};
use proptest::collection::vec;
use proptest::prelude::*;
use sha2::{Digest, Sha256};

const TESTDATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata");

fn sha256(values: &[i8]) -> String {
    let bytes: Vec<u8> = values.iter().map(|&v| v as u8).collect();
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The text of a map's YAML with another mode and the picture named from anywhere.
fn in_mode(yaml: &Path, mode: &str) -> String {
    let folder = yaml.parent().unwrap().canonicalize().unwrap();
    let text = fs::read_to_string(yaml).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with("mode:"));
    let lines = lines.map(|line| match line.strip_prefix("image:") {
        Some(name) => format!(
            "image: {}/{}",
            folder.display(),
            name.trim().trim_matches('"')
        ),
        None => line.to_owned(),
    });
    let mut lines: Vec<String> = lines.collect();
    lines.push(format!("mode: {mode}\n"));
    lines.join("\n")
}

/// `golden/nav2_maps.txt` was made by `golden/nav2_reader.py` (Pillow, PyYAML, numpy), whose grids
/// are equal to those of Nav2's own `loadMapFromFile` built with GraphicsMagick 1.3.40 and Eigen 3.4.
#[test]
fn every_map_in_every_mode_and_rule_equals_the_foreign_reader() {
    let golden = fs::read_to_string(format!("{TESTDATA}/golden/nav2_maps.txt")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.yaml");
    let mut compared = 0;
    for line in golden.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        let &[
            name,
            mode,
            rule,
            width,
            height,
            unknown,
            free,
            between,
            occupied,
            cells,
            sum,
        ] = words.as_slice()
        else {
            panic!("eleven words: {line}");
        };
        fs::write(
            &path,
            in_mode(&Path::new(TESTDATA).join("maps").join(name), mode),
        )
        .unwrap();
        let options = LoadOptions {
            allow_outside: true,
            threshold_rule: match rule {
                "nav2" => ThresholdRule::Nav2,
                _ => ThresholdRule::Ros1,
            },
            ..LoadOptions::default()
        };
        let map = load_map(&path, &options).unwrap().map;
        let values = map.values();
        let count = |wanted: fn(i8) -> bool| values.iter().filter(|&&v| wanted(v)).count();
        let found = [
            map.frame().width() as usize,
            map.frame().height() as usize,
            count(|v| v == -1),
            count(|v| v == 0),
            count(|v| 0 < v && v < 100),
            count(|v| v == 100),
        ];
        let expected = [width, height, unknown, free, between, occupied];
        assert_eq!(found.map(|n| n.to_string()), expected, "{line}");
        for cell in cells.split(';') {
            let [row, col, value]: [i32; 3] = cell
                .split(':')
                .map(|n| n.parse().unwrap())
                .collect::<Vec<_>>()
                .try_into()
                .unwrap();
            let index = map.frame().index(Cell::new(col as u32, row as u32));
            assert_eq!(i32::from(values[index]), value, "{line}");
        }
        assert_eq!(sha256(values), sum, "{line}");
        compared += 1;
    }
    assert!(compared >= 180, "{compared}");
}

#[test]
fn frame_and_classes_are_those_of_the_yaml() {
    let loaded = load_map(
        format!("{TESTDATA}/maps/nav2/testmap/testmap.yaml"),
        &LoadOptions::default(),
    )
    .unwrap();
    let expected = MapFrame::new(10, 10, 0.1, Pose2::new(2.0, 3.0, 1.0)).unwrap();
    assert_eq!(loaded.map.frame(), &expected);
    assert_eq!((loaded.mode, loaded.log_odds), (MapMode::Trinary, None));

    let speed = load_map(
        format!("{TESTDATA}/maps/nav2/depot_speed.yaml"),
        &LoadOptions::default(),
    )
    .unwrap()
    .map;
    // a speed mask between free and occupied is no place to plan through
    let states = [-1, 0, 1, 99, 100].map(|v| speed.classify(v));
    use CellState::{Free, Occupied, Unknown};
    assert_eq!(states, [Unknown, Free, Unknown, Unknown, Occupied]);
}

const GOOD: &str = "image: map.pgm\nresolution: 0.05\norigin: [1.0, -2.0, 0.5]\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.196\nnegate: 0\n";

fn with_picture(yaml: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("map.pgm"), b"P5 3 1 255\n\xfe\xcd\x00").unwrap();
    let path = folder.path().join("map.yaml");
    fs::write(&path, yaml).unwrap();
    (folder, path)
}

fn load_text(yaml: &str) -> Result<LoadedMap, MapFileError> {
    let (_folder, path) = with_picture(yaml);
    load_map(path, &LoadOptions::default())
}

#[test]
fn yaml_as_people_and_tools_write_it() {
    let plain = load_text(GOOD).unwrap().map;
    assert_eq!(plain.values(), [0, -1, 100]);
    let same = [
        format!("\u{feff}{GOOD}"),
        format!("---\n# CREATOR: slam 0.05 m/pix\n{GOOD}\nextra: {{a: [1, 2]}}\n"),
        GOOD.replace('\n', "\r\n"),
        GOOD.replace("0.05", "'0.050'")
            .replace("map.pgm", "\"map.pgm\""),
        GOOD.replace("negate: 0", "negate: false"),
        GOOD.replace("negate: 0", "negate: no"),
        GOOD.replace("[1.0, -2.0, 0.5]", "\n- 1\n- -2.\n- 5.0e-1"),
        format!("{GOOD}mode: Trinary\n"),
        "{image: map.pgm, resolution: 0.05, origin: [1, -2, .5], occupied_thresh: 0.65, \
         free_thresh: 0.196, negate: off}"
            .to_owned(),
    ];
    for yaml in same {
        assert_eq!(load_text(&yaml).expect(&yaml).map, plain, "{yaml}");
    }
    for yes in ["1", "true", "yes", "-1", "\"1\""] {
        let yaml = GOOD.replace("negate: 0", &format!("negate: {yes}"));
        // 0xcd is p = 0.8 then
        assert_eq!(
            load_text(&yaml).unwrap().map.values(),
            [100, 100, 0],
            "{yes}"
        );
    }
}

#[test]
fn what_nav2_requires_is_required() {
    for key in [
        "image",
        "resolution",
        "origin",
        "occupied_thresh",
        "free_thresh",
        "negate",
    ] {
        let lines = GOOD.lines().filter(|line| !line.starts_with(key));
        let yaml: Vec<&str> = lines.collect();
        let error = load_text(&yaml.join("\n")).unwrap_err().to_string();
        assert!(error.contains(key) && error.contains("map.yaml"), "{error}");
    }
}

fn any_frame(width: u32, height: u32) -> impl Strategy<Value = MapFrame> {
    let coordinate = prop_oneof![any::<f64>(), -1e3..1e3, Just(-0.0), Just(0.1 + 0.2)];
    let origin = vec(coordinate.prop_filter("finite", |v| v.is_finite()), 3);
    (1e-6_f64..=100.0, origin).prop_map(move |(resolution, o)| {
        MapFrame::new(width, height, resolution, Pose2::new(o[0], o[1], o[2])).unwrap()
    })
}

fn side() -> impl Strategy<Value = u32> {
    prop_oneof![1_u32..9, Just(63), Just(64), Just(65), Just(127), Just(129)]
}

fn any_map(value: impl Strategy<Value = i8> + Clone) -> impl Strategy<Value = OccupancyMap> {
    (side(), side(), -1_i8..=99, 1_i8..=101).prop_flat_map(move |(width, height, free, above)| {
        let cells = (width * height) as usize;
        let values = vec(value.clone(), cells);
        (any_frame(width, height), values).prop_map(move |(frame, values)| {
            let occupied = free.saturating_add(above).min(101);
            OccupancyMap::new(frame, values, free, occupied)
        })
    })
}

fn finite_log_odds() -> impl Strategy<Value = f32> {
    any::<u32>()
        .prop_map(f32::from_bits)
        .prop_filter("finite", |v| v.is_finite())
}

fn same_frame(a: &MapFrame, b: &MapFrame) -> bool {
    let bits = |f: &MapFrame| {
        let o = f.origin();
        [f.resolution(), o.x, o.y, o.theta].map(f64::to_bits)
    };
    bits(a) == bits(b) && (a.width(), a.height()) == (b.width(), b.height())
}

fn round_trip(
    map: &OccupancyMap,
    log_odds: &[f32],
    mode: MapMode,
) -> Result<LoadedMap, TestCaseError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("some map.yaml");
    let plain_names = map.values()[0] == 0;
    let options = SaveOptions { mode, plain_names };
    let saved = save_map(&path, map, Some(log_odds), &options).unwrap();
    prop_assert_eq!(&saved.notes, &Vec::<String>::new());
    let again = load_map(&path, &LoadOptions::default()).unwrap();
    prop_assert!(same_frame(again.map.frame(), map.frame()));
    prop_assert_eq!(again.mode, mode);
    let bits = |v: &[f32]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    prop_assert_eq!(bits(again.log_odds.as_deref().unwrap()), bits(log_odds));
    Ok(again)
}

fn cases(default: u32) -> ProptestConfig {
    let long = std::env::var_os("MOBOT_LONG").is_some();
    ProptestConfig {
        cases: if long { default * 20 } else { default },
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

fn with_log_odds(
    map: impl Strategy<Value = OccupancyMap>,
) -> impl Strategy<Value = (OccupancyMap, Vec<f32>)> {
    map.prop_flat_map(|map| {
        let cells = map.values().len();
        (Just(map), vec(finite_log_odds(), cells))
    })
}

proptest! {
    #![proptest_config(cases(40))]

    #[test]
    fn trinary_keeps_three_values(
        (map, log_odds) in with_log_odds(any_map(prop::sample::select(vec![-1_i8, 0, 100])))
    ) {
        // class limits under which the three values are what they say
        let map = OccupancyMap::new(*map.frame(), map.values().to_vec(), 0, 100);
        let again = round_trip(&map, &log_odds, MapMode::Trinary)?;
        prop_assert_eq!(again.map, map);
    }

    #[test]
    fn scale_keeps_every_value((map, log_odds) in with_log_odds(any_map(-1_i8..=100))) {
        let again = round_trip(&map, &log_odds, MapMode::Scale)?;
        prop_assert_eq!(again.map.values(), map.values());
    }

    #[test]
    fn raw_keeps_every_value_and_the_classes(
        (map, log_odds) in with_log_odds(any_map(-1_i8..=100))
    ) {
        let again = round_trip(&map, &log_odds, MapMode::Raw)?;
        prop_assert_eq!(again.map.values(), map.values());
        if map.free_at_most() >= 0 && map.occupied_at_least() <= 100 {
            prop_assert_eq!(again.map, map);
        }
    }

    #[test]
    fn trinary_saves_the_class_of_any_value(map in any_map(any::<i8>())) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.yaml");
        save_map(&path, &map, None, &SaveOptions::default()).unwrap();
        let again = load_map(&path, &LoadOptions::default()).unwrap();
        prop_assert_eq!(again.log_odds, None);
        for (&before, &after) in map.values().iter().zip(again.map.values()) {
            let expected = match map.classify(before) {
                _ if !(0..=100).contains(&before) => -1,
                CellState::Free => 0,
                CellState::Occupied => 100,
                CellState::Unknown => -1,
            };
            prop_assert_eq!(after, expected);
        }
    }

    #[test]
    fn pgm_keeps_samples_in_every_encoding(
        (width, height) in (side(), side()),
        max_value in prop_oneof![1_u16..=300, Just(65_535), any::<u16>().prop_map(|v| v.max(1))],
        seed in any::<u32>(),
    ) {
        let samples: Vec<u16> = (0..width * height)
            .map(|i| {
                let mixed = i.wrapping_add(seed).wrapping_mul(2_654_435_761) >> 7;
                (u64::from(mixed) % (u64::from(max_value) + 1)) as u16
            })
            .collect();
        let image = PgmImage { width, height, max_value, samples };
        for encoding in [PgmEncoding::Ascii, PgmEncoding::Binary] {
            let mut bytes = Vec::new();
            image.write(encoding, &mut bytes).unwrap();
            // a reader of tiny pieces meets every boundary
            let reader = std::io::BufReader::with_capacity(7, bytes.as_slice());
            prop_assert_eq!(&read_pgm(reader, &PgmLimits::default()).unwrap(), &image);
        }
    }
}

fn small_map() -> (OccupancyMap, Vec<f32>) {
    let frame = MapFrame::new(4, 2, 0.0025, Pose2::new(-1.23456, 0.1 + 0.2, -0.7)).unwrap();
    let values = vec![-1, 0, 100, 7, 50, 99, 1, 0];
    let log_odds = vec![0.0, -2.5, 1e-30, 3.5, -0.0, 88.0, -1e-3, 0.125];
    (OccupancyMap::new(frame, values, 0, 100), log_odds)
}

/// Python with numpy, Pillow and PyYAML, from `MOBOT_PYTHON` or the path; `None` where there is none.
fn python() -> Option<String> {
    let name = std::env::var("MOBOT_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let check = Command::new(&name)
        .args(["-c", "import numpy, PIL, yaml"])
        .output();
    if check.is_ok_and(|output| output.status.success()) {
        return Some(name);
    }
    eprintln!("skipped: {name} has no numpy, PIL and yaml (set MOBOT_PYTHON)");
    None
}

#[test]
fn the_foreign_reader_reads_what_we_write() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.yaml");
    let (map, log_odds) = small_map();
    for mode in [MapMode::Trinary, MapMode::Scale, MapMode::Raw] {
        let options = SaveOptions {
            mode,
            ..SaveOptions::default()
        };
        save_map(&path, &map, Some(&log_odds), &options).unwrap();
        let script = format!(
            "import sys; sys.path.insert(0, '{TESTDATA}/golden'); sys.dont_write_bytecode = True\n\
             import nav2_reader, numpy, yaml, pathlib\n\
             path = pathlib.Path(sys.argv[1]); keys = yaml.safe_load(path.read_text())\n\
             array = numpy.load(path.with_suffix('.npy'))\n\
             print(nav2_reader.read(path).ravel().tolist())\n\
             print(array.shape, array.dtype, array.ravel().tolist())\n\
             print(keys['mode'], float(keys['resolution']), [float(v) for v in keys['origin']])\n"
        );
        let output = Command::new(&python)
            .args(["-c", &script])
            .arg(&path)
            .output()
            .unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{errors}");
        let values: Vec<i8> = match mode {
            MapMode::Trinary => vec![-1, 0, 100, -1, -1, -1, -1, 0],
            _ => map.values().to_vec(),
        };
        // 1e-30 and -0.001 as float32, printed by Python as doubles
        let doubles: Vec<f64> = log_odds.iter().map(|&v| f64::from(v)).collect();
        let expected = format!(
            "{values:?}\n(2, 4) float32 {doubles:?}\n{} 0.0025 [-1.23456, 0.30000000000000004, -0.7]\n",
            mode.name()
        );
        assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
    }
}

#[test]
fn numbers_are_written_shortest() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.yaml");
    save_map(&path, &small_map().0, None, &SaveOptions::default()).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    let start = "image: map.000001.pgm\nmode: trinary\nresolution: 0.0025\n\
                 origin: [-1.23456, 0.30000000000000004, -0.7]\nnegate: 0\n\
                 occupied_thresh: 0.65\nfree_thresh: 0.196\n# sha256: ";
    assert!(text.starts_with(start), "{text}");
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort_unstable();
    names
}

#[test]
fn each_save_removes_the_generations_before_it_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.yaml");
    let (map, log_odds) = small_map();
    let others = [
        "map.pgm",
        "map.0001.pgm",
        "map.000001.txt",
        "map.a00001.pgm",
        "map2.000001.pgm",
        ".map.yaml.bak",
        "map.000001.pgm.bak",
    ];
    for name in others {
        fs::write(folder.path().join(name), "mine").unwrap();
    }
    // what interrupted saves leave
    for name in [
        "map.000007.png",
        ".map.yaml.aB3dE9",
        ".map.000004.pgm.aB3dE9",
        ".map.npy.linked",
    ] {
        fs::write(folder.path().join(name), "left over").unwrap();
    }
    for generation in 8..=10 {
        save_map(&path, &map, Some(&log_odds), &SaveOptions::default()).unwrap();
        let mut expected: Vec<String> = others.map(str::to_owned).to_vec();
        expected.push("map.yaml".into());
        expected.push("map.npy".into());
        expected.push(format!("map.{generation:06}.pgm"));
        expected.push(format!("map.{generation:06}.npy"));
        expected.sort_unstable();
        assert_eq!(names_in(folder.path()), expected);
    }
    // without log-odds the old ones must not stay beside the map
    save_map(&path, &map, None, &SaveOptions::default()).unwrap();
    assert!(!folder.path().join("map.npy").exists());
    assert_eq!(
        load_map(&path, &LoadOptions::default()).unwrap().log_odds,
        None
    );
    // plain names take over from generations
    let options = SaveOptions {
        plain_names: true,
        ..SaveOptions::default()
    };
    let saved = save_map(&path, &map, Some(&log_odds), &options).unwrap();
    assert_eq!(saved.image, folder.path().join("map.pgm"));
    assert_eq!(saved.log_odds, Some(folder.path().join("map.npy")));
    assert!(!folder.path().join("map.000011.pgm").exists());
    load_map(&path, &LoadOptions::default()).unwrap();
}

#[test]
fn files_that_were_saved_together_must_still_belong_together() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.yaml");
    let (map, log_odds) = small_map();
    let saved = save_map(&path, &map, Some(&log_odds), &SaveOptions::default()).unwrap();
    let load = || load_map(&path, &LoadOptions::default());

    // log-odds under their published name alone do
    let generation = saved.log_odds.unwrap();
    fs::remove_file(&generation).unwrap();
    assert_eq!(load().unwrap().log_odds, Some(log_odds.clone()));
    // none at all: the map is whole without
    let published = folder.path().join("map.npy");
    let bytes = fs::read(&published).unwrap();
    fs::remove_file(&published).unwrap();
    assert_eq!(load().unwrap().log_odds, None);
    // others do not
    let mut changed = bytes.clone();
    *changed.last_mut().unwrap() ^= 1;
    fs::write(&published, changed).unwrap();
    assert!(matches!(load().unwrap_err(), MapFileError::Mismatch { .. }));
    // unless nobody asked
    let blind = LoadOptions {
        log_odds: false,
        ..LoadOptions::default()
    };
    assert_eq!(load_map(&path, &blind).unwrap().log_odds, None);
    // a damaged generation is healed by the published copy
    fs::write(&published, &bytes).unwrap();
    fs::write(&generation, &bytes[..bytes.len() - 1]).unwrap();
    assert_eq!(load().unwrap().log_odds, Some(log_odds));

    let mut picture = fs::read(&saved.image).unwrap();
    *picture.last_mut().unwrap() ^= 1;
    fs::write(&saved.image, picture).unwrap();
    let error = load().unwrap_err();
    assert_eq!(error.file(), saved.image.canonicalize().unwrap());
    assert!(error.to_string().contains("sha256"), "{error}");
    // edited on purpose: without the comments the pair is taken as it is
    let text = fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = text.lines().filter(|l| !l.starts_with('#')).collect();
    fs::write(&path, lines.join("\n")).unwrap();
    load().unwrap();
}

#[test]
fn a_foreign_map_takes_log_odds_of_its_shape_and_no_other() {
    let (folder, path) = with_picture(GOOD);
    let npy = folder.path().join("map.npy");
    let array = |shape: &str, values: &[f32]| {
        let dict = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((dict.len() as u16).to_le_bytes());
        bytes.extend(dict.bytes());
        bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        bytes
    };
    let load = || load_map(&path, &LoadOptions::default());
    fs::write(&npy, array("(1, 3)", &[1.0, -0.0, 2.5])).unwrap();
    assert_eq!(load().unwrap().log_odds.unwrap(), [1.0, -0.0, 2.5]);
    let wrong = [
        array("(3, 1)", &[0.0; 3]),
        array("(1, 3)", &[0.0; 2]),
        array("(1, 3)", &[0.0; 4]),
        array("(1, 3)", &[0.0, f32::NAN, 0.0]),
        array("(1, 3)", &[0.0, f32::INFINITY, 0.0]),
        b"\x93NUMPY\x01\x00\xff\xff".to_vec(),
        b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec(),
        b"no".to_vec(),
        Vec::new(),
    ];
    for bytes in wrong {
        fs::write(&npy, bytes).unwrap();
        assert_eq!(load().unwrap_err().file(), npy.canonicalize().unwrap());
    }
}

#[test]
fn names_that_would_clash_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (map, _) = small_map();
    for name in [
        "map.npy",
        "map.pgm",
        "map.000001.yaml",
        ".yaml",
        "a\nb.yaml",
    ] {
        let path = folder.path().join(name);
        assert!(
            save_map(path, &map, None, &SaveOptions::default()).is_err(),
            "{name}"
        );
    }
    assert_eq!(names_in(folder.path()), Vec::<String>::new());
    for name in [
        "map.yml",
        "map",
        "Stockwerk Ä: 1.yaml",
        "true.yaml",
        "a\"b\\c.yaml",
    ] {
        let path = folder.path().join(name);
        save_map(&path, &map, None, &SaveOptions::default()).expect(name);
        load_map(&path, &LoadOptions::default()).expect(name);
    }
    let mut log_odds = vec![0.0; 8];
    log_odds[5] = f32::NAN;
    let path = folder.path().join("nan.yaml");
    let error = save_map(&path, &map, Some(&log_odds), &SaveOptions::default()).unwrap_err();
    assert!(error.to_string().contains("row 1, column 1"), "{error}");
}
