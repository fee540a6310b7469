//! A folder for as long as it is needed.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use anyhow::Context as _;

/// Removed with all that is in it when it is dropped.
pub(super) struct Scratch(pub(super) PathBuf);

impl Scratch {
    /// Among the machine's temporary files.
    pub(super) fn new() -> anyhow::Result<Self> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("mobot-{}-{count}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        // one that is there already may be somebody else's
        std::fs::create_dir(&folder).with_context(|| format!("{}", folder.display()))?;
        Ok(Self(folder))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
