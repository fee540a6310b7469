//! A mission's log from its first byte to its last, in a first run and in one from a log.

use std::path::Path;
use std::sync::Arc;

use mobot_hw::wrap::{Recorded, Replay};

use super::read::{LogError, LogReader, Message};
use super::recipe::Recipe;
use super::tape::replay_all;
use super::write::{LogParams, LogWriter};
use crate::nav::{Devices, Entry, Event, RunLog, StopCause};

/// Devices that answer from a log, and when its run was interrupted.
#[derive(Debug, Clone)]
pub struct Again {
    /// Every device, in the order of the log.
    pub replay: Replay,
    /// How many decisions came before somebody interrupted it.
    interrupted_after: Option<u64>,
}

impl Again {
    /// Of a log.
    ///
    /// # Errors
    /// [`LogError`]
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let interrupted = Event::Stop(StopCause::Interrupted).to_string();
        let mut decisions = 0;
        let mut interrupted_after = None;
        for entry in LogReader::open(path)? {
            if let Message::Decision(decision) = entry?.message {
                if decision.kind == "event" && decision.text == interrupted {
                    interrupted_after = Some(decisions);
                }
                decisions += 1;
            }
        }
        Ok(Self {
            replay: replay_all(path)?,
            interrupted_after,
        })
    }
}

/// A device whose calls go to a log.
pub type Logged<D> = Recorded<D, Arc<LogWriter>>;

/// The log that a mission writes.
#[derive(Debug)]
pub struct MissionLog {
    writer: Arc<LogWriter>,
    again: Option<Again>,
}

impl MissionLog {
    /// A new file that begins with what is needed to run it again.
    ///
    /// # Errors
    /// If the file cannot be made or written.
    pub fn begin(
        path: &Path,
        params: LogParams,
        recipe: &Recipe,
        again: Option<Again>,
    ) -> std::io::Result<Self> {
        let writer = Arc::new(LogWriter::create(path, params)?);
        recipe.write(&writer);
        writer.flush();
        Ok(Self { writer, again })
    }

    /// The devices, every call of which goes to the log.
    pub fn recorded<B, S, C, K>(
        &self,
        devices: Devices<B, S, C, K>,
    ) -> Devices<Logged<B>, Logged<S>, Logged<C>, Logged<K>> {
        let to = || self.writer.clone();
        Devices {
            base: Recorded::new(devices.base, to()),
            sonar: Recorded::new(devices.sonar, to()),
            camera: devices.camera.map(|camera| Recorded::new(camera, to())),
            clock: Recorded::new(devices.clock, to()),
        }
    }

    /// Where the loop writes.
    #[must_use]
    pub fn writer(&self) -> &LogWriter {
        &self.writer
    }

    /// Whether a run from a log is to be interrupted now: because it was then, or because the log ends or
    /// leads elsewhere.
    #[must_use]
    pub fn interrupts(&self) -> bool {
        self.again.as_ref().is_some_and(|again| {
            again.replay.ended().is_some() || again.interrupted_after == Some(self.writer.decided())
        })
    }

    /// Ends the file.
    ///
    /// # Errors
    /// The first that there was since the file was made.
    pub fn finish(&self) -> std::io::Result<()> {
        self.writer.finish()
    }
}

/// Both take every entry.
impl<A: RunLog, B: RunLog> RunLog for (A, B) {
    fn record(&mut self, time: f64, entry: Entry<'_>) {
        self.0.record(time, entry);
        self.1.record(time, entry);
    }
}
