//! Device URIs: `maxbotix:/dev/ttyUSB0?model=hrlv`, `sim:`, `record:RUN,create2:/dev/ttyUSB1`.
//!
//! A URI is read into plain data first ([`Uri`]), so that a wrong one is refused before any port is opened.
//!
//! ```
//! use mobot_cli::uri::{Sonar, SonarKind, Uri};
//!
//! let sonar: Uri<Sonar> = "maxbotix:/dev/ttyUSB0?model=hrlv&mount=0.1,0,0".parse()?;
//! assert!(matches!(sonar.device.kind, SonarKind::MaxBotix { .. }));
//! let wrong = "maxbotix:/dev/ttyUSB0?model=hlrv".parse::<Uri<Sonar>>().unwrap_err();
//! assert!(wrong.to_string().ends_with(r#"found "hlrv""#));
//! # Ok::<(), mobot_cli::uri::UriError>(())
//! ```

mod again;
mod base;
mod boxed;
mod camera;
mod finder;
mod open;
mod options;
mod origin;
mod sonar;
mod tapes;
mod turret;

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use thiserror::Error;

pub use base::Base;
pub(crate) use base::arduino_params;
pub use boxed::{BoxedBase, BoxedCamera, BoxedClock, BoxedSonar};
pub use camera::Camera;
pub(crate) use finder::open_sonar;
pub use open::{Opened, open, open_guarded_by};
pub(crate) use open::{open_base, open_camera};
pub use options::Options;
pub use sonar::{Sonar, SonarKind};
pub(crate) use sonar::{address, model};
pub(crate) use tapes::Tapes;
pub use turret::Turret;

/// Why a device URI was refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum UriError {
    /// No such device.
    #[error("expected {expected}, found {found:?}")]
    Scheme {
        /// What there is.
        expected: &'static str,
        /// What was typed.
        found: String,
    },
    /// Something is missing after the colon, or too much is there.
    #[error("{scheme}: expected {expected}, found {found:?}")]
    Place {
        /// The device.
        scheme: String,
        /// What belongs there.
        expected: &'static str,
        /// What was typed.
        found: String,
    },
    /// The device has no such option.
    #[error("{scheme}: expected options {expected}, found {found:?}")]
    Unknown {
        /// The device.
        scheme: String,
        /// What there is, or "none".
        expected: String,
        /// What was typed.
        found: String,
    },
    /// An option cannot have this value.
    #[error("{key}: expected {expected}, found {found:?}")]
    Value {
        /// The option.
        key: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What was typed.
        found: String,
    },
}

/// A device of some role, as it was typed.
#[derive(Debug, Clone, PartialEq)]
pub struct Uri<D> {
    /// What was typed.
    pub text: String,
    /// Its calls are recorded into this file.
    pub record: Option<PathBuf>,
    /// The device.
    pub device: D,
}

impl<D> fmt::Display for Uri<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// What a device URI says, before anybody knows the device.
#[derive(Debug)]
pub struct Parts<'a> {
    /// Before the colon.
    pub scheme: &'a str,
    /// Between the colon and the question mark; `None` where there is no colon.
    pub place: Option<&'a str>,
    /// After the question mark.
    pub options: Options,
}

impl Parts<'_> {
    /// The place, where it must name something.
    ///
    /// # Errors
    /// [`UriError::Place`]
    pub fn named(&self, expected: &'static str) -> Result<String, UriError> {
        match self.place {
            Some(place) if !place.is_empty() => Ok(place.to_owned()),
            other => Err(UriError::Place {
                scheme: self.scheme.to_owned(),
                expected,
                found: other.unwrap_or_default().to_owned(),
            }),
        }
    }

    /// Refuses a place where none belongs.
    ///
    /// # Errors
    /// [`UriError::Place`]
    pub fn unnamed(&self) -> Result<(), UriError> {
        match self.place {
            None | Some("") => Ok(()),
            Some(found) => Err(UriError::Place {
                scheme: self.scheme.to_owned(),
                expected: "nothing after the colon",
                found: found.to_owned(),
            }),
        }
    }
}

/// What devices can be typed for.
pub trait Role: Sized {
    /// The schemes, for messages.
    const EXPECTED: &'static str;

    /// The device of these parts; `None` where no device has this scheme.
    ///
    /// # Errors
    /// [`UriError`] where the place or an option is wrong.
    fn read(parts: &mut Parts<'_>) -> Result<Option<Self>, UriError>;
}

impl<D: Role> FromStr for Uri<D> {
    type Err = UriError;

    fn from_str(text: &str) -> Result<Self, UriError> {
        let no_scheme = |found: &str| UriError::Scheme {
            expected: D::EXPECTED,
            found: found.to_owned(),
        };
        let (record, device) = match text.strip_prefix("record:") {
            None => (None, text),
            Some(rest) => {
                let (file, device) = rest
                    .split_once(',')
                    .filter(|(file, _)| !file.is_empty())
                    .ok_or_else(|| UriError::Place {
                        scheme: "record".to_owned(),
                        expected: "FILE,DEVICE",
                        found: rest.to_owned(),
                    })?;
                (Some(PathBuf::from(file)), device)
            }
        };
        let (head, options) = match device.split_once('?') {
            Some((head, options)) => (head, Options::parse(options)?),
            None => (device, Options::default()),
        };
        let (scheme, place) = match head.split_once(':') {
            Some((scheme, place)) => (scheme, Some(place)),
            None => (head, None),
        };
        let mut parts = Parts {
            scheme,
            place,
            options,
        };
        let device = D::read(&mut parts)?.ok_or_else(|| no_scheme(head))?;
        parts.options.finish(scheme)?;
        Ok(Self {
            text: text.to_owned(),
            record,
            device,
        })
    }
}

/// A serial line to a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SerialLine {
    /// The port, best by its stable name.
    pub port: String,
    /// Baud rate.
    pub baud: u32,
}

impl SerialLine {
    fn read(parts: &mut Parts<'_>, baud: u32) -> Result<Self, UriError> {
        let port = parts.named("a port, as in /dev/ttyUSB0")?;
        let expected = "a baud rate of 1 or more";
        let rate = parts.options.take("baud", expected, |text| {
            text.parse().ok().filter(|rate| *rate > 0)
        })?;
        Ok(Self {
            port,
            baud: rate.unwrap_or(baud),
        })
    }
}
