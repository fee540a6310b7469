//! Times when the machine had no time for this process: what they delay says nothing of the guard.

use std::sync::Mutex;
use std::time::{Duration, Instant};

/// A thread that sleeps for a millisecond or two and wakes this much later was kept from running.
const STALL: Duration = Duration::from_millis(20);

static STALLS: Mutex<Vec<[Instant; 2]>> = Mutex::new(Vec::new());

/// Watches for stalls as long as the process lives.
pub(crate) fn watch() {
    std::thread::spawn(|| {
        let mut before = Instant::now();
        loop {
            std::thread::sleep(Duration::from_millis(2));
            let now = Instant::now();
            if now - before > STALL {
                STALLS.lock().expect("a list").push([before, now]);
            }
            before = now;
        }
    });
}

/// Whether there was one since a time.
pub(crate) fn since(time: Instant) -> bool {
    // one that is just over may not be in the list yet
    std::thread::sleep(Duration::from_millis(4));
    let stalls = STALLS.lock().expect("a list");
    stalls.iter().rev().any(|[_, end]| *end > time)
}
