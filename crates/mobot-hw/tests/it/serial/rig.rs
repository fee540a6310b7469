//! A port in memory whose time passes only while it is read or waited for.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::rc::Rc;

use mobot_hw::Clock;
use mobot_hw::serial::{FrameFault, SerialError};

/// Reads of a port return after this long [s], as those of an opened one do.
const POLL: f64 = 0.005;

/// What a device answers: the time from now [s] and the bytes.
pub(crate) type Answer = Vec<(f64, Vec<u8>)>;

type Device = Box<dyn FnMut(&[u8]) -> Answer>;

struct State {
    now: f64,
    incoming: VecDeque<(f64, Vec<u8>)>,
    written: Vec<(f64, Vec<u8>)>,
    unplugged_at: f64,
    takes: usize,
    device: Device,
}

/// A port and its clock; clones are the same port.
#[derive(Clone)]
pub(crate) struct Rig(Rc<RefCell<State>>);

impl Rig {
    /// A port where nothing answers.
    pub(crate) fn silent() -> Self {
        Self::with(|_| Vec::new())
    }

    /// A port with a device that answers what is written.
    pub(crate) fn with(device: impl FnMut(&[u8]) -> Answer + 'static) -> Self {
        Self(Rc::new(RefCell::new(State {
            now: 0.0,
            incoming: VecDeque::new(),
            written: Vec::new(),
            unplugged_at: f64::INFINITY,
            takes: usize::MAX,
            device: Box::new(device),
        })))
    }

    /// Bytes that come at a time [s].
    pub(crate) fn comes(&self, at: f64, bytes: &[u8]) {
        let queue = &mut self.0.borrow_mut().incoming;
        let place = queue.partition_point(|(t, _)| *t <= at);
        queue.insert(place, (at, bytes.to_vec()));
    }

    /// Pulls the plug at a time [s].
    pub(crate) fn unplug(&self, at: f64) {
        self.0.borrow_mut().unplugged_at = at;
    }

    /// Each write takes at most so many bytes.
    pub(crate) fn takes(&self, bytes: usize) {
        self.0.borrow_mut().takes = bytes;
    }

    /// What was written, write by write.
    pub(crate) fn written(&self) -> Vec<Vec<u8>> {
        let state = self.0.borrow();
        state.written.iter().map(|(_, w)| w.clone()).collect()
    }

    /// What was written last.
    pub(crate) fn last(&self) -> Vec<u8> {
        self.written().pop().unwrap_or_default()
    }
}

impl Clock for Rig {
    fn now(&self) -> f64 {
        self.0.borrow().now
    }

    fn sleep(&mut self, seconds: f64) {
        self.0.borrow_mut().now += seconds.max(0.0);
    }
}

impl Read for Rig {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut state = self.0.borrow_mut();
        let due = state.incoming.front().map_or(f64::INFINITY, |f| f.0);
        let until = (state.now + POLL).min(due.max(state.now));
        if state.unplugged_at <= until {
            state.now = state.now.max(state.unplugged_at);
            return Err(ErrorKind::BrokenPipe.into());
        }
        state.now = until;
        if due > until {
            return Err(ErrorKind::TimedOut.into());
        }
        let mut read = 0;
        while read < bytes.len()
            && let Some((at, mut come)) = state.incoming.pop_front()
        {
            if at > until {
                state.incoming.push_front((at, come));
                break;
            }
            let rest = come.split_off(come.len().min(bytes.len() - read));
            bytes[read..read + come.len()].copy_from_slice(&come);
            read += come.len();
            if !rest.is_empty() {
                state.incoming.push_front((at, rest));
            }
        }
        Ok(read)
    }
}

impl Write for Rig {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut state = self.0.borrow_mut();
        if state.now >= state.unplugged_at {
            return Err(ErrorKind::BrokenPipe.into());
        }
        let now = state.now;
        let taken = &bytes[..bytes.len().min(state.takes)];
        state.written.push((now, taken.to_vec()));
        let answers = (state.device)(taken);
        drop(state);
        for (after, answer) in answers {
            self.comes(now + after, &answer);
        }
        Ok(taken.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What a call gave, and how long it took [s].
pub(crate) fn timed<T>(rig: &Rig, call: impl FnOnce() -> T) -> (T, f64) {
    let began = rig.now();
    let result = call();
    (result, rig.now() - began)
}

/// A call of a driver on a line that fails in each way: it names the way, in time. `garbage` are bytes that
/// are no answer; `opened` makes the driver and, where it needs one, a healthy beginning.
pub(crate) fn fails_in_time<D>(
    timeout: f64,
    garbage: &[u8],
    opened: impl Fn(&Rig) -> D,
    call: impl Fn(&mut D) -> Result<(), SerialError>,
) {
    let bound = 1.1 * timeout;

    let rig = Rig::silent();
    let mut driver = opened(&rig);
    let (result, took) = timed(&rig, || call(&mut driver));
    assert!(
        matches!(result, Err(SerialError::Silent { .. })),
        "{result:?}"
    );
    assert!(took <= bound, "silence took {took} s of {timeout} s");

    let rig = Rig::silent();
    let mut driver = opened(&rig);
    let began = rig.now();
    for k in 0..400 {
        rig.comes(began + 0.01 * f64::from(k), garbage);
    }
    let (result, took) = timed(&rig, || call(&mut driver));
    assert!(
        matches!(result, Err(SerialError::Garbled { .. })),
        "{result:?}"
    );
    assert!(took <= bound, "garbage took {took} s of {timeout} s");

    for after in [0.0, 0.03, 0.071, 0.5 * timeout] {
        let rig = Rig::silent();
        let mut driver = opened(&rig);
        let began = rig.now();
        rig.comes(began + after - 0.001, &garbage[..1]);
        rig.unplug(began + after);
        let (result, took) = timed(&rig, || call(&mut driver));
        assert_eq!(result, Err(SerialError::Unplugged));
        assert!(took <= bound, "unplug took {took} s of {timeout} s");
    }
}

/// That a result is a garbled answer for this reason.
pub(crate) fn is_garbled<T>(result: &Result<T, SerialError>, reason: FrameFault) -> bool {
    matches!(result, Err(SerialError::Garbled { fault, .. }) if *fault == reason)
}
