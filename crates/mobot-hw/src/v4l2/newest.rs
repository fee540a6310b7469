//! The newest frame of a queue that gives frames in order, however long nobody looked.

use std::time::Duration;

use rustix::io::{Errno, Result};

use crate::{FrameCounts, FrameFault};

/// Stamps may lie so far in the future [s]: drivers that reckon them are off by some milliseconds.
const AHEAD: f64 = 0.05;
/// Frames looked at without a break, more than any queue holds.
const DRAIN: usize = 64;
/// Rest where the queue says that there is something, and has nothing.
const REST: Duration = Duration::from_millis(1);

/// What a queue says of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct About {
    pub(super) damaged: bool,
    pub(super) sequence: u32,
    /// On the queue's clock [s]; none where the driver counts on another.
    pub(super) stamp: Option<f64>,
}

/// Gives filled buffers in order, and takes them back.
pub(super) trait FrameQueue {
    type Filled;
    /// `None` where there is no other frame yet.
    fn dequeue(&mut self) -> Result<Option<Self::Filled>>;
    fn requeue(&mut self, filled: Self::Filled) -> Result<()>;
    fn about(&self, filled: &Self::Filled) -> About;
    fn bytes<'a>(&'a self, filled: &'a Self::Filled) -> &'a [u8];
    /// Returns when there may be a frame or a fault, or after `wait`.
    fn wait(&mut self, wait: Duration) -> Result<()>;
    /// All buffers are with the queue afterwards.
    fn restart(&mut self) -> Result<()>;
    /// [s]
    fn now(&self) -> f64;
}

/// Why there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shortfall {
    Silent,
    Damaged(FrameFault),
    /// The age of the newest [s].
    Stale(f64),
    Gone,
    Failed(Errno),
}

#[derive(Debug, PartialEq)]
pub(super) struct Taken<T> {
    pub(super) picture: T,
    /// On the queue's clock [s].
    pub(super) stamp: f64,
    pub(super) sequence: u64,
}

#[derive(Debug, Default)]
pub(super) struct Newest {
    /// The driver's count of the last frame.
    last: Option<u32>,
    sequence: u64,
    pub(super) counts: FrameCounts,
}

/// How one call goes.
struct Search {
    fault: Option<FrameFault>,
    age: Option<f64>,
    restarted: bool,
    /// Frames without a stamp are fresh if the queue was empty since the call began.
    emptied: bool,
}

impl Newest {
    /// The newest frame not above `max_age` [s], waited for `timeout` [s] at most. A queue that fails is restarted
    /// once.
    pub(super) fn take<Q: FrameQueue, T>(
        &mut self,
        queue: &mut Q,
        timeout: f64,
        max_age: f64,
        mut decode: impl FnMut(&[u8]) -> std::result::Result<T, FrameFault>,
    ) -> std::result::Result<Taken<T>, Shortfall> {
        let deadline = queue.now() + timeout;
        let mut search = Search {
            fault: None,
            age: None,
            restarted: false,
            emptied: false,
        };
        loop {
            let result = self.look(queue, max_age, &mut search, &mut decode);
            let result = result.and_then(|taken| {
                let left = deadline - queue.now();
                if taken.is_none() && left > 0.0 {
                    queue.wait(Duration::try_from_secs_f64(left).unwrap_or_default())?;
                }
                Ok(taken)
            });
            match result {
                Ok(Some(taken)) => return Ok(taken),
                Ok(None) => {}
                Err(error) => self.recover(queue, error, &mut search)?,
            }
            if queue.now() >= deadline {
                return Err(match (search.fault, search.age) {
                    (Some(fault), _) => Shortfall::Damaged(fault),
                    (None, Some(age)) => Shortfall::Stale(age),
                    (None, None) => Shortfall::Silent,
                });
            }
        }
    }

    fn recover<Q: FrameQueue>(
        &mut self,
        queue: &mut Q,
        error: Errno,
        search: &mut Search,
    ) -> std::result::Result<(), Shortfall> {
        let failed = |error| match error {
            Errno::NODEV | Errno::NXIO => Shortfall::Gone,
            error => Shortfall::Failed(error),
        };
        if search.restarted || failed(error) == Shortfall::Gone {
            return Err(failed(error));
        }
        search.restarted = true;
        self.last = None;
        queue.restart().map_err(failed)
    }

    /// Takes what waits in the queue, and of that the last good frame.
    fn look<Q: FrameQueue, T>(
        &mut self,
        queue: &mut Q,
        max_age: f64,
        search: &mut Search,
        decode: &mut impl FnMut(&[u8]) -> std::result::Result<T, FrameFault>,
    ) -> Result<Option<Taken<T>>> {
        let mut newest = None;
        let mut seen = 0;
        while seen < DRAIN
            && let Some(filled) = queue.dequeue()?
        {
            seen += 1;
            let about = queue.about(&filled);
            self.count(about.sequence);
            if about.damaged {
                search.fault = Some(FrameFault::Flagged);
                self.counts.damaged += 1;
                queue.requeue(filled)?;
            } else if let Some((older, ..)) = newest.replace((filled, about, self.sequence)) {
                self.counts.passed_over += 1;
                queue.requeue(older)?;
            }
        }
        let emptied = std::mem::replace(&mut search.emptied, true);
        let Some((filled, about, sequence)) = newest else {
            if emptied && seen == 0 {
                std::thread::sleep(REST);
            }
            return Ok(None);
        };
        let stamp = about.stamp.unwrap_or_else(|| queue.now());
        let age = queue.now() - stamp;
        let decoded = if age < -AHEAD {
            Err(FrameFault::Future { ahead: -age })
        } else if age > max_age || (about.stamp.is_none() && !emptied) {
            search.age = Some(age);
            self.counts.passed_over += 1;
            queue.requeue(filled)?;
            return Ok(None);
        } else {
            decode(queue.bytes(&filled))
        };
        queue.requeue(filled)?;
        match decoded {
            Ok(picture) => {
                self.counts.given += 1;
                let stamp = stamp.min(queue.now());
                Ok(Some(Taken {
                    picture,
                    stamp,
                    sequence,
                }))
            }
            Err(fault) => {
                self.counts.damaged += 1;
                search.fault = Some(fault);
                Ok(None)
            }
        }
    }

    /// Counts on in 64 bits. A count that goes back, or stands, was begun anew.
    fn count(&mut self, sequence: u32) {
        let step = match self.last {
            Some(last) => match sequence.wrapping_sub(last) {
                step @ 1..=0x7FFF_FFFF => u64::from(step),
                _ => 1,
            },
            None => 1,
        };
        self.last = Some(sequence);
        self.sequence += step;
        self.counts.missed += step - 1;
    }
}

#[cfg(test)]
#[path = "newest_tests.rs"]
mod tests;
