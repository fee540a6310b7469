//! Devices from and to run logs: what stands behind `replay:FILE` and `record:FILE,`.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Cursor, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::{GrayImage, ImageFormat, ImageReader, Limits};
use mobot_hw::CameraFrame;
use mobot_hw::wrap::{Call, Device, Replay};

use super::read::{LogError, LogReader, Message};
use super::write::{LogParams, LogWriter};

/// The calls of a log, with their pictures.
///
/// # Errors
/// If the file cannot be opened or is no run log.
pub fn calls(
    path: &Path,
) -> Result<impl Iterator<Item = Result<Call, LogError>> + use<>, LogError> {
    Calls::open(path)
}

/// The devices of a log, all together: their calls must come in the order of the log.
///
/// # Errors
/// If the file cannot be opened or is no run log.
pub fn replay_all(path: &Path) -> Result<Replay, LogError> {
    Ok(Replay::new(Calls::open(path)?))
}

/// One device of a log; what others did is passed over.
///
/// # Errors
/// If the file cannot be opened or is no run log.
pub fn replay(path: &Path, device: Device) -> Result<Replay, LogError> {
    Ok(Replay::only(device, Calls::open(path)?))
}

/// Files that devices are recorded to: several devices may share one.
#[derive(Debug, Default)]
pub struct Recordings {
    files: BTreeMap<PathBuf, Arc<LogWriter>>,
}

impl Recordings {
    /// The recording of this name; made when it is first asked for.
    ///
    /// # Errors
    /// If the file cannot be made.
    pub fn at(&mut self, path: &Path) -> std::io::Result<Arc<LogWriter>> {
        if let Some(log) = self.files.get(path) {
            return Ok(log.clone());
        }
        let log = Arc::new(LogWriter::create(path, LogParams::default())?);
        self.files.insert(path.into(), log.clone());
        Ok(log)
    }

    /// Ends all files.
    ///
    /// # Errors
    /// The first, with the file's name.
    pub fn finish(&self) -> Result<(), (PathBuf, std::io::Error)> {
        for (path, log) in &self.files {
            log.finish().map_err(|error| (path.clone(), error))?;
        }
        Ok(())
    }
}

/// The calls of a log with their pictures, read while they are needed.
#[derive(Debug)]
struct Calls<R> {
    entries: LogReader<R>,
    /// The last picture.
    picture: Vec<u8>,
    /// How many calls were read.
    read: u32,
}

impl Calls<BufReader<File>> {
    fn open(path: &Path) -> Result<Self, LogError> {
        Ok(Self {
            entries: LogReader::open(path)?,
            picture: Vec::new(),
            read: 0,
        })
    }
}

impl<R: Read> Iterator for Calls<R> {
    type Item = Result<Call, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.entries.next()? {
                Err(error) => return Some(Err(error)),
                Ok(entry) => match entry.message {
                    Message::Frame(image) => self.picture = image.data,
                    Message::Call(record) => {
                        let picture = &self.picture;
                        let frame = |stamp, sequence| {
                            Some(CameraFrame {
                                stamp,
                                sequence,
                                image: decode(picture)?,
                            })
                        };
                        let sequence = self.read;
                        self.read = sequence.wrapping_add(1);
                        let call = record.call(frame).ok_or_else(|| LogError::Call {
                            sequence,
                            found: format!("{:?} and {:?}", record.asked, record.answer),
                        });
                        return Some(call);
                    }
                    _ => {}
                },
            }
        }
    }
}

/// A grey picture of at most 4096 x 4096 pixels.
fn decode(png: &[u8]) -> Option<GrayImage> {
    let mut reader = ImageReader::with_format(Cursor::new(png), ImageFormat::Png);
    let mut limits = Limits::default();
    limits.max_image_width = Some(4096);
    limits.max_image_height = Some(4096);
    limits.max_alloc = Some(64 << 20);
    reader.limits(limits);
    Some(reader.decode().ok()?.into_luma8())
}
