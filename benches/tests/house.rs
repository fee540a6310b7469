//! The rules of the house that no compiler checks: who may import whom, where test data comes from, what
//! a stock toolchain must be able to build.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use sha2::{Digest as _, Sha256};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn cargo(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO"))
        .args(arguments)
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Our crates that a crate of ours depends on in its normal tree, with every feature on.
fn siblings(package: &str) -> BTreeSet<String> {
    const OURS: [&str; 7] = [
        "occgrid",
        "mobot-morpho",
        "voronoi-plan",
        "linefeat",
        "monocal",
        "mobot-hw",
        "mobot-cli",
    ];
    cargo(&[
        "tree",
        "-e",
        "normal",
        "--prefix",
        "none",
        "--all-features",
        "-p",
        package,
    ])
    .lines()
    .filter_map(|line| line.split(' ').next())
    .filter(|name| OURS.contains(name) && *name != package)
    .map(str::to_owned)
    .collect()
}

#[test]
fn dependencies_point_one_way() {
    let allowed: [(&str, &[&str]); 6] = [
        ("occgrid", &[]),
        ("mobot-morpho", &[]),
        ("linefeat", &[]),
        ("voronoi-plan", &["mobot-morpho", "occgrid"]),
        ("monocal", &["occgrid"]),
        ("mobot-hw", &["occgrid"]),
    ];
    for (package, may_use) in allowed {
        for used in siblings(package) {
            assert!(
                may_use.contains(&used.as_str()),
                "{package} must not use {used}"
            );
        }
    }
}

#[test]
fn no_crate_needs_a_system_library() {
    let tree = cargo(&[
        "tree",
        "-e",
        "normal,build",
        "--prefix",
        "none",
        "--workspace",
    ]);
    for name in tree.lines().filter_map(|line| line.split(' ').next()) {
        let native = name.ends_with("-sys") && !["linux-raw-sys", "windows-sys"].contains(&name);
        assert!(!native, "{name} links a system library");
        assert!(
            !["pkg-config", "bindgen", "cc", "cmake"].contains(&name),
            "{name}"
        );
    }
}

#[test]
fn test_data_is_what_the_manifest_says() {
    let testdata = root().join("testdata");
    let text = std::fs::read_to_string(testdata.join("MANIFEST.toml")).expect("manifest");
    let manifest: toml::Table = toml::from_str(&text).expect("TOML");
    let sources: Vec<&str> = manifest["source"]
        .as_array()
        .expect("sources")
        .iter()
        .inspect(|s| {
            assert!(
                s.get("origin").is_some() && s.get("licence").is_some(),
                "{s}"
            )
        })
        .map(|s| s["path"].as_str().expect("path"))
        .collect();
    let hashes = manifest["sha256"].as_table().expect("hashes");
    let mut found = BTreeSet::new();
    files(&testdata, &mut found);
    let named: BTreeSet<PathBuf> = hashes.keys().map(|name| testdata.join(name)).collect();
    let unnamed: Vec<_> = found.difference(&named).collect();
    let missing: Vec<_> = named.difference(&found).collect();
    assert!(
        unnamed.is_empty() && missing.is_empty(),
        "unnamed {unnamed:?}, missing {missing:?}"
    );
    for (name, hash) in hashes {
        assert!(
            sources.iter().any(|s| name.starts_with(s)),
            "{name} has no source"
        );
        let bytes = std::fs::read(testdata.join(name)).expect("readable");
        let digest: String = Sha256::digest(bytes)
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect();
        assert_eq!(Some(digest.as_str()), hash.as_str(), "{name} was changed");
    }
}

/// Data files below a folder: not the manifest, the README or the generator scripts.
fn files(folder: &Path, into: &mut BTreeSet<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
        let name = path.file_name().and_then(|n| n.to_str()).expect("name");
        if path.is_dir() {
            if name != "__pycache__" {
                files(&path, into);
            }
        } else if !(["MANIFEST.toml", "README.md"].contains(&name)
            || name.ends_with(".py")
            || name.starts_with('.'))
        {
            into.insert(path);
        }
    }
}

fn table(path: &str) -> toml::Table {
    let text = std::fs::read_to_string(root().join(path)).expect("a manifest");
    toml::from_str(&text).expect("TOML")
}

#[test]
fn one_file_alone_may_be_unsafe() {
    let mut workspace = table("Cargo.toml")["workspace"]["lints"].clone();
    assert_eq!(workspace["rust"]["unsafe_code"].as_str(), Some("forbid"));
    let hardware = table("crates/mobot-hw/Cargo.toml")["lints"].clone();
    // the same but for what concerns that file
    workspace["rust"]["unsafe_code"] = "deny".into();
    let clippy = workspace["clippy"].as_table_mut().expect("a table");
    clippy.insert("undocumented_unsafe_blocks".to_owned(), "deny".into());
    assert_eq!(hardware, workspace);

    let mut sources = BTreeSet::new();
    for entry in std::fs::read_dir(root().join("crates")).expect("crates") {
        let folder = entry.expect("entry").path();
        files(&folder, &mut sources);
        let name = folder.file_name().and_then(|n| n.to_str()).expect("name");
        if name != "mobot-hw" {
            let lints = &table(&format!("crates/{name}/Cargo.toml"))["lints"];
            assert_eq!(lints["workspace"].as_bool(), Some(true), "{name}");
        }
    }
    let is_unsafe = |path: &&PathBuf| {
        path.extension().is_some_and(|ending| ending == "rs")
            && std::fs::read_to_string(path)
                .expect("source")
                .split_whitespace()
                .collect::<Vec<_>>()
                .windows(2)
                .any(|words| words[0] == "unsafe" && ["{", "impl", "fn"].contains(&words[1]))
    };
    let found: Vec<_> = sources.iter().filter(is_unsafe).collect();
    assert_eq!(found, [&root().join("crates/mobot-hw/src/v4l2/node.rs")]);
}
