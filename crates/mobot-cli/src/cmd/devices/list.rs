//! Ports and cameras that are there.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

/// A port or a camera that could be named.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Candidate {
    /// Its name, where there is one the stable one.
    pub(super) path: String,
    /// The node behind a stable name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) node: Option<String>,
    /// What it says it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) name: Option<String>,
}

/// Serial ports: those with stable names first, then other nodes of adaptors and boards. Nothing is opened.
pub(super) fn ports(root: &Path) -> Vec<Candidate> {
    let name = |node: &str| usb_name(&root.join("sys/class/tty").join(node).join("device"));
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for link in entries(&root.join("dev/serial/by-id")) {
        let Some(node) = fs::read_link(&link).ok().and_then(|to| file_name(&to)) else {
            continue;
        };
        found.push(Candidate {
            path: shown(root, &link),
            node: Some(format!("/dev/{node}")),
            name: name(&node),
        });
        seen.insert(node);
    }
    let nodes = entries(&root.join("dev"));
    let others = nodes.iter().filter_map(|node| {
        let file = file_name(node)?;
        let digits = NODES.iter().find_map(|prefix| file.strip_prefix(prefix))?;
        let numbered = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
        (numbered && !seen.contains(&file)).then(|| Candidate {
            path: shown(root, node),
            node: None,
            name: name(&file),
        })
    });
    found.extend(others);
    found
}

/// Cameras, by their stable names where they have one. They are asked what they are, and not set.
#[cfg(target_os = "linux")]
pub(super) fn cameras() -> Vec<Candidate> {
    let cameras = mobot_hw::v4l2::cameras().into_iter();
    cameras
        .map(|camera| {
            let node = camera.path.display().to_string();
            let formats = camera.formats.join(" ");
            let name = format!("{} ({formats})", camera.name);
            let stable = camera.stable_path.map(|path| path.display().to_string());
            Candidate {
                node: stable.is_some().then(|| node.clone()),
                path: stable.unwrap_or(node),
                name: Some(name.chars().filter(|c| !c.is_control()).collect()),
            }
        })
        .collect()
}

/// None that this system could list.
#[cfg(not(target_os = "linux"))]
pub(super) fn cameras() -> Vec<Candidate> {
    Vec::new()
}

/// How nodes of ports begin that are no part of every machine.
const NODES: [&str; 4] = ["ttyUSB", "ttyACM", "ttyAMA", "rfcomm"];

/// What is in a folder, in order; nothing where there is none.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let read = fs::read_dir(folder).into_iter().flatten();
    let mut paths: Vec<PathBuf> = read.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

fn file_name(path: &Path) -> Option<String> {
    Some(path.file_name()?.to_str()?.to_owned())
}

/// The name as seen from the root.
fn shown(root: &Path, path: &Path) -> String {
    let below = path.strip_prefix(root).unwrap_or(path);
    format!("/{}", below.display())
}

/// Maker and product of the USB device that an interface belongs to, some folders up.
fn usb_name(interface: &Path) -> Option<String> {
    let interface = fs::canonicalize(interface).ok()?;
    let device = interface
        .ancestors()
        .take(4)
        .find(|folder| folder.join("product").is_file())?;
    let parts = ["manufacturer", "product"].map(|file| line(&device.join(file)));
    Some(parts.into_iter().flatten().collect::<Vec<_>>().join(" "))
}

/// The first line of a small file, fit to be printed.
fn line(path: &Path) -> Option<String> {
    let text = fs::read_to_string(path).ok()?;
    let line = text.lines().next()?.trim();
    let printable = line.chars().filter(|c| !c.is_control()).take(100);
    Some(printable.collect()).filter(|name: &String| !name.is_empty())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    /// A machine with two USB adaptors, one of them with a stable name.
    fn machine() -> tempfile::TempDir {
        let root = tempfile::tempdir().expect("a folder");
        let at = |path: &str| root.path().join(path);
        for folder in [
            "dev/serial/by-id",
            "sys/devices/usb1/1-1/1-1:1.0/ttyUSB0",
            "sys/class/tty/ttyUSB0",
        ] {
            fs::create_dir_all(at(folder)).expect("a folder");
        }
        for file in ["ttyUSB0", "ttyACM1", "tty0", "ttyS0", "ttyUSBx", "null"] {
            fs::write(at("dev").join(file), "").expect("a file");
        }
        symlink("../../ttyUSB0", at("dev/serial/by-id/usb-FTDI_FT232R-if00")).expect("a link");
        symlink(
            at("sys/devices/usb1/1-1/1-1:1.0/ttyUSB0"),
            at("sys/class/tty/ttyUSB0/device"),
        )
        .expect("a link");
        fs::write(at("sys/devices/usb1/1-1/manufacturer"), "FTDI\n").expect("a file");
        fs::write(at("sys/devices/usb1/1-1/product"), "FT232R\x1b[31m\n").expect("a file");
        root
    }

    #[test]
    fn stable_names_come_first_and_nothing_twice() {
        let root = machine();
        let [first, second] = &ports(root.path())[..] else {
            panic!("{:?}", ports(root.path()));
        };
        assert_eq!(first.path, "/dev/serial/by-id/usb-FTDI_FT232R-if00");
        assert_eq!(first.node.as_deref(), Some("/dev/ttyUSB0"));
        assert_eq!(first.name.as_deref(), Some("FTDI FT232R[31m"));
        assert_eq!(
            (second.path.as_str(), &second.name),
            ("/dev/ttyACM1", &None)
        );
    }

    #[test]
    fn a_machine_without_any_has_none() {
        let root = tempfile::tempdir().expect("a folder");
        assert!(ports(root.path()).is_empty());
    }
}
