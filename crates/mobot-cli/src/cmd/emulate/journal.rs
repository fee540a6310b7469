//! The log of an emulation: JSON lines, stamped with the system's monotonic clock.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use anyhow::Context as _;
use mobot_hw::emulate::Emulation;
use mobot_hw::sim::Simulation;
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;

use super::control::TruthLine;

/// Time between two entries of the true pose [s].
const TRUTH: f64 = 0.1;

#[derive(Serialize)]
#[serde(rename_all = "lowercase")]
enum Entry<'a> {
    Wheels([f64; 2]),
    Control(&'a str),
    Truth(TruthLine),
}

#[derive(Serialize)]
struct Line<'a> {
    /// CLOCK_MONOTONIC [s].
    stamp: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    device: Option<&'a str>,
    #[serde(flatten)]
    entry: Entry<'a>,
}

/// Writes what happens, as it happens.
pub(super) struct Journal {
    file: BufWriter<File>,
    /// The monotonic clock when the emulation began [s].
    began: f64,
    /// How many wheel commands of each device are written.
    written: Vec<usize>,
    next_truth: f64,
}

impl Journal {
    pub(super) fn create(path: &Path, emulation: &Emulation) -> anyhow::Result<Self> {
        let file = File::create(path).with_context(|| format!("{}", path.display()))?;
        Ok(Self {
            file: BufWriter::new(file),
            began: monotonic() - emulation.elapsed(),
            written: vec![0; emulation.len()],
            next_truth: 0.0,
        })
    }

    /// The wheel commands that came into force since, and the true pose where it is due.
    pub(super) fn catch_up(
        &mut self,
        robot: &Simulation,
        emulation: &Emulation,
        names: &[String],
    ) -> anyhow::Result<()> {
        for (device, name) in names.iter().enumerate() {
            let log = emulation.wheel_log_from(device, self.written[device]);
            self.written[device] += log.len();
            for command in log {
                self.write(&Line {
                    stamp: self.began + command.stamp,
                    device: Some(name),
                    entry: Entry::Wheels(command.wheels),
                })?;
            }
        }
        let now = emulation.elapsed();
        if now >= self.next_truth {
            self.next_truth = (self.next_truth + TRUTH).max(now);
            self.write(&Line {
                stamp: self.began + now,
                device: None,
                entry: Entry::Truth(TruthLine::of(robot)),
            })?;
        }
        self.file.flush().context("the log")
    }

    /// A line of control that was obeyed.
    pub(super) fn control(&mut self, line: &str) -> anyhow::Result<()> {
        self.write(&Line {
            stamp: monotonic(),
            device: None,
            entry: Entry::Control(line.trim()),
        })
    }

    fn write(&mut self, line: &Line<'_>) -> anyhow::Result<()> {
        serde_json::to_writer(&mut self.file, line).context("the log")?;
        self.file.write_all(b"\n").context("the log")
    }
}

/// The system's monotonic clock [s].
fn monotonic() -> f64 {
    let time = clock_gettime(ClockId::Monotonic);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}
