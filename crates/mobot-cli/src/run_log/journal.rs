//! The mission's loop writes here: what happened as ROS messages, what was decided as decisions. A run from
//! a log hands its decisions to a check instead.

use mobot_hw::Twist2;
use occgrid::Pose2;

use super::decision::{Decision, DecisionCheck, Verdict};
use super::write::{Level, LogWriter};
use crate::nav::{Entry, Event, RunLog, StopCause};

impl RunLog for &LogWriter {
    fn record(&mut self, time: f64, entry: Entry<'_>) {
        match entry {
            Entry::Now(now) => self.tick(now),
            Entry::Ping(sounding) => self.range(&sounding.ping),
            Entry::Frame(frame) => self.frame(frame),
            Entry::Pose(estimate) => {
                self.pose(time, estimate.map_from_base, &estimate.covariance);
            }
            Entry::Odometry(odom_from_base) => self.moved(time, odom_from_base),
            Entry::Route(points) => self.path(time, points),
            Entry::Map(map) => self.map(time, map),
            Entry::Event(event) => {
                let (level, name) = told(event);
                self.event(time, level, name, &event.to_string());
            }
            _ => {}
        }
        if let Some(decision) = Decision::of(time, &entry) {
            self.decision(&decision);
        }
    }
}

/// How loud an event is, and what it is called.
fn told(event: &Event) -> (Level, &'static str) {
    match event {
        Event::Stop(StopCause::Wanted(_)) => (Level::Info, "stop"),
        Event::Stop(_) => (Level::Warn, "stop"),
        Event::Go => (Level::Info, "go"),
        Event::Resumed => (Level::Info, "resumed"),
        Event::Fault(..) => (Level::Warn, "fault"),
        Event::Healthy(_) => (Level::Info, "healthy"),
        Event::Planned { .. } => (Level::Info, "route"),
        Event::Confidence(_) => (Level::Warn, "pose"),
        _ => (Level::Info, "note"),
    }
}

impl Decision {
    /// What an entry of the mission decides; `None` for what devices said, which a replay gives back.
    #[must_use]
    pub fn of(time: f64, entry: &Entry<'_>) -> Option<Self> {
        let (kind, numbers, text) = match entry {
            Entry::Pose(estimate) => {
                let Pose2 { x, y, theta } = estimate.map_from_base;
                let mut numbers = vec![x, y, theta];
                numbers.extend(estimate.covariance.as_flattened());
                ("pose", numbers, format!("{:?}", estimate.confidence))
            }
            Entry::Odometry(Pose2 { x, y, theta }) => {
                ("odometry", vec![*x, *y, *theta], String::new())
            }
            Entry::Correction(correction) => {
                let numbers = vec![correction.nis, correction.freedom as f64];
                let text = format!("{:?} accepted {}", correction.cue, correction.accepted);
                ("correction", numbers, text)
            }
            Entry::Command(Twist2 { linear, angular }) => {
                ("command", vec![*linear, *angular], String::new())
            }
            Entry::Route(points) => {
                let numbers = points.iter().flat_map(|p| [p.x, p.y]).collect();
                ("route", numbers, String::new())
            }
            Entry::Map(map) => {
                let frame = map.frame();
                let Pose2 { x, y, theta } = frame.origin();
                let (width, height) = (f64::from(frame.width()), f64::from(frame.height()));
                let numbers = vec![width, height, frame.resolution(), x, y, theta];
                let mut checksum = crc32fast::Hasher::new();
                for odds in map.log_odds() {
                    checksum.update(&odds.to_le_bytes());
                }
                let text = format!("log-odds {:08x}", checksum.finalize());
                ("map", numbers, text)
            }
            Entry::Event(event) => ("event", Vec::new(), event.to_string()),
            _ => return None,
        };
        Some(Self {
            kind: kind.into(),
            time,
            numbers,
            text,
        })
    }
}

impl<I: Iterator<Item = Decision>> RunLog for DecisionCheck<I> {
    fn record(&mut self, time: f64, entry: Entry<'_>) {
        if let Some(decision) = Decision::of(time, &entry) {
            self.made(decision);
        }
    }
}

impl Verdict {
    /// Whether nothing differed, and there was something to differ.
    #[must_use]
    pub const fn is_equal(&self) -> bool {
        self.difference.is_none() && self.equal > 0
    }
}
