//! What a program needs of its devices. Calls block until there is an answer or a fault; no call hangs.
//! Times are seconds on the clock that goes with the devices, see [`Clock`].

use crate::{BaseStatus, Bearings, CameraFrame, Ping, Twist2};

/// What went wrong, whatever the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FaultKind {
    /// The device did not answer in time.
    Silent,
    /// What came was no valid answer: a wrong checksum, half a frame, a size that changed.
    Garbled,
    /// The device is no longer there.
    Unplugged,
    /// The device understood and said no, or asked for what it cannot do.
    Refused,
    /// The operating system failed.
    System,
}

/// An error of a device.
pub trait DeviceError: std::error::Error {
    /// What kind of fault it is.
    fn kind(&self) -> FaultKind;
}

impl DeviceError for std::convert::Infallible {
    fn kind(&self) -> FaultKind {
        match *self {}
    }
}

/// A sonar that can be aimed.
pub trait RangeFinder {
    /// Why it failed.
    type Error: DeviceError;

    /// The directions it can be aimed at, base frame; a fixed sonar has one.
    fn bearings(&self) -> Bearings;

    /// Aims at `bearing` [rad, base frame], waits until the beam has settled there, and fires once.
    ///
    /// # Errors
    /// The device's; [`FaultKind::Refused`] for a bearing out of reach.
    fn ping(&mut self, bearing: f64) -> Result<Ping, Self::Error>;
}

/// A motor that turns a sensor about the vertical.
pub trait PanActuator {
    /// Why it failed.
    type Error: DeviceError;

    /// The directions it can turn to, base frame.
    fn bearings(&self) -> Bearings;

    /// Turns to `bearing` [rad, base frame] and waits until it has settled. Gives the bearing at which
    /// it stands, as far as it knows.
    ///
    /// # Errors
    /// The device's; [`FaultKind::Refused`] for a bearing out of reach.
    fn turn_to(&mut self, bearing: f64) -> Result<f64, Self::Error>;
}

/// A camera.
pub trait Camera {
    /// Why it failed.
    type Error: DeviceError;

    /// The newest frame, exposed after the one given before; waits for it. Frames that were waiting in
    /// a queue are dropped.
    ///
    /// # Errors
    /// The device's.
    fn frame(&mut self) -> Result<CameraFrame, Self::Error>;
}

/// A base with two driven wheels.
pub trait DifferentialDrive {
    /// Why it failed.
    type Error: DeviceError;

    /// Distance between the wheels [m].
    fn track(&self) -> f64;

    /// Sets the velocity to reach. A command that is not finite means stop; one beyond the base's limits
    /// is scaled down, keeping its curve.
    ///
    /// # Errors
    /// The device's.
    fn drive(&mut self, command: Twist2) -> Result<(), Self::Error>;

    /// Stops as fast as the base can.
    ///
    /// # Errors
    /// The device's.
    fn stop(&mut self) -> Result<(), Self::Error> {
        self.drive(Twist2::default())
    }

    /// Wheel travel and contacts, as fresh as the base has them.
    ///
    /// # Errors
    /// The device's.
    fn status(&mut self) -> Result<BaseStatus, Self::Error>;
}

/// Time that never goes back.
pub trait Clock {
    /// Since the clock began [s].
    fn now(&self) -> f64;

    /// Returns `seconds` later; at once for 0 or less, or NaN.
    fn sleep(&mut self, seconds: f64);
}

/// The same for a borrowed and for a boxed device.
macro_rules! through {
    ($pointer:ty) => {
        impl<T: RangeFinder + ?Sized> RangeFinder for $pointer {
            type Error = T::Error;
            fn bearings(&self) -> Bearings {
                (**self).bearings()
            }
            fn ping(&mut self, bearing: f64) -> Result<Ping, Self::Error> {
                (**self).ping(bearing)
            }
        }

        impl<T: PanActuator + ?Sized> PanActuator for $pointer {
            type Error = T::Error;
            fn bearings(&self) -> Bearings {
                (**self).bearings()
            }
            fn turn_to(&mut self, bearing: f64) -> Result<f64, Self::Error> {
                (**self).turn_to(bearing)
            }
        }

        impl<T: Camera + ?Sized> Camera for $pointer {
            type Error = T::Error;
            fn frame(&mut self) -> Result<CameraFrame, Self::Error> {
                (**self).frame()
            }
        }

        impl<T: DifferentialDrive + ?Sized> DifferentialDrive for $pointer {
            type Error = T::Error;
            fn track(&self) -> f64 {
                (**self).track()
            }
            fn drive(&mut self, command: Twist2) -> Result<(), Self::Error> {
                (**self).drive(command)
            }
            fn stop(&mut self) -> Result<(), Self::Error> {
                (**self).stop()
            }
            fn status(&mut self) -> Result<BaseStatus, Self::Error> {
                (**self).status()
            }
        }

        impl<T: Clock + ?Sized> Clock for $pointer {
            fn now(&self) -> f64 {
                (**self).now()
            }
            fn sleep(&mut self, seconds: f64) {
                (**self).sleep(seconds);
            }
        }
    };
}

through!(&mut T);
through!(Box<T>);
