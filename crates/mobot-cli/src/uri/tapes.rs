//! Recordings: what stands behind `record:FILE,` and `replay:FILE`.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context as _;
use mobot_hw::wrap::{Device, Recorded, Replay};

use super::Uri;
use crate::run_log::{self, LogWriter, Recordings};

/// What devices are recorded to.
#[derive(Debug, Default)]
pub(crate) struct Tapes {
    files: Recordings,
    first: Option<Arc<LogWriter>>,
}

impl Tapes {
    /// A boxed device as it is, or recorded where that was typed; `boxed` makes the same box of it again.
    pub(super) fn on<U, B>(
        &mut self,
        uri: &Uri<U>,
        device: B,
        boxed: impl FnOnce(Recorded<B, Arc<LogWriter>>) -> B,
    ) -> anyhow::Result<B> {
        let Some(file) = &uri.record else {
            return Ok(device);
        };
        let tape = self
            .files
            .at(file)
            .with_context(|| format!("{}", file.display()))?;
        self.first.get_or_insert_with(|| Arc::clone(&tape));
        Ok(boxed(Recorded::new(device, tape)))
    }

    /// The first one that a device is recorded to.
    pub(super) fn first(&self) -> Option<Arc<LogWriter>> {
        self.first.clone()
    }
}

/// One device of a recording.
pub(super) fn replayed(file: &Path, device: Device) -> anyhow::Result<Replay> {
    run_log::replay(file, device).with_context(|| format!("{}", file.display()))
}
