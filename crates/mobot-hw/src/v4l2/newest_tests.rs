//! The newest frame, from a queue made of plans, in virtual time.

use std::collections::VecDeque;
use std::time::Duration;

use rustix::io::{Errno, Result};

use super::*;

#[derive(Debug, Clone, Copy)]
struct Plan {
    at: f64,
    about: About,
    byte: u8,
}

struct Filled {
    plan: Plan,
    byte: [u8; 1],
    slot: usize,
}

/// Has so many buffers: what comes while all are filled is dropped, as drivers do.
struct Fake {
    now: f64,
    plans: VecDeque<Plan>,
    filled: VecDeque<(usize, Plan)>,
    free: Vec<usize>,
    taken: Vec<usize>,
    /// Errors of the next calls to dequeue.
    errors: VecDeque<Errno>,
    restarts: u32,
    restart_fails: Option<Errno>,
    calls: u32,
}

impl Fake {
    fn new(plans: impl IntoIterator<Item = Plan>) -> Self {
        Self {
            now: 0.0,
            plans: plans.into_iter().collect(),
            filled: VecDeque::new(),
            free: vec![0, 1, 2, 3],
            taken: Vec::new(),
            errors: VecDeque::new(),
            restarts: 0,
            restart_fails: None,
            calls: 0,
        }
    }

    /// Frames every 33 ms from 0.033 s on.
    fn steady(count: u32) -> Self {
        Self::new((1..=count).map(|n| plan(n, f64::from(n) * 0.033)))
    }

    fn advance(&mut self, to: f64) {
        while self.plans.front().is_some_and(|plan| plan.at <= to) {
            let plan = self.plans.pop_front().expect("a plan");
            if let Some(slot) = self.free.pop() {
                self.filled.push_back((slot, plan));
            }
        }
        self.now = to;
    }
}

fn plan(sequence: u32, at: f64) -> Plan {
    Plan {
        at,
        about: About {
            damaged: false,
            sequence,
            stamp: Some(at - 0.001),
        },
        byte: (sequence & 0x7F) as u8,
    }
}

impl FrameQueue for Fake {
    type Filled = Filled;

    fn dequeue(&mut self) -> Result<Option<Filled>> {
        self.calls += 1;
        assert!(self.calls < 100_000, "it spins");
        if let Some(error) = self.errors.pop_front() {
            return Err(error);
        }
        Ok(self.filled.pop_front().map(|(slot, plan)| {
            self.taken.push(slot);
            Filled {
                plan,
                byte: [plan.byte],
                slot,
            }
        }))
    }

    fn requeue(&mut self, filled: Filled) -> Result<()> {
        let place = self.taken.iter().position(|slot| *slot == filled.slot);
        self.taken.remove(place.expect("taken"));
        self.free.push(filled.slot);
        Ok(())
    }

    fn about(&self, filled: &Filled) -> About {
        filled.plan.about
    }

    fn bytes<'a>(&'a self, filled: &'a Filled) -> &'a [u8] {
        &filled.byte
    }

    fn wait(&mut self, wait: Duration) -> Result<()> {
        let end = self.now + wait.as_secs_f64();
        let next = self.plans.front().map_or(end, |plan| plan.at.min(end));
        let ready = !self.filled.is_empty() || !self.errors.is_empty();
        self.advance(if ready { self.now } else { next });
        Ok(())
    }

    fn restart(&mut self) -> Result<()> {
        self.restarts += 1;
        self.filled.clear();
        self.taken.clear();
        self.free = vec![0, 1, 2, 3];
        self.restart_fails.take().map_or(Ok(()), Err)
    }

    fn now(&self) -> f64 {
        self.now
    }
}

fn take(newest: &mut Newest, queue: &mut Fake) -> std::result::Result<Taken<u8>, Shortfall> {
    let taken = newest.take(queue, 1.0, 0.1, |bytes| match bytes[0] {
        255 => Err(FrameFault::Undecodable),
        byte => Ok(byte),
    });
    // whatever came of it, no buffer is kept
    assert!(queue.taken.is_empty() && queue.free.len() + queue.filled.len() == 4);
    taken
}

#[test]
fn a_slow_consumer_gets_fresh_frames_and_a_true_count() {
    let mut queue = Fake::steady(1000);
    let mut newest = Newest::default();
    let first = take(&mut newest, &mut queue).unwrap();
    assert_eq!((first.picture, first.sequence), (1, 1));
    // four wait, the newest of them more than 0.8 s old
    queue.advance(1.0);
    let next = take(&mut newest, &mut queue).unwrap();
    assert!(queue.now - next.stamp < 0.002);
    assert_eq!(next.picture, 31);
    assert_eq!(next.sequence, 31);
    let counts = newest.counts;
    assert_eq!(
        (counts.given, counts.passed_over, counts.missed),
        (2, 4, 25)
    );
    // a little late: the newest of two
    queue.advance(queue.now + 0.07);
    let next = take(&mut newest, &mut queue).unwrap();
    assert_eq!((next.sequence, newest.counts.passed_over), (33, 5));
}

#[test]
fn damaged_frames_are_passed_over() {
    let mut plans: Vec<_> = (1..=6).map(|n| plan(n, f64::from(n) * 0.033)).collect();
    plans[0].about.damaged = true;
    plans[1].byte = 255;
    plans[2].about.stamp = Some(plans[2].at + 0.2);
    plans[4].about.stamp = Some(plans[4].at + 0.03);
    let mut queue = Fake::new(plans);
    let mut newest = Newest::default();
    assert_eq!(take(&mut newest, &mut queue).unwrap().sequence, 4);
    assert_eq!(newest.counts.damaged, 3);
    // a little in the future is now
    let taken = take(&mut newest, &mut queue).unwrap();
    assert_eq!((taken.sequence, taken.stamp), (5, queue.now));
    // damaged ones only
    let mut plans: Vec<_> = (1..=3).map(|n| plan(n, f64::from(n) * 0.033)).collect();
    plans.iter_mut().for_each(|plan| plan.about.damaged = true);
    let mut queue = Fake::new(plans);
    let shortfall = take(&mut newest, &mut queue).unwrap_err();
    assert_eq!(shortfall, Shortfall::Damaged(FrameFault::Flagged));
    assert!((queue.now - 1.0).abs() < 1e-9, "{}", queue.now);
}

#[test]
fn silence_and_stale_frames_end_in_time() {
    let mut queue = Fake::new([]);
    let mut newest = Newest::default();
    assert_eq!(take(&mut newest, &mut queue), Err(Shortfall::Silent));
    assert!((queue.now - 1.0).abs() < 1e-9, "{}", queue.now);
    let mut queue = Fake::new((1..=60).map(|n| {
        let mut plan = plan(n, f64::from(n) * 0.033);
        plan.about.stamp = Some(plan.at - 0.5);
        plan
    }));
    let shortfall = take(&mut newest, &mut queue).unwrap_err();
    assert!(matches!(shortfall, Shortfall::Stale(age) if (age - 0.5).abs() < 1e-9));
    assert!((queue.now - 1.0).abs() < 1e-9, "{}", queue.now);
}

#[test]
fn without_stamps_only_what_was_waited_for_is_fresh() {
    let mut queue = Fake::new((1..=60).map(|n| {
        let mut plan = plan(n, f64::from(n) * 0.033);
        plan.about.stamp = None;
        plan
    }));
    let mut newest = Newest::default();
    assert_eq!(take(&mut newest, &mut queue).unwrap().sequence, 1);
    queue.advance(1.0);
    let taken = take(&mut newest, &mut queue).unwrap();
    assert_eq!((taken.picture, taken.stamp), (31, queue.now));
}

#[test]
fn a_failed_queue_is_restarted_once_a_call() {
    let mut queue = Fake::steady(1000);
    let mut newest = Newest::default();
    take(&mut newest, &mut queue).unwrap();
    queue.errors.push_back(Errno::IO);
    queue
        .plans
        .iter_mut()
        .for_each(|plan| plan.about.sequence -= 2); // counts anew
    let taken = take(&mut newest, &mut queue).unwrap();
    assert_eq!((taken.sequence, queue.restarts), (2, 1));
    queue.errors.extend([Errno::IO; 2]);
    let failed = Err(Shortfall::Failed(Errno::IO));
    assert_eq!(take(&mut newest, &mut queue), failed);
    assert_eq!(queue.restarts, 2);
    queue.errors.push_back(Errno::IO);
    queue.restart_fails = Some(Errno::INVAL);
    let failed = Err(Shortfall::Failed(Errno::INVAL));
    assert_eq!(take(&mut newest, &mut queue), failed);
    take(&mut newest, &mut queue).unwrap();
    queue.errors.push_back(Errno::NODEV);
    assert_eq!(take(&mut newest, &mut queue), Err(Shortfall::Gone));
    assert_eq!(queue.restarts, 3);
    queue.errors.push_back(Errno::IO);
    queue.restart_fails = Some(Errno::NODEV);
    assert_eq!(take(&mut newest, &mut queue), Err(Shortfall::Gone));
}

#[test]
fn the_count_goes_on_over_wraps_and_new_beginnings() {
    let drivers = [u32::MAX - 1, u32::MAX, 0, 3, 3, 0, 1];
    let mut queue = Fake::new(
        drivers
            .iter()
            .enumerate()
            .map(|(n, sequence)| plan(*sequence, 0.033 * (n + 1) as f64)),
    );
    let mut newest = Newest::default();
    let counts: Vec<u64> = drivers
        .iter()
        .map(|_| take(&mut newest, &mut queue).unwrap().sequence)
        .collect();
    assert_eq!(counts, [1, 2, 3, 6, 7, 8, 9]);
    assert_eq!(newest.counts.missed, 2);
}
