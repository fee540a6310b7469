//! A device whose every call is handed on.

use std::rc::Rc;
use std::sync::{Arc, Mutex, PoisonError};

use super::call::{Answer, Asked, Call, Fault};
use crate::{
    BaseStatus, Bearings, Camera, CameraFrame, Clock, DeviceError, DifferentialDrive, PanActuator,
    Ping, RangeFinder, Twist2,
};

/// Where recorded calls go, in the order in which they were answered. Several devices may share one.
pub trait Sink {
    /// Takes a call. Must not fail: a recording that breaks does not stop a robot.
    fn take(&self, call: Call);
}

impl Sink for Mutex<Vec<Call>> {
    fn take(&self, call: Call) {
        self.lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(call);
    }
}

/// The same for a borrowed and for a shared sink.
macro_rules! through {
    ($pointer:ty) => {
        impl<S: Sink + ?Sized> Sink for $pointer {
            fn take(&self, call: Call) {
                (**self).take(call);
            }
        }
    };
}

through!(&S);
through!(Box<S>);
through!(Rc<S>);
through!(Arc<S>);

/// A device as it is, every call of which goes to a [`Sink`], too.
#[derive(Debug, Clone)]
pub struct Recorded<D, S> {
    /// The device.
    pub device: D,
    /// What takes its calls.
    pub sink: S,
}

impl<D, S: Sink> Recorded<D, S> {
    /// Records from now on.
    #[must_use]
    pub const fn new(device: D, sink: S) -> Self {
        Self { device, sink }
    }

    fn note<T: Clone, E: DeviceError>(
        &self,
        asked: Asked,
        result: Result<T, E>,
        answer: impl FnOnce(T) -> Answer,
    ) -> Result<T, E> {
        let answer = match &result {
            Ok(value) => answer(value.clone()),
            Err(error) => Answer::Fault(Fault::of(error)),
        };
        self.sink.take(Call { asked, answer });
        result
    }

    fn note_plain<T: Copy>(&self, asked: Asked, value: T, answer: impl FnOnce(T) -> Answer) -> T {
        let answer = answer(value);
        self.sink.take(Call { asked, answer });
        value
    }
}

impl<D: RangeFinder, S: Sink> RangeFinder for Recorded<D, S> {
    type Error = D::Error;

    fn bearings(&self) -> Bearings {
        self.note_plain(
            Asked::RangeBearings,
            self.device.bearings(),
            Answer::Bearings,
        )
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, D::Error> {
        let result = self.device.ping(bearing);
        self.note(Asked::Ping { bearing }, result, Answer::Ping)
    }
}

impl<D: PanActuator, S: Sink> PanActuator for Recorded<D, S> {
    type Error = D::Error;

    fn bearings(&self) -> Bearings {
        self.note_plain(Asked::PanBearings, self.device.bearings(), Answer::Bearings)
    }

    fn turn_to(&mut self, bearing: f64) -> Result<f64, D::Error> {
        let result = self.device.turn_to(bearing);
        self.note(Asked::TurnTo { bearing }, result, Answer::Stands)
    }
}

impl<D: Camera, S: Sink> Camera for Recorded<D, S> {
    type Error = D::Error;

    fn frame(&mut self) -> Result<CameraFrame, D::Error> {
        let result = self.device.frame();
        self.note(Asked::Frame, result, Answer::Frame)
    }
}

impl<D: DifferentialDrive, S: Sink> DifferentialDrive for Recorded<D, S> {
    type Error = D::Error;

    fn track(&self) -> f64 {
        self.note_plain(Asked::Track, self.device.track(), Answer::Track)
    }

    fn drive(&mut self, command: Twist2) -> Result<(), D::Error> {
        let result = self.device.drive(command);
        self.note(Asked::Drive(command), result, |()| Answer::Done)
    }

    fn stop(&mut self) -> Result<(), D::Error> {
        let result = self.device.stop();
        self.note(Asked::Stop, result, |()| Answer::Done)
    }

    fn status(&mut self) -> Result<BaseStatus, D::Error> {
        let result = self.device.status();
        self.note(Asked::Status, result, Answer::Status)
    }
}

impl<D: Clock, S: Sink> Clock for Recorded<D, S> {
    fn now(&self) -> f64 {
        self.note_plain(Asked::Now, self.device.now(), Answer::Now)
    }

    fn sleep(&mut self, seconds: f64) {
        self.device.sleep(seconds);
        self.sink.take(Call {
            asked: Asked::Sleep { seconds },
            answer: Answer::Done,
        });
    }
}
