//! Files made to hurt: every one is answered in a second, in bounded memory, with one clear line.

#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests, which fail by panicking"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use occgrid::{LoadOptions, MapFileError, PgmLimits, load_map, read_pgm};

use crate::save_faults::example;

const GOOD: &str = "image: map.pgm\nresolution: 0.05\norigin: [1.0, -2.0, 0.5]\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.196\nnegate: 0\n";
const PICTURE: &[u8] = b"P5 3 1 255\n\xfe\xcd\x00";

struct Case {
    folder: tempfile::TempDir,
    yaml: PathBuf,
}

impl Case {
    fn new(yaml: &[u8], picture: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("map.pgm"), picture).unwrap();
        let path = folder.path().join("map.yaml");
        fs::write(&path, yaml).unwrap();
        Self { folder, yaml: path }
    }

    fn picture(&self) -> PathBuf {
        self.folder.path().join("map.pgm")
    }

    /// The message of the refusal, after checking its form.
    fn refusal(&self, what: &str) -> String {
        let error = load_map(&self.yaml, &LoadOptions::default()).expect_err(what);
        let message = error.to_string();
        let is_line = !message.chars().any(char::is_control) && message.len() < 1000;
        assert!(is_line, "{what}: {message:?}");
        // one file of the map is named, with a place in it
        assert!(
            message.contains("map.yaml: ") || message.contains("map.pgm: "),
            "{what}: {message}"
        );
        message
    }

    /// Loads in a process of its own: (whether it succeeded, seconds, peak memory in MiB).
    fn measured(&self) -> (bool, f64, f64) {
        let mut best = f64::INFINITY;
        let mut answer = (false, 0.0);
        // the machine may be busy: the best of three is the program's own time
        for _ in 0..3 {
            let output = Command::new(example())
                .arg("load")
                .arg(&self.yaml)
                .output()
                .unwrap();
            let code = output.status.code();
            let text = String::from_utf8(output.stdout).unwrap();
            let numbers: Vec<f64> = text
                .lines()
                .next()
                .unwrap_or_else(|| panic!("died: {code:?}"))
                .split_whitespace()
                .filter_map(|word| word.parse().ok())
                .collect();
            assert!(matches!(code, Some(0 | 1)), "{code:?}");
            answer = (output.status.success(), numbers[1] / 1024.0);
            best = best.min(numbers[0] * 1e-6);
            if best < 0.5 {
                break;
            }
        }
        (answer.0, best, answer.1)
    }

    fn within_bounds(&self, what: &str, decoded_mib: f64) -> bool {
        let (loaded, seconds, mib) = self.measured();
        eprintln!("{what}: loaded {loaded}, {seconds:.3} s, {mib:.0} MiB of {decoded_mib:.0} + 64");
        assert!(seconds <= 1.0, "{what}: {seconds} s");
        assert!(mib <= decoded_mib + 64.0, "{what}: {mib} MiB");
        loaded
    }
}

#[test]
fn hostile_yaml_is_refused_with_its_place() {
    let deep = |open: &str, close: &str| {
        let depth = 30_000 / open.len();
        format!("{GOOD}x: {}{}\n", open.repeat(depth), close.repeat(depth))
    };
    let mut laughs = String::from("a0: &a0 [x, x]\n");
    for i in 1..40 {
        laughs += &format!("a{i}: &a{i} [*a{}, *a{}]\n", i - 1, i - 1);
    }
    let change = |from: &str, to: &str| {
        assert!(GOOD.contains(from));
        GOOD.replace(from, to)
    };
    let cases = [
        (String::new(), "map.yaml"),
        ("[1, 2]".into(), "map.yaml"),
        ("\t".into(), "map.yaml"),
        ("image: [".into(), "line 1"),
        (deep("[", "]"), "line 7"),
        (deep("{a: ", "}"), "line 7"),
        (deep("- ", ""), "line 7"),
        (format!("{laughs}{GOOD}"), "line 2"),
        (format!("{GOOD}x: &a 1\ny: *a\n"), "line 8"),
        (format!("{GOOD}x: [{}]\n", "1, ".repeat(500)), "line 7"),
        (format!("{GOOD}negate: 1\n"), "line 7"),
        (format!("{GOOD}resolution: 0.1\n"), "line 7"),
        (format!("{GOOD}# {}", "x".repeat(70_000)), "65536"),
        (change("0.05", "0"), "line 2"),
        (change("0.05", "-1"), "resolution"),
        (change("0.05", ".nan"), "resolution"),
        (change("0.05", ".inf"), "resolution"),
        (change("0.05", "100.5"), "resolution"),
        (change("0.05", "1e-9"), "resolution"),
        (change("0.05", "five"), "line 2"),
        (change("0.05", "1e999"), "line 2"),
        (change("0.5]", ".nan]"), "origin"),
        (change("0.5]", "-.inf]"), "origin"),
        (change(", 0.5]", "]"), "2 numbers"),
        (change("0.5]", "0.5, 0]"), "4 numbers"),
        (change("[1.0, -2.0, 0.5]", "x"), "line 3"),
        (change("0.65", "0.1"), "free_thresh"),
        (change("0.65", "0.196"), "free_thresh"),
        (change("0.65", "1.01"), "occupied_thresh"),
        (change("0.65", ".nan"), "occupied_thresh"),
        (change("0.196", "-0.1"), "free_thresh"),
        (change("negate: 0", "negate: maybe"), "line 6"),
        (change("negate: 0", "negate: [0]"), "line 6"),
        (change("negate: 0", "negate: 0\nmode: wild"), "line 7"),
        (change("map.pgm", "''"), "line 1"),
        (change("map.pgm", "\"a\\0b\""), "line 1"),
        (
            change("map.pgm", "\"gone\\e[31m\\n.pgm\""),
            "gone\\u{1b}[31m\\n.pgm",
        ),
        (change("map.pgm", "../map.pgm"), "map.pgm"),
        (change("map.pgm", "/etc/passwd"), "own folder"),
        (change("map.pgm", "."), "own folder|plain file"),
        (change("map.pgm", "map.yaml"), "PGM"),
        (format!("{GOOD}---\n{GOOD}"), "map.yaml"),
    ];
    for (yaml, place) in cases {
        let what: String = yaml.chars().take(300).collect();
        let case = Case::new(yaml.as_bytes(), PICTURE);
        // `refusal` wants one of the two names, a missing or foreign picture has another
        let error = load_map(&case.yaml, &LoadOptions::default()).expect_err(&what);
        let message = error.to_string();
        assert!(
            !message.chars().any(char::is_control) && message.len() < 1000,
            "{message:?}"
        );
        let names_place = place.split('|').any(|p| message.contains(p));
        assert!(names_place, "{what}: {message}");
    }
    let case = Case::new(b"image: \xff\xfe\n", PICTURE);
    assert!(case.refusal("not UTF-8").contains("byte 7"));
}

#[test]
fn hostile_yaml_costs_no_time_and_memory() {
    let deep = "[".repeat(60_000);
    for (what, tail) in [
        ("flow", deep.as_str()),
        ("block", &"- ".repeat(30_000)),
        ("key", &"? ".repeat(30_000)),
    ] {
        let case = Case::new(format!("{GOOD}x: {tail}").as_bytes(), PICTURE);
        assert!(!case.within_bounds(what, 0.0));
    }
    let file = Case::new(b"", PICTURE);
    fs::File::options()
        .write(true)
        .open(&file.yaml)
        .unwrap()
        .set_len(1 << 40)
        .unwrap();
    assert!(!file.within_bounds("a YAML of a terabyte", 0.0));
}

#[test]
fn hostile_pgm_is_refused_with_its_place() {
    let comment = format!("P5\n#{}\n3 1 255\n", "x".repeat(1 << 20));
    let spaces = format!("P5{}3 1 255\n", " ".repeat(1 << 20));
    let zeros = format!("P5 {}3 1 255\n", "0".repeat(1 << 20));
    let cases: Vec<(&[u8], &str)> = vec![
        (b"", "byte 0"),
        (b"P", "byte 0"),
        (b"P5", "byte 2"),
        (b"P6 3 1 255\nabcabcabc", "byte 0"),
        (b"GIF89a", "byte 0"),
        (b"P53 1 255\nabc", "byte 2"),
        (b"P5 1000000000 1000000000 255\n", "width"),
        (b"P5 4294967295 4294967295 255\n", "width"),
        (b"P5 99999999999999999999 1 255\n", "width"),
        (b"P5 1 18446744073709551617 255\n", "height"),
        (b"P5 20000 20000 255\n\x00", "pixels"),
        (b"P5 8192 8193 255\n\x00", "pixels"),
        (b"P5 8192 8192 255\n\x00", "samples"),
        (b"P2 8192 8192 255\n1", "samples"),
        (b"P5 32768 1 255\n\x00", "width"),
        (b"P5 0 0 255\n", "width"),
        (b"P5 3 0 255\n", "height"),
        (b"P5 -3 1 255\n", "byte 3"),
        (b"P5 3 1 0\nabc", "maximum"),
        (b"P5 3 1 65536\nabc", "maximum"),
        (b"P5 3 1 255", "byte 10"),
        (b"P5 3 1 255\nab", "samples"),
        (b"P5 3 1 256\nabcde", "samples"),
        (b"P5 3 1 100\nab\x65", "byte 13"),
        (b"P5 3 1 256\n\x00\x01\x01\x01\x00\x00", "byte 13"),
        (b"P2 3 1 255\n1 2 256", "byte"),
        (b"P2 3 1 255\n1 2 x", "byte 15"),
        (b"P2 3 1 255\n1 -2 3", "byte 13"),
        (b"P2 3 1 255\n1   2   ", "samples"),
        (b"P2 3 1 9 #\n12345", "byte"),
        (comment.as_bytes(), "comment"),
        (spaces.as_bytes(), "comment"),
        (zeros.as_bytes(), "comment"),
    ];
    for (picture, place) in cases {
        let start: Vec<u8> = picture.iter().copied().take(40).collect();
        let what = String::from_utf8_lossy(&start).into_owned();
        let message = Case::new(GOOD.as_bytes(), picture).refusal(&what);
        assert!(
            message.contains("map.pgm") && message.contains(place),
            "{what}: {message}"
        );
        // the reader alone, which knows no file length
        let alone = read_pgm(picture, &PgmLimits::default());
        assert!(alone.is_err(), "{what}");
    }
}

#[test]
fn limits_can_be_lifted_and_lowered() {
    let case = Case::new(GOOD.as_bytes(), PICTURE);
    let default = LoadOptions::default();
    load_map(&case.yaml, &default).unwrap();
    let lowered = [
        LoadOptions {
            max_cells: 2,
            ..default
        },
        LoadOptions {
            max_side_cells: 2,
            ..default
        },
        LoadOptions {
            max_image_bytes: 13,
            ..default
        },
        LoadOptions {
            max_yaml_bytes: 20,
            ..default
        },
        LoadOptions {
            max_yaml_depth: 1,
            ..default
        },
        LoadOptions {
            max_yaml_nodes: 4,
            ..default
        },
        LoadOptions {
            max_comment_bytes: 1,
            ..default
        },
    ];
    for options in lowered {
        assert!(load_map(&case.yaml, &options).is_err(), "{options:?}");
    }
    let comment = format!("P5 #{}\n3 1 255\nabc", "x".repeat(1 << 17));
    let yaml = format!(
        "{GOOD}x: {}1{}\n# {}",
        "[".repeat(20),
        "]".repeat(20),
        "y".repeat(1 << 17)
    );
    let case = Case::new(yaml.as_bytes(), comment.as_bytes());
    let lifted = LoadOptions {
        max_yaml_bytes: 1 << 20,
        max_yaml_depth: 64,
        max_comment_bytes: 1 << 20,
        ..default
    };
    load_map(&case.yaml, &lifted).unwrap();
}

#[test]
#[cfg(unix)]
fn only_plain_files_of_the_maps_own_folder_are_opened() {
    use std::os::unix::fs::symlink;
    let outside = tempfile::tempdir().unwrap();
    let secret = outside.path().join("secret.pgm");
    fs::write(&secret, PICTURE).unwrap();

    let case = Case::new(GOOD.as_bytes(), PICTURE);
    let named = |name: &str| {
        fs::write(&case.yaml, GOOD.replace("map.pgm", name)).unwrap();
        load_map(&case.yaml, &LoadOptions::default())
    };
    let folder = case.folder.path();
    symlink(&secret, folder.join("link.pgm")).unwrap();
    symlink(outside.path(), folder.join("away")).unwrap();
    symlink("map.pgm", folder.join("inside.pgm")).unwrap();
    symlink("loop.pgm", folder.join("loop.pgm")).unwrap();
    fs::create_dir(folder.join("sub")).unwrap();
    fs::write(folder.join("sub/map.pgm"), PICTURE).unwrap();
    let made = Command::new("mkfifo").arg(folder.join("pipe.pgm")).status();
    assert!(made.unwrap().success());

    for name in ["inside.pgm", "sub/map.pgm", "sub/../map.pgm", "./map.pgm"] {
        named(name).expect(name);
    }
    let absolute = folder.canonicalize().unwrap().join("map.pgm");
    named(absolute.to_str().unwrap()).unwrap();
    for name in [
        "link.pgm",
        "away/secret.pgm",
        "/dev/zero",
        secret.to_str().unwrap(),
    ] {
        let message = named(name).expect_err(name).to_string();
        assert!(message.contains("own folder"), "{message}");
    }
    for name in ["pipe.pgm", "sub", "loop.pgm", "gone.pgm"] {
        named(name).expect_err(name);
    }
    // with leave to look outside: still plain files only
    let options = LoadOptions {
        allow_outside: true,
        ..LoadOptions::default()
    };
    named("link.pgm").unwrap_err();
    load_map(&case.yaml, &options).unwrap();
    named("/dev/zero").unwrap_err();
    let message = load_map(&case.yaml, &options).unwrap_err().to_string();
    assert!(message.contains("plain file"), "{message}");
    // the YAML itself
    assert!(load_map(folder.join("pipe.pgm"), &options).is_err());
    assert!(load_map(folder, &options).is_err());
    assert!(load_map(folder.join("gone.yaml"), &options).is_err());
    // log-odds are no way out either
    named("map.pgm").unwrap();
    symlink(&secret, folder.join("map.npy")).unwrap();
    let message = named("map.pgm").unwrap_err().to_string();
    assert!(message.contains("own folder"), "{message}");
}

#[test]
fn large_pictures_cost_no_more_than_their_size() {
    let sparse = |header: &str, bytes: u64| {
        let case = Case::new(GOOD.as_bytes(), header.as_bytes());
        let file = fs::File::options()
            .write(true)
            .open(case.picture())
            .unwrap();
        file.set_len(header.len() as u64 + bytes).unwrap();
        case
    };
    let most = 1 << 26;
    assert!(sparse("P5 8192 8192 255\n", most).within_bounds("8 bits, full size", 64.0));
    assert!(sparse("P5 8192 8192 65535\n", 2 * most).within_bounds("16 bits, full size", 64.0));
    assert!(sparse("P5 32767 2048 7\n", most).within_bounds("few levels, full size", 64.0));
    assert!(!sparse("P5 8192 8192 255\n", 1 << 40).within_bounds("a terabyte", 0.0));
    assert!(!sparse("P2 8192 8192 255\n", 1 << 27).within_bounds("zero bytes as text", 64.0));
    let mut text = b"P2 4096 4096 255\n".to_vec();
    text.resize(text.len() + (1 << 25), b' ');
    for sample in text[17..].chunks_mut(2) {
        sample[0] = b'7';
    }
    assert!(Case::new(GOOD.as_bytes(), &text).within_bounds("text", 16.0));
    let mut comments = b"P2 1 1 255\n".to_vec();
    comments.resize(1 << 25, b'#');
    assert!(!Case::new(GOOD.as_bytes(), &comments).within_bounds("comments in the text", 0.0));
    // white space between samples has no bound of its own but the file's
    let mut blank = b"P2 1 2 255\n1".to_vec();
    blank.resize(1 << 25, b' ');
    assert!(!Case::new(GOOD.as_bytes(), &blank).within_bounds("white space", 0.0));
}

#[cfg(feature = "image")]
mod png {
    use super::*;
    use image::codecs::{bmp::BmpEncoder, png::PngEncoder};
    use image::{ExtendedColorType, ImageEncoder};

    fn png(width: u32, height: u32, color: ExtendedColorType) -> Vec<u8> {
        let bytes = (width * height) as usize * usize::from(color.bits_per_pixel()) / 8;
        let mut out = Vec::new();
        let encoder = PngEncoder::new(&mut out);
        encoder
            .write_image(&vec![0; bytes], width, height, color)
            .unwrap();
        out
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |c, _| {
                (c >> 1) ^ (0xedb8_8320 & (c & 1).wrapping_neg())
            })
        })
    }

    fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
        let body = [kind.as_slice(), data].concat();
        let length = (data.len() as u32).to_be_bytes();
        [length.as_slice(), &body, &crc32(&body).to_be_bytes()].concat()
    }

    /// The same picture that says another size.
    fn resized(png: &[u8], width: u32, height: u32) -> Vec<u8> {
        let mut header = png[16..29].to_vec();
        header[..4].copy_from_slice(&width.to_be_bytes());
        header[4..8].copy_from_slice(&height.to_be_bytes());
        [&png[..8], &chunk(b"IHDR", &header), &png[33..]].concat()
    }

    /// The same picture with a chunk after its header.
    fn with_chunk(png: &[u8], chunk: &[u8]) -> Vec<u8> {
        [&png[..33], chunk, &png[33..]].concat()
    }

    /// The compressed data of a picture of zeros.
    fn compressed_zeros() -> Vec<u8> {
        let png = png(8192, 8192, ExtendedColorType::L8);
        let mut data = Vec::new();
        let mut at = 33;
        while at < png.len() {
            let length = u32::from_be_bytes(png[at..at + 4].try_into().unwrap()) as usize;
            if &png[at + 4..at + 8] == b"IDAT" {
                data.extend(&png[at + 8..at + 8 + length]);
            }
            at += length + 12;
        }
        data
    }

    #[test]
    fn hostile_png_and_bmp_are_refused() {
        let small = png(3, 2, ExtendedColorType::Rgb8);
        let mut bmp = Vec::new();
        BmpEncoder::new(&mut bmp)
            .write_image(&[9; 18], 3, 2, ExtendedColorType::Rgb8)
            .unwrap();
        let bmp_sized = |width: i32, height: i32| {
            let mut bytes = bmp.clone();
            bytes[18..22].copy_from_slice(&width.to_le_bytes());
            bytes[22..26].copy_from_slice(&height.to_le_bytes());
            bytes
        };
        let mut damaged = small.clone();
        let middle = small.len() - 20;
        damaged[middle] ^= 0x55;
        let cases = [
            ("100000 a side", resized(&small, 100_000, 100_000)),
            ("16000 a side", resized(&small, 16_000, 16_000)),
            ("2^31 wide", resized(&small, 1 << 31, 1)),
            ("0 x 0", resized(&small, 0, 0)),
            ("0 high", resized(&small, 3, 0)),
            ("more rows than data", resized(&small, 8192, 8192)),
            ("cut", small[..small.len() - 25].to_vec()),
            ("header alone", small[..33].to_vec()),
            ("signature alone", small[..8].to_vec()),
            ("damaged", damaged),
            ("bmp cut", bmp[..bmp.len() - 8].to_vec()),
            ("bmp of any size", bmp_sized(i32::MAX, i32::MAX)),
            ("bmp of 0 x 0", bmp_sized(0, 0)),
            ("bmp of less than nothing", bmp_sized(-3, i32::MIN)),
            ("bmp of full size", bmp_sized(8192, 8192)),
            ("bmp header alone", bmp[..14].to_vec()),
        ];
        for (what, picture) in cases {
            let case = Case::new(GOOD.as_bytes(), &picture);
            let message = case.refusal(what);
            assert!(message.contains("map.pgm"), "{what}: {message}");
            assert!(!case.within_bounds(what, 0.0));
        }
    }

    #[test]
    fn bombs_cost_no_more_than_their_size() {
        let full = |color| Case::new(GOOD.as_bytes(), &png(8192, 8192, color));
        assert!(full(ExtendedColorType::L8).within_bounds("grey bomb", 64.0));
        assert!(full(ExtendedColorType::Rgba8).within_bounds("RGBA bomb", 256.0));
        assert!(!full(ExtendedColorType::Rgba16).within_bounds("16-bit RGBA bomb", 0.0));
        let zeros = compressed_zeros();
        let small = png(3, 2, ExtendedColorType::L8);
        let bomb = |kind, keyword: &[u8]| {
            let data = [keyword, &zeros].concat();
            let picture = with_chunk(&small, &chunk(kind, &data).repeat(4));
            Case::new(GOOD.as_bytes(), &picture)
        };
        bomb(b"zTXt", b"a\0\0").within_bounds("text bomb", 0.0);
        bomb(b"iTXt", b"a\0\x01\0\0\0").within_bounds("international text bomb", 0.0);
        bomb(b"iCCP", b"a\0\0").within_bounds("colour profile bomb", 0.0);
    }
}

/// Damage done to valid files: everything is answered without a panic, and in time.
#[test]
fn damaged_files_are_answered() {
    let maps = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/maps");
    let mut seeds: Vec<(Vec<u8>, Vec<u8>)> = vec![(GOOD.into(), PICTURE.into())];
    for (yaml, picture) in [
        ("synthetic/plain.yaml", "synthetic/plain.pgm"),
        ("synthetic/plain_wide.yaml", "synthetic/plain_wide.pgm"),
        ("synthetic/wide_negate.yaml", "synthetic/wide.pgm"),
        ("synthetic/grey16.yaml", "synthetic/grey16.png"),
        ("synthetic/indexed.yaml", "synthetic/indexed.png"),
        ("synthetic/bits.yaml", "synthetic/bits.png"),
        ("synthetic/la.yaml", "synthetic/la.png"),
        ("synthetic/colour_bmp.yaml", "synthetic/colour.bmp"),
        ("nav2/TenByTen/TenByTen.yaml", "nav2/TenByTen/TenByTen.pgm"),
    ] {
        let read = |name| fs::read(Path::new(maps).join(name)).unwrap();
        let name = picture.rsplit('/').next().unwrap();
        let text = String::from_utf8(read(yaml))
            .unwrap()
            .replace(name, "map.pgm");
        seeds.push((text.into_bytes(), read(picture)));
    }
    let mut random = Random(0x5eed);
    let rounds = if std::env::var_os("MOBOT_LONG").is_some() {
        200_000
    } else {
        6_000
    };
    let case = Case::new(b"", b"");
    let mut loaded = 0;
    let mut slowest = 0.0_f64;
    for round in 0..rounds {
        let (yaml, picture) = &seeds[round % seeds.len()];
        let (mut yaml, mut picture) = (yaml.clone(), picture.clone());
        if random.below(2) == 0 {
            random.damage(&mut yaml);
        } else {
            random.damage(&mut picture);
        }
        fs::write(&case.yaml, &yaml).unwrap();
        fs::write(case.picture(), &picture).unwrap();
        let start = std::time::Instant::now();
        match load_map(&case.yaml, &LoadOptions::default()) {
            Ok(_) => loaded += 1,
            Err(error) => {
                let message = error.to_string();
                assert!(!message.chars().any(char::is_control), "{message:?}");
                assert!(message.len() < 1500, "{message}");
                assert!(!matches!(error, MapFileError::Mismatch { .. }));
            }
        }
        slowest = slowest.max(start.elapsed().as_secs_f64());
    }
    eprintln!("{rounds} damaged maps: {loaded} loaded, slowest {slowest:.3} s");
    assert!(loaded > rounds / 20 && loaded < rounds, "{loaded}");
    assert!(slowest < 2.0, "{slowest} s");
}

/// A small generator, so that a run can be repeated.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % limit.max(1)
    }

    fn damage(&mut self, bytes: &mut Vec<u8>) {
        for _ in 0..=self.below(4) {
            let reach = if self.below(2) == 0 { 64 } else { 1 << 20 };
            let at = self.below(bytes.len().min(reach));
            match self.below(7) {
                0 => bytes.truncate(at),
                1 => bytes.insert(at, self.below(256) as u8),
                2 if !bytes.is_empty() => {
                    bytes.remove(at);
                }
                3 if !bytes.is_empty() => bytes[at] ^= 1 << self.below(8),
                4 if !bytes.is_empty() => bytes[at] = b"0 9-.[{:#\n\xff"[self.below(11)],
                5 => {
                    let piece: Vec<u8> = bytes
                        .iter()
                        .skip(at)
                        .take(self.below(20))
                        .copied()
                        .collect();
                    let to = self.below(bytes.len());
                    bytes.splice(to..to, piece);
                }
                6 => {
                    let number = [
                        "0",
                        "65535",
                        "65536",
                        "4294967296",
                        "1e308",
                        "-1",
                        "&a",
                        "*a",
                    ];
                    let text = number[self.below(number.len())];
                    bytes.splice(at..at, text.bytes());
                }
                _ => {}
            }
        }
    }
}
