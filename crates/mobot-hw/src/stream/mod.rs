//! A camera that is a stream of JPEG pictures (feature `mjpeg`): a file, a named pipe or the standard input that
//! a camera tool writes to, or anything else that reads.

pub(crate) mod jpeg;
mod live;
mod played;
pub(crate) mod split;

use std::fmt;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::time::{Duration, Instant};

use self::live::Live;
use self::played::Played;
use self::split::{JpegFrame, Shape};
use crate::camera_fault::SizeLock;
use crate::{Camera, CameraError, CameraFrame, Clock, FrameCounts, FrameFault};

/// How a stream is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MjpegParams {
    /// How long a call looks for a good frame [s], above 0.
    pub timeout: f64,
    /// Longest frame [bytes], above 0: longer ones are lost. Three times that much memory may be held.
    pub frame_limit: usize,
}

impl Default for MjpegParams {
    fn default() -> Self {
        Self {
            timeout: 1.0,
            frame_limit: 8 << 20,
        }
    }
}

/// Gives the luma of a stream's JPEG pictures, up to 4096 px a side.
///
/// Damaged are frames that are cut short or no valid JPEG, and those of another size once two in a row had one size.
/// They are passed over; the next whole frame is found by its markers. Frames without Huffman tables, as many cameras send them, get the
/// standard ones. A frame is stamped when its first bytes came, so the camera's own delay is not in it.
pub struct MjpegCamera<C> {
    clock: C,
    params: MjpegParams,
    size: SizeLock,
    given: u64,
    damaged: u64,
    source: Source,
}

enum Source {
    Live(Live),
    Played(Played),
}

/// What a source has next.
enum Next {
    Frame(Coded),
    Lost(FrameFault),
    /// Not yet, or not in time.
    Nothing,
    /// Nor will there be more; an error, if that ended it.
    End(Option<ErrorKind>),
}

/// A whole frame, still coded.
struct Coded {
    bytes: Vec<u8>,
    shape: Shape,
    arrived: Instant,
    sequence: u64,
}

impl<C: Clock> MjpegCamera<C> {
    /// Opens a file, which is [`played`](Self::played), or a pipe or device, which is [`live`](Self::live); `-` is
    /// the standard input, whichever it is. A named pipe may wait for its writer: until then there is silence.
    ///
    /// # Errors
    /// [`CameraError::System`] if it cannot be opened.
    pub fn open(path: &str, clock: C, params: MjpegParams) -> Result<Self, CameraError> {
        let failed = |error| failed(path, "opening", &error);
        let place = if path == "-" { "/dev/stdin" } else { path };
        let is_file = std::fs::metadata(place).map(|place| place.is_file());
        match (path, is_file) {
            ("-", Ok(true)) => Ok(Self::played(io::stdin(), clock, params)),
            ("-", _) => Self::live(io::stdin(), clock, params),
            (_, Ok(true)) => File::open(path)
                .map(|file| Self::played(file, clock, params))
                .map_err(failed),
            (_, Ok(false)) => {
                let path = path.to_owned();
                Live::begin(move || File::open(path), params.frame_limit)
                    .map(|live| Self::over(Source::Live(live), clock, params))
                    .map_err(failed)
            }
            (_, Err(error)) => Err(failed(error)),
        }
    }

    /// Reads as fast as bytes come, on a thread of its own, and keeps the newest frame alone. The thread ends with
    /// the stream, or at the first bytes after the camera was dropped.
    ///
    /// # Errors
    /// [`CameraError::System`] if there can be no thread.
    pub fn live<R>(reader: R, clock: C, params: MjpegParams) -> Result<Self, CameraError>
    where
        R: Read + Send + 'static,
    {
        Live::begin(move || Ok(reader), params.frame_limit)
            .map(|live| Self::over(Source::Live(live), clock, params))
            .map_err(|error| failed("stream", "starting its reader", &error))
    }

    /// Gives every frame in order, as soon as it is asked for. For files: a call takes as long as the reader does.
    pub fn played<R>(reader: R, clock: C, params: MjpegParams) -> Self
    where
        R: Read + Send + 'static,
    {
        let played = Played::new(Box::new(reader), params.frame_limit);
        Self::over(Source::Played(played), clock, params)
    }

    fn over(source: Source, clock: C, params: MjpegParams) -> Self {
        Self {
            clock,
            params,
            size: SizeLock::default(),
            given: 0,
            damaged: 0,
            source,
        }
    }
}

impl<C> MjpegCamera<C> {
    /// What became of the frames so far.
    pub fn counts(&self) -> FrameCounts {
        let (passed_over, lost) = match &self.source {
            Source::Live(live) => live.counts(),
            Source::Played(_) => (0, 0),
        };
        FrameCounts {
            given: self.given,
            passed_over,
            damaged: self.damaged + lost,
            missed: 0,
        }
    }

    fn decode(&mut self, coded: &Coded) -> Result<image::GrayImage, FrameFault> {
        let image = jpeg::grey(&JpegFrame {
            bytes: &coded.bytes,
            shape: coded.shape,
        })?;
        self.size.check([image.width(), image.height()])?;
        Ok(image)
    }
}

impl<C: Clock> Camera for MjpegCamera<C> {
    type Error = CameraError;

    fn frame(&mut self) -> Result<CameraFrame, CameraError> {
        let began = Instant::now();
        let timeout = Duration::try_from_secs_f64(self.params.timeout).unwrap_or_default();
        let mut last_fault = None;
        loop {
            let left = timeout.saturating_sub(began.elapsed());
            let next = match &mut self.source {
                Source::Live(live) => live.next(left),
                Source::Played(played) => played.next(),
            };
            match next {
                Next::Frame(coded) => match self.decode(&coded) {
                    Ok(image) => {
                        self.given += 1;
                        return Ok(CameraFrame {
                            stamp: self.clock.now() - coded.arrived.elapsed().as_secs_f64(),
                            sequence: coded.sequence,
                            image,
                        });
                    }
                    Err(fault) => {
                        self.damaged += 1;
                        last_fault = Some(fault);
                    }
                },
                Next::Lost(fault) => {
                    self.damaged += u64::from(matches!(self.source, Source::Played(_)));
                    last_fault = Some(fault);
                }
                Next::Nothing => {}
                Next::End(None) => return Err(CameraError::Ended),
                Next::End(Some(kind)) => {
                    return Err(CameraError::System {
                        camera: "stream".to_owned(),
                        doing: "reading",
                        kind,
                    });
                }
            }
            let waited = began.elapsed();
            if waited >= timeout {
                let waited = waited.as_secs_f64();
                return Err(last_fault.map_or(CameraError::Silent { waited }, |fault| {
                    CameraError::Garbled { waited, fault }
                }));
            }
        }
    }
}

fn failed(camera: &str, doing: &'static str, error: &io::Error) -> CameraError {
    CameraError::System {
        camera: camera.to_owned(),
        doing,
        kind: error.kind(),
    }
}

impl<C> fmt::Debug for MjpegCamera<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MjpegCamera")
            .field("params", &self.params)
            .field("counts", &self.counts())
            .finish_non_exhaustive()
    }
}
