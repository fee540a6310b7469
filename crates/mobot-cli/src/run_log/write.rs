//! Writing a run down while it happens.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path as FilePath;
use std::sync::{Mutex, MutexGuard, PoisonError};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};
use mobot_hw::wrap::{Answer, Call, Sink};
use mobot_hw::{CameraFrame, Ping, Twist2};
use occgrid::{OccupancyGrid, Point2, Pose2, Reading};

use super::call::CallRecord;
use super::cdr::{definition, to_bytes};
use super::decision::{Decision, Input};
use super::mcap::{ChannelInfo, MAX_RECORD, McapWriter};
use super::ros::{self, Header, Pose, PoseWithCovariance, Time, Topic};
use super::stamps::{Stamps, WallTime};

/// Records wait this long at most [s of the run].
const FLUSH_EVERY: f64 = 0.2;
/// A chunk of this size goes out at once [bytes].
const CHUNK: usize = 1 << 20;
/// Most cells of a map in a log; a larger one is left out.
const MAX_CELLS: usize = MAX_RECORD / 2;

/// The sonar, as others are to draw it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SonarFrame {
    /// Whole width of the beam [rad].
    pub beam: f64,
    /// Nearest range it tells [m].
    pub min_range: f64,
    /// Farthest range it tells [m].
    pub max_range: f64,
    /// Pose of its axle in the base frame, its heading that of bearing 0.
    pub base_from_sonar: Pose2,
}

impl Default for SonarFrame {
    /// 18 degrees, 0.2 to 5 m, in the middle of the base.
    fn default() -> Self {
        Self {
            beam: 18.0_f64.to_radians(),
            min_range: 0.2,
            max_range: 5.0,
            base_from_sonar: Pose2::default(),
        }
    }
}

/// How a run is written down.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LogParams {
    /// Where stamps come from.
    pub stamps: Stamps,
    /// How shots are drawn.
    pub sonar: SonarFrame,
}

/// How loud an event is, as in ROS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Level {
    /// For the curious.
    Debug = 10,
    /// As planned.
    Info = 20,
    /// Not as planned: a stop, a device that failed.
    Warn = 30,
    /// The mission is in doubt.
    Error = 40,
}

/// Writes a run down. It never fails the run: a log that cannot write keeps its first error, drops what
/// comes, and says so when it is asked or finished. Times are those of the run's clock [s]. Shared by
/// reference; a lock inside.
pub struct LogWriter {
    state: Mutex<State>,
}

struct State {
    params: LogParams,
    /// `None` after an error.
    file: Option<McapWriter<Box<dyn Write + Send>>>,
    fault: Option<io::Error>,
    channels: BTreeMap<&'static str, u16>,
    wall: WallTime,
    flushed: f64,
    /// The last pose by the wheels, and when.
    moved: Option<(f64, Pose2)>,
    /// How many decisions there were.
    decided: u64,
    /// Stamp and number of the last picture: one that comes twice is written once.
    pictured: Option<(u64, u64)>,
}

impl std::fmt::Debug for LogWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let state = self.state();
        f.debug_struct("LogWriter")
            .field("fault", &state.fault)
            .finish_non_exhaustive()
    }
}

impl LogWriter {
    /// A new file; one of that name is replaced.
    ///
    /// # Errors
    /// If the file cannot be made or written.
    pub fn create(path: &FilePath, params: LogParams) -> io::Result<Self> {
        Self::to(Box::new(File::create(path)?), params)
    }

    /// To anything that takes bytes, in few large pieces.
    ///
    /// # Errors
    /// If the first bytes cannot be written.
    pub fn to(out: Box<dyn Write + Send>, params: LogParams) -> io::Result<Self> {
        let library = concat!("mobot ", env!("CARGO_PKG_VERSION"));
        let file = McapWriter::new(out, "ros2", library)?;
        Ok(Self {
            state: Mutex::new(State {
                params,
                file: Some(file),
                fault: None,
                channels: BTreeMap::new(),
                wall: WallTime::new(params.stamps),
                flushed: f64::NEG_INFINITY,
                moved: None,
                decided: 0,
                pictured: None,
            }),
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A control step begins at `now`. What has waited long enough goes to disk.
    pub fn tick(&self, now: f64) {
        self.state().tick(now);
    }

    /// Where the robot is thought to be: `/pose`, and `map` to `base_link` in `/tf`. Covariance of x, y,
    /// theta.
    pub fn pose(&self, time: f64, map_from_base: Pose2, covariance: &[[f64; 3]; 3]) {
        let mut state = self.state();
        let header = state.header(time, "map");
        let pose = PoseWithCovariance::of(map_from_base, covariance);
        state.write(time, &ros::PoseWithCovarianceStamped { header, pose });
        state.transform(time, ["map", "base_link"], map_from_base);
    }

    /// Where the wheels have carried the robot, and how it moves.
    pub fn odometry(&self, time: f64, odom_from_base: Pose2, twist: Twist2) {
        let mut state = self.state();
        let message = ros::Odometry {
            header: state.header(time, "odom"),
            child_frame_id: "base_link".into(),
            pose: PoseWithCovariance::of(odom_from_base, &[[0.0; 3]; 3]),
            twist: ros::TwistWithCovariance {
                twist: ros::Twist::of(twist),
                covariance: [0.0; 36],
            },
        };
        state.write(time, &message);
    }

    /// Where the wheels have carried the robot; its velocity is that since the last word.
    pub(super) fn moved(&self, time: f64, odom_from_base: Pose2) {
        let before = self.state().moved.replace((time, odom_from_base));
        let twist = before.map_or(Twist2::default(), |(then, before)| {
            let step = before.inverse().compose(odom_from_base);
            let seconds = time - then;
            if seconds > 0.0 {
                Twist2::new(step.x / seconds, step.theta / seconds)
            } else {
                Twist2::default()
            }
        });
        self.odometry(time, odom_from_base, twist);
    }

    /// A shot: `/sonar`, and where the sonar looked in `/tf`.
    pub fn range(&self, ping: &Ping) {
        let mut state = self.state();
        let SonarFrame {
            beam,
            min_range,
            max_range,
            base_from_sonar,
        } = state.params.sonar;
        let range = match ping.reading {
            Reading::Echo { range } => range as f32,
            Reading::NoEcho { .. } => f32::INFINITY,
            Reading::TooClose => f32::NEG_INFINITY,
            Reading::Fault => f32::NAN,
        };
        let aimed = Pose2 {
            theta: base_from_sonar.theta + ping.bearing,
            ..base_from_sonar
        };
        state.transform(ping.stamp, ["base_link", "sonar_link"], aimed);
        let message = ros::Range {
            header: state.header(ping.stamp, "sonar_link"),
            radiation_type: 0,
            field_of_view: beam as f32,
            min_range: min_range as f32,
            max_range: max_range as f32,
            range,
            variance: 0.0,
        };
        state.write(ping.stamp, &message);
    }

    /// A picture, without loss. One that was just written is not written again.
    pub fn frame(&self, frame: &CameraFrame) {
        self.state().frame(frame);
    }

    /// The map so far. Above 32 million cells it is left out, and an event says so.
    pub fn map(&self, time: f64, map: &OccupancyGrid) {
        let frame = map.frame();
        if frame.cell_count() > MAX_CELLS {
            let text = format!("map of {} cells left out", frame.cell_count());
            return self.event(time, Level::Warn, "log", &text);
        }
        let width = frame.width() as usize;
        let percent = |odds: &f32| {
            if *odds == 0.0 {
                return -1;
            }
            let p = 1.0 / (1.0 + (-f64::from(*odds)).exp());
            (p * 100.0).round() as i8
        };
        let rows = map.log_odds().chunks_exact(width).rev();
        let mut state = self.state();
        let header = state.header(time, "map");
        let message = ros::OccupancyGrid {
            info: ros::MapMetaData {
                map_load_time: header.stamp.clone(),
                resolution: frame.resolution() as f32,
                width: frame.width(),
                height: frame.height(),
                origin: Pose::of(frame.origin()),
            },
            header,
            data: rows.flatten().map(percent).collect(),
        };
        state.write(time, &message);
    }

    /// The way to go, map frame [m]. Poses look along it.
    pub fn path(&self, time: f64, points: &[Point2]) {
        let mut state = self.state();
        let header = state.header(time, "map");
        let mut theta = 0.0;
        let pose = |(i, point): (usize, &Point2)| {
            if let Some(next) = points.get(i + 1) {
                theta = f64::atan2(next.y - point.y, next.x - point.x);
            }
            ros::PoseStamped {
                header: header.clone(),
                pose: Pose::of(Pose2::new(point.x, point.y, theta)),
            }
        };
        let poses = points.iter().enumerate().map(pose).collect();
        state.write(time, &ros::Path { header, poses });
    }

    /// Where a frame is in another.
    pub fn tf(&self, time: f64, parent: &str, child: &str, parent_from_child: Pose2) {
        self.state()
            .transform(time, [parent, child], parent_from_child);
    }

    /// Something happened: who says so, and what.
    pub fn event(&self, time: f64, level: Level, name: &str, text: &str) {
        let mut state = self.state();
        let message = ros::Log {
            stamp: Time::of(state.wall.of(time)),
            level: level as u8,
            name: name.into(),
            msg: text.into(),
            file: String::new(),
            function: String::new(),
            line: 0,
        };
        state.write(time, &message);
    }

    /// A decision, to be compared byte for byte.
    pub fn decision(&self, decision: &Decision) {
        let mut state = self.state();
        state.decided += 1;
        state.write(decision.time, decision);
    }

    /// How many decisions there were.
    #[must_use]
    pub fn decided(&self) -> u64 {
        self.state().decided
    }

    /// Something that the run was given, at most 32 MiB; more is left out, and an event says so.
    pub fn input(&self, name: &str, data: &[u8]) {
        if data.len() > MAX_RECORD / 2 {
            let text = format!("input {name} of {} bytes left out", data.len());
            return self.event(0.0, Level::Warn, "log", &text);
        }
        let input = Input {
            name: name.into(),
            data: data.to_vec(),
        };
        self.state().write(f64::NAN, &input);
    }

    /// Why the log holds no more since some time.
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        self.state().fault.as_ref().map(ToString::to_string)
    }

    /// Sends out what waits.
    pub fn flush(&self) {
        self.state().flush();
    }

    /// Ends the file, so that readers find their way in it. Dropping does the same, silently.
    ///
    /// # Errors
    /// The first that there was since the file was made.
    pub fn finish(&self) -> io::Result<()> {
        let mut state = self.state();
        if let Some(fault) = state.fault.take() {
            return Err(fault);
        }
        let file = state.file.take();
        file.map_or(Ok(()), |file| file.finish().map(drop))
    }
}

impl Drop for LogWriter {
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

impl Sink for LogWriter {
    /// The call to the bit, and its picture if it gave one.
    fn take(&self, call: Call) {
        let mut state = self.state();
        if let Answer::Now(now) = call.answer {
            state.flush_at(now);
        }
        if let Answer::Frame(frame) = &call.answer {
            state.frame(frame);
        }
        if let Some(record) = CallRecord::of(&call) {
            state.write(f64::NAN, &record);
        }
    }
}

impl State {
    fn tick(&mut self, now: f64) {
        self.wall.tick(now);
        self.flush_at(now);
    }

    /// A time that goes back or is none flushes, too.
    fn flush_at(&mut self, now: f64) {
        let waited = now - self.flushed;
        if !(0.0..FLUSH_EVERY).contains(&waited) {
            self.flushed = now;
            self.flush();
        }
    }

    fn flush(&mut self) {
        if let Some(file) = &mut self.file
            && let Err(error) = file.flush()
        {
            self.fault = Some(error);
            self.file = None;
        }
    }

    fn header(&self, time: f64, frame: &str) -> Header {
        Header {
            stamp: Time::of(self.wall.of(time)),
            frame_id: frame.into(),
        }
    }

    fn write<T: Topic>(&mut self, time: f64, message: &T) {
        let (now, then) = (self.wall.now(), self.wall.of(time));
        let Some(file) = &mut self.file else { return };
        let channel = *self.channels.entry(T::TOPIC).or_insert_with(|| {
            file.channel(&ChannelInfo {
                topic: T::TOPIC,
                schema: T::TYPE,
                definition: &definition::<T>(),
            })
        });
        let bytes = to_bytes(message);
        if file.waiting() > 0 && file.waiting() + bytes.len() > CHUNK {
            self.flush();
        }
        if let Some(file) = &mut self.file {
            file.message(channel, now, then, &bytes);
        }
    }

    fn transform(&mut self, time: f64, [parent, child]: [&str; 2], parent_from_child: Pose2) {
        let pose = Pose::of(parent_from_child);
        let transform = ros::TransformStamped {
            header: self.header(time, parent),
            child_frame_id: child.into(),
            transform: ros::Transform {
                translation: ros::Vector3 {
                    x: pose.position.x,
                    y: pose.position.y,
                    z: pose.position.z,
                },
                rotation: pose.orientation,
            },
        };
        let transforms = vec![transform];
        self.write(time, &ros::TFMessage { transforms });
    }

    fn frame(&mut self, frame: &CameraFrame) {
        let key = (frame.stamp.to_bits(), frame.sequence);
        if self.file.is_none() || self.pictured == Some(key) {
            return;
        }
        let mut data = Vec::new();
        let (width, height) = frame.image.dimensions();
        // little compression: the loop waits for it
        let encoder =
            PngEncoder::new_with_quality(&mut data, CompressionType::Fast, FilterType::Avg);
        let written =
            encoder.write_image(frame.image.as_raw(), width, height, ExtendedColorType::L8);
        if written.is_err() || data.len() > MAX_RECORD / 2 {
            return;
        }
        self.pictured = Some(key);
        let message = ros::CompressedImage {
            header: self.header(frame.stamp, "camera_optical_frame"),
            format: "png".into(),
            data,
        };
        self.write(frame.stamp, &message);
    }
}
