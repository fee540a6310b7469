//! Cameras that Linux knows (feature `v4l2`): USB webcams and whatever else its video interface V4L2 gives as whole
//! frames. Single-planar capture into mapped memory; no library but the kernel.

mod control;
mod format;
mod layout;
mod list;
mod negotiate;
mod newest;
#[expect(
    unsafe_code,
    reason = "requests to the kernel and memory shared with it have no safe form"
)]
mod node;
mod requests;

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::io::Errno;
use rustix::time::{ClockId, clock_gettime};

pub use self::control::Control;
pub use self::format::PixelFormat;
pub use self::list::{CameraInfo, cameras};

use self::control::{EXPOSURE, EXPOSURE_MAY_SLOW, FOCUS, GAIN, Ruled, Unset, WHITE_BALANCE};
use self::layout::Capability;
use self::negotiate::{Agreed, Disagreed};
use self::newest::{About, FrameQueue, Newest, Shortfall};
use self::node::{Filled, Node, Ring};
use self::requests::Requests;
use crate::{Camera, CameraError, CameraFrame, Clock, FrameCounts};

/// Buffers that the driver fills in turn: one being read, one being filled, two in between.
const BUFFERS: u32 = 4;

/// What a camera is set to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct V4l2Params {
    /// Width and height [px]; none takes what the camera stands at. A camera without this size is refused, since
    /// what was calibrated for one is wrong for another.
    pub size_px: Option<[u32; 2]>,
    /// Frames a second [1/s], above 0; the camera takes what is nearest, see [`V4l2Settings::rate_hz`]. None keeps the
    /// rate at which the camera stands.
    pub rate_hz: Option<f64>,
    /// None takes the first of [`PixelFormat::ALL`] in which the camera has the size and comes nearest to the rate.
    pub format: Option<PixelFormat>,
    /// Exposure time for good [s], to 100 us; none leaves it to the camera. Long ones blur what moves, and lower the
    /// rate.
    pub exposure: Option<f64>,
    /// White balance for good [K]; none leaves it to the camera.
    pub white_balance_k: Option<i32>,
    /// How long a call waits for a good frame [s], above 0.
    pub timeout: f64,
    /// Frames older than this [s] are passed over, above the time from exposure to arrival: a frame's time or two.
    pub max_age: f64,
}

impl Default for V4l2Params {
    fn default() -> Self {
        Self {
            size_px: None,
            rate_hz: None,
            format: None,
            exposure: None,
            white_balance_k: None,
            timeout: 1.0,
            max_age: 0.25,
        }
    }
}

/// What a camera says that it is set to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct V4l2Settings {
    /// Width and height [px].
    pub size_px: [u32; 2],
    /// Frames a second [1/s].
    pub rate_hz: Option<f64>,
    /// How pixels come.
    pub format: PixelFormat,
    /// Exposure time [s]; while the camera sets it by itself, drivers may give an old one.
    pub exposure: Option<f64>,
    /// White balance [K]; likewise.
    pub white_balance_k: Option<i32>,
}

/// A camera of Linux's. A frame is the newest that the driver has filled, stamped when the driver says that it was
/// taken; frames that come damaged or too late are passed over and counted. A stream that fails is begun again, once a
/// call. After [`CameraError::Unplugged`] drop it before the camera comes back, or it comes under another name.
#[derive(Debug)]
pub struct V4l2Camera<C> {
    clock: C,
    path: PathBuf,
    params: V4l2Params,
    agreed: Agreed,
    ring: Ring,
    newest: Newest,
}

impl<C: Clock> V4l2Camera<C> {
    /// Opens a camera, best by its stable name as in `/dev/v4l/by-id`, sets it and starts its stream.
    ///
    /// # Errors
    /// [`CameraError::Busy`] if another program streams from it, [`CameraError::Refused`] if it is no camera or cannot
    /// do what the parameters say, [`CameraError::Unplugged`], or [`CameraError::System`].
    pub fn open(path: impl AsRef<Path>, clock: C, params: V4l2Params) -> Result<Self, CameraError> {
        let path = path.as_ref();
        let failed = |doing| move |error| failed(path, doing, error);
        let node = Node::open(path).map_err(failed("opening"))?;
        let mut capability = Capability::default();
        match node.capability(&mut capability) {
            Err(Errno::NOTTY | Errno::INVAL) => return Err(no_camera(path, "another device")),
            other => other.map_err(failed("asking what it is"))?,
        }
        if !is_camera(&capability) {
            return Err(no_camera(path, "a video device of another kind"));
        }
        let agreed = negotiate::agree(&node, &params).map_err(|disagreed| match disagreed {
            Disagreed::Format { expected, found } => refused(path, "pixel format", expected, found),
            Disagreed::Size { expected, found } => refused(path, "picture size", expected, found),
            Disagreed::Failed(error) => failed("setting the format")(error),
        })?;
        set_light(&node, path, &params)?;
        let ring = Ring::start(node, BUFFERS).map_err(failed("starting the stream"))?;
        Ok(Self {
            clock,
            path: path.to_owned(),
            params,
            agreed,
            ring,
            newest: Newest::default(),
        })
    }
}

impl<C> V4l2Camera<C> {
    /// What the camera says that it is set to.
    pub fn settings(&self) -> V4l2Settings {
        let layout = &self.agreed.layout;
        let node = self.ring.node();
        V4l2Settings {
            size_px: [layout.width, layout.height],
            rate_hz: self.agreed.rate,
            format: layout.format,
            exposure: control::reading(node, EXPOSURE).map(|units| f64::from(units) * 1e-4),
            white_balance_k: control::reading(node, WHITE_BALANCE),
        }
    }

    /// What became of the frames so far.
    pub fn counts(&self) -> FrameCounts {
        self.newest.counts
    }

    /// Fixes exposure, gain, white balance and focus at what they are now, those that the camera has automatics for:
    /// after some thirty frames of settling, before calibration or line finding.
    ///
    /// # Errors
    /// As [`set_control`](Self::set_control).
    pub fn hold(&mut self) -> Result<(), CameraError> {
        for ruled in [EXPOSURE, GAIN, WHITE_BALANCE, FOCUS] {
            control::hold(self.ring.node(), ruled)
                .map_err(|unset| unset_error(&self.path, ruled.what, "what it is", unset))?;
        }
        Ok(())
    }

    /// All that can be set on the camera.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`] or [`CameraError::System`].
    pub fn controls(&self) -> Result<Vec<Control>, CameraError> {
        control::list(self.ring.node())
            .map_err(|error| failed(&self.path, "listing its controls", error))
    }

    /// The value of a control.
    ///
    /// # Errors
    /// [`CameraError::Refused`] if there is none that can be read, else as [`controls`](Self::controls).
    pub fn control(&self, id: u32) -> Result<i32, CameraError> {
        let unset = |unset| unset_error(&self.path, "control", &format!("{id:#010x}"), unset);
        let control = control::find(self.ring.node(), id).map_err(|error| unset(error.into()))?;
        if control.is_none() {
            return Err(unset(Unset::Missing));
        }
        control::get(self.ring.node(), id).map_err(|error| unset(error.into()))
    }

    /// Sets a control to the step nearest to `value`, presses it if it is a button, and gives what it then is.
    ///
    /// # Errors
    /// [`CameraError::Refused`] if there is none, its range is another, or it is not so afterwards; else as
    /// [`controls`](Self::controls).
    pub fn set_control(&mut self, id: u32, value: i32) -> Result<i32, CameraError> {
        control::set(self.ring.node(), id, value)
            .map_err(|unset| unset_error(&self.path, "control", &format!("{value}"), unset))
    }
}

impl<C: Clock> Camera for V4l2Camera<C> {
    type Error = CameraError;

    fn frame(&mut self) -> Result<CameraFrame, CameraError> {
        let Self {
            params,
            agreed,
            ring,
            newest,
            ..
        } = self;
        let waited = params.timeout;
        let taken = newest.take(ring, waited, params.max_age, |bytes| {
            agreed.layout.grey(bytes)
        });
        match taken {
            Ok(taken) => Ok(CameraFrame {
                stamp: self.clock.now() - (self.ring.now() - taken.stamp),
                sequence: taken.sequence,
                image: taken.picture,
            }),
            Err(Shortfall::Silent) => Err(CameraError::Silent { waited }),
            Err(Shortfall::Damaged(fault)) => Err(CameraError::Garbled { waited, fault }),
            Err(Shortfall::Stale(age)) => Err(CameraError::Stale { waited, age }),
            Err(Shortfall::Gone) => Err(CameraError::Unplugged),
            Err(Shortfall::Failed(error)) => Err(failed(&self.path, "streaming", error)),
        }
    }
}

impl FrameQueue for Ring {
    type Filled = Filled;

    fn dequeue(&mut self) -> rustix::io::Result<Option<Filled>> {
        self.dequeue()
    }

    fn requeue(&mut self, filled: Filled) -> rustix::io::Result<()> {
        self.requeue(filled)
    }

    fn about(&self, filled: &Filled) -> About {
        const ERROR: u32 = 0x40;
        const CLOCKS: u32 = 0xE000;
        const MONOTONIC: u32 = 0x2000;
        let buffer = filled.buffer();
        let monotonic = buffer.flags & CLOCKS == MONOTONIC;
        About {
            damaged: buffer.flags & ERROR != 0,
            sequence: buffer.sequence,
            stamp: monotonic.then_some(buffer.stamp_s as f64 + buffer.stamp_us as f64 * 1e-6),
        }
    }

    fn bytes<'a>(&'a self, filled: &'a Filled) -> &'a [u8] {
        self.bytes(filled)
    }

    fn wait(&mut self, wait: Duration) -> rustix::io::Result<()> {
        self.node().wait(wait)
    }

    fn restart(&mut self) -> rustix::io::Result<()> {
        self.restart()
    }

    fn now(&self) -> f64 {
        let now = clock_gettime(ClockId::Monotonic);
        now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
    }
}

/// Exposure and white balance.
fn set_light(node: &impl Requests, path: &Path, params: &V4l2Params) -> Result<(), CameraError> {
    // or the rate halves in the dark; cameras without it need none
    let _ = control::set(node, EXPOSURE_MAY_SLOW, 0);
    let fix = |ruled: Ruled, value: i32, expected: String| {
        control::fix(node, ruled, value)
            .map(drop)
            .map_err(|unset| unset_error(path, ruled.what, &expected, unset))
    };
    if let Some(seconds) = params.exposure {
        let units = (seconds * 1e4).round() as i32;
        fix(EXPOSURE, units, format!("{seconds} s ({units} units)"))?;
        // which would work against it
        control::automatic_off(node, GAIN)
            .map_err(|unset| unset_error(path, GAIN.what, "a fixed one", unset))?;
    }
    if let Some(kelvin) = params.white_balance_k {
        fix(WHITE_BALANCE, kelvin, format!("{kelvin} K"))?;
    }
    Ok(())
}

/// Gives whole frames into mapped memory.
fn is_camera(capability: &Capability) -> bool {
    const VIDEO_CAPTURE: u32 = 0x1;
    const STREAMING: u32 = 0x0400_0000;
    const HAS_DEVICE_CAPS: u32 = 0x8000_0000;
    let can = if capability.capabilities & HAS_DEVICE_CAPS != 0 {
        capability.device_caps
    } else {
        capability.capabilities
    };
    can & VIDEO_CAPTURE != 0 && can & STREAMING != 0
}

/// A name of the kernel's, up to its first zero byte.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

fn failed(path: &Path, doing: &'static str, error: Errno) -> CameraError {
    let camera = path.display().to_string();
    match error {
        Errno::BUSY => CameraError::Busy { camera },
        Errno::NODEV | Errno::NXIO => CameraError::Unplugged,
        error => CameraError::System {
            camera,
            doing,
            kind: io::Error::from(error).kind(),
        },
    }
}

fn refused(path: &Path, what: &'static str, expected: String, found: String) -> CameraError {
    CameraError::Refused {
        camera: path.display().to_string(),
        what,
        expected,
        found,
    }
}

fn no_camera(path: &Path, found: &str) -> CameraError {
    let expected = "a camera that gives whole frames";
    refused(
        path,
        "kind of device",
        expected.to_owned(),
        found.to_owned(),
    )
}

fn unset_error(path: &Path, what: &'static str, expected: &str, unset: Unset) -> CameraError {
    let found = match unset {
        Unset::Missing => "no such control".to_owned(),
        Unset::Range { minimum, maximum } => format!("a range of {minimum} to {maximum}"),
        Unset::Ignored(found) => format!("{found}"),
        Unset::Failed(Errno::ACCESS | Errno::INVAL | Errno::RANGE) => {
            "a camera that does not allow it".to_owned()
        }
        Unset::Failed(error) => return failed(path, "setting a control", error),
    };
    refused(path, what, expected.to_owned(), found)
}
