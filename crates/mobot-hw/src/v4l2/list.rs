//! Which cameras there are.

use std::path::{Path, PathBuf};

use super::layout::Capability;
use super::node::Node;
use super::{format, is_camera, negotiate, text};

/// A camera that is plugged in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CameraInfo {
    /// As in `/dev/video0`: may change with every plugging in.
    pub path: PathBuf,
    /// As in `/dev/v4l/by-id/usb-...`: stays, where the system gives one.
    pub stable_path: Option<PathBuf>,
    /// What it calls itself.
    pub name: String,
    /// The kernel's driver.
    pub driver: String,
    /// Where it is plugged in.
    pub bus: String,
    /// Codes of its pixel formats, four letters each, as the driver orders them.
    pub formats: Vec<String>,
}

/// The cameras of this machine, by number. Those that may not be opened are left out.
#[must_use]
pub fn cameras() -> Vec<CameraInfo> {
    let numbered = |path: PathBuf| {
        let name = path.file_name()?.to_str()?;
        let number: u32 = name.strip_prefix("video")?.parse().ok()?;
        Some((number, path))
    };
    let mut nodes: Vec<_> = entries("/dev").into_iter().filter_map(numbered).collect();
    nodes.sort();
    nodes
        .into_iter()
        .filter_map(|(_, path)| describe(path))
        .collect()
}

fn entries(folder: impl AsRef<Path>) -> Vec<PathBuf> {
    let found = std::fs::read_dir(folder).into_iter().flatten().flatten();
    found.map(|entry| entry.path()).collect()
}

fn describe(path: PathBuf) -> Option<CameraInfo> {
    let node = Node::open(&path).ok()?;
    let mut capability = Capability::default();
    node.capability(&mut capability).ok()?;
    if !is_camera(&capability) {
        return None;
    }
    let codes = negotiate::formats(&node).ok()?;
    Some(CameraInfo {
        stable_path: stable(&path),
        path,
        name: text(&capability.card),
        driver: text(&capability.driver),
        bus: text(&capability.bus),
        formats: codes.into_iter().map(format::name).collect(),
    })
}

/// The first link to it, by its identity or else by its place.
fn stable(path: &Path) -> Option<PathBuf> {
    let target = path.canonicalize().ok()?;
    ["/dev/v4l/by-id", "/dev/v4l/by-path"]
        .into_iter()
        .find_map(|folder| {
            let mut links = entries(folder);
            links.sort();
            links
                .into_iter()
                .find(|link| link.canonicalize().is_ok_and(|end| end == target))
        })
}
