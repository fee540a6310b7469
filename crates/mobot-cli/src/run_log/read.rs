//! Reading a run: its messages, its calls, its decisions.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use thiserror::Error;

use super::call::CallRecord;
use super::cdr::{CdrError, from_bytes};
use super::decision::{Decision, Input};
use super::mcap::{LoggedMessage, McapError, McapReader};
use super::ros::{self, Topic};

/// Why a run log is not read, or not to its end.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LogError {
    /// The file.
    #[error(transparent)]
    File(#[from] McapError),
    /// A message.
    #[error("message {sequence} on {topic}: {cause}")]
    Message {
        /// Its topic, control characters escaped.
        topic: String,
        /// Its number on the topic.
        sequence: u32,
        /// What is wrong with it.
        cause: CdrError,
    },
    /// A call that says nothing.
    #[error("call {sequence}: expected a call of a device and its answer, found {found}")]
    Call {
        /// Its number.
        sequence: u32,
        /// What it says instead.
        found: String,
    },
}

/// What a message is. Of other topics, and of these topics with other types, only the bytes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Message {
    /// `/pose`
    Pose(Box<ros::PoseWithCovarianceStamped>),
    /// `/odom`
    Odometry(Box<ros::Odometry>),
    /// `/sonar`
    Range(ros::Range),
    /// `/plan`
    Path(ros::Path),
    /// `/map`
    Map(ros::OccupancyGrid),
    /// `/camera/image_raw/compressed`
    Frame(ros::CompressedImage),
    /// `/tf`
    Tf(ros::TFMessage),
    /// `/rosout`
    Event(ros::Log),
    /// `/mobot/calls`
    Call(CallRecord),
    /// `/mobot/decisions`
    Decision(Decision),
    /// `/mobot/inputs`
    Input(Input),
    /// Anything else.
    Other(LoggedMessage),
}

/// A message and its times.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// When it was written [ns since 1970].
    pub logged: u64,
    /// When it was true [ns since 1970].
    pub published: u64,
    /// The message.
    pub message: Message,
}

/// The entries of a run log in the order in which they were written. A log of a run that was killed ends
/// with what reached the disk.
#[derive(Debug)]
pub struct LogReader<R> {
    messages: McapReader<R>,
}

impl LogReader<BufReader<File>> {
    /// Opens a file.
    ///
    /// # Errors
    /// [`LogError::File`]
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let file = File::open(path).map_err(McapError::Io)?;
        Self::new(BufReader::with_capacity(1 << 16, file))
    }
}

impl<R: Read> LogReader<R> {
    /// Reads from anything that gives bytes, best in large pieces.
    ///
    /// # Errors
    /// [`LogError::File`]
    pub fn new(source: R) -> Result<Self, LogError> {
        let messages = McapReader::new(source)?;
        Ok(Self { messages })
    }

    /// Whether the file ends before its end was written, as far as it was read.
    #[must_use]
    pub const fn is_cut_off(&self) -> bool {
        self.messages.is_cut_off()
    }
}

impl<R: Read> Iterator for LogReader<R> {
    type Item = Result<Entry, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        let message = self.messages.next()?;
        Some(message.map_err(LogError::File).and_then(entry))
    }
}

fn entry(logged: LoggedMessage) -> Result<Entry, LogError> {
    Ok(Entry {
        logged: logged.logged,
        published: logged.published,
        message: message(logged)?,
    })
}

fn message(logged: LoggedMessage) -> Result<Message, LogError> {
    macro_rules! one_of {
        ($($kind:ty => $variant:ident),* $(,)?) => {$(
            if &*logged.topic == <$kind>::TOPIC && &*logged.schema == <$kind>::TYPE {
                return from_bytes::<$kind>(&logged.data)
                    .map(|message| Message::$variant(message.into()))
                    .map_err(|cause| LogError::Message {
                        topic: <$kind>::TOPIC.into(),
                        sequence: logged.sequence,
                        cause,
                    });
            }
        )*};
    }
    one_of!(
        CallRecord => Call,
        Decision => Decision,
        Input => Input,
        ros::PoseWithCovarianceStamped => Pose,
        ros::Odometry => Odometry,
        ros::Range => Range,
        ros::Path => Path,
        ros::OccupancyGrid => Map,
        ros::CompressedImage => Frame,
        ros::TFMessage => Tf,
        ros::Log => Event,
    );
    Ok(Message::Other(logged))
}
