//! A device that fails on a schedule, the same way every time.

mod answers;

use std::collections::VecDeque;

use thiserror::Error;

use self::answers::{Memory, Suffers};
use super::trouble::{FaultyParams, Trouble};
use crate::dice::Dice;
use crate::{
    BaseStatus, Bearings, Camera, CameraFrame, Clock, DeviceError, DifferentialDrive, FaultKind,
    PanActuator, Ping, RangeFinder, Twist2,
};

/// Why a device that is made to fail gave no answer.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FaultyError<E> {
    /// By itself.
    #[error("{0}")]
    Device(E),
    /// Because it was made to.
    #[error("injected: {0:?}")]
    Injected(FaultKind),
}

impl<E: DeviceError> DeviceError for FaultyError<E> {
    fn kind(&self) -> FaultKind {
        match self {
            Self::Device(error) => error.kind(),
            Self::Injected(kind) => *kind,
        }
    }
}

/// A device that fails on a schedule. Same seed, schedule and calls: the same answers.
///
/// | | range finder | pan | camera | base | clock |
/// |---|---|---|---|---|---|
/// | off, intermittent | silent after the timeout | the same | the same | the same, commands are lost | - |
/// | stuck | the last reading, fired now | does not turn, and says so | the last picture, exposed now | the travel stands still | stands still |
/// | garbage | garbled | garbled | a picture of noise | garbled, commands are lost | - |
/// | wrong | echoes up to `by` too far | stands beside what it says | the picture slides down | the left wheel counts too much | - |
/// | slow | takes longer | the same | the same | 5 ms or longer | runs slower |
/// | delayed | the newest reading that is old enough | turns, answers late | the newest picture that is old enough | the same; commands arrive at a later call | - |
/// | drop | silent after the timeout | the same | the same | the same, the command is lost | - |
/// | freeze | the last ping, its stamp too | says yes, does not turn | the last frame, its stamp too | the last state, commands are lost | stands still |
/// | unplug | unplugged, at once | the same | the same | the same, commands are lost | - |
///
/// A base that gets no command goes on as it was told before, as real ones without a watchdog do. A
/// clock loses time, it never goes back.
#[derive(Debug, Clone)]
pub struct Faulty<D, C> {
    device: D,
    clock: C,
    params: FaultyParams,
    dice: Dice,
    pings: Memory<Ping>,
    frames: Memory<CameraFrame>,
    states: Memory<BaseStatus>,
    stood_at: f64,
    /// What the left wheel has counted too much [m].
    miscounted: f64,
    /// The left wheel's travel at the last status [m].
    rolled: Option<f64>,
    /// Commands on their way, and when they arrive.
    under_way: VecDeque<(f64, Twist2)>,
}

impl<D, C: Clock> Faulty<D, C> {
    /// The clock is the one that goes with the device.
    #[must_use]
    pub fn new(device: D, clock: C, params: FaultyParams) -> Self {
        Self {
            device,
            clock,
            dice: Dice::new(params.seed),
            params,
            pings: Memory::default(),
            frames: Memory::default(),
            states: Memory::default(),
            stood_at: 0.0,
            miscounted: 0.0,
            rolled: None,
            under_way: VecDeque::new(),
        }
    }

    /// How it fails; can be changed while it runs.
    pub const fn params(&mut self) -> &mut FaultyParams {
        &mut self.params
    }

    /// The device inside.
    pub const fn device(&mut self) -> &mut D {
        &mut self.device
    }

    /// Fails where the call does not get through at all; else what is wrong with it.
    fn reach<E>(&mut self) -> Result<Option<Trouble>, FaultyError<E>> {
        let trouble = self.params.at(self.clock.now());
        let lost = match trouble {
            Some(Trouble::Off) => true,
            Some(Trouble::Drop { share }) => self.dice.chance(share),
            Some(Trouble::Unplug) => return Err(FaultyError::Injected(FaultKind::Unplugged)),
            _ => false,
        };
        if lost {
            self.clock.sleep(self.params.timeout);
            return Err(FaultyError::Injected(FaultKind::Silent));
        }
        Ok(trouble)
    }

    /// Calls the device, as long as it takes.
    fn call<T, E>(
        &mut self,
        trouble: Option<Trouble>,
        call: impl FnOnce(&mut D) -> Result<T, E>,
    ) -> Result<T, FaultyError<E>> {
        let called = self.clock.now();
        let result = call(&mut self.device).map_err(FaultyError::Device);
        if let Some(Trouble::Slow { factor }) = trouble {
            let took = (self.clock.now() - called).max(LEAST_CALL);
            self.clock.sleep(took * (factor - 1.0));
        }
        result
    }

    /// An answer of the device, or what is made of it.
    fn answer<T: Suffers, E>(
        &mut self,
        memory: impl Fn(&mut Self) -> &mut Memory<T>,
        call: impl FnOnce(&mut D) -> Result<T, E>,
    ) -> Result<T, FaultyError<E>> {
        let trouble = self.reach()?;
        if let (Some(Trouble::Freeze), Some(last)) = (trouble, memory(self).last()) {
            // what waits for the device does wait
            self.clock.sleep(LEAST_CALL);
            return Ok(last);
        }
        let fresh = self.call(trouble, call)?;
        let now = self.clock.now();
        let delay = self.params.longest_delay();
        let kept = memory(self);
        let answer = match trouble {
            Some(Trouble::Stuck) => kept.last().map(|last| fresh.clone().stuck_at(&last)),
            Some(Trouble::Delayed { seconds }) => {
                kept.note(now, fresh, delay);
                let old = kept.as_old_as(now - seconds);
                return old.ok_or(FaultyError::Injected(FaultKind::Silent));
            }
            Some(Trouble::Garbage { share }) if self.dice.chance(share) => {
                let noise = fresh.garbage(&mut self.dice);
                return noise.ok_or(FaultyError::Injected(FaultKind::Garbled));
            }
            Some(Trouble::Wrong { by }) => Some(fresh.clone().wrong(by, &mut self.dice)),
            _ => None,
        };
        let kept = memory(self);
        if !matches!(trouble, Some(Trouble::Stuck)) || answer.is_none() {
            kept.note(now, fresh.clone(), delay);
        }
        Ok(answer.unwrap_or(fresh))
    }
}

/// What a call of a slow device takes at least, before it is slowed down [s].
const LEAST_CALL: f64 = 0.005;

impl<D: RangeFinder, C: Clock> RangeFinder for Faulty<D, C> {
    type Error = FaultyError<D::Error>;

    fn bearings(&self) -> Bearings {
        self.device.bearings()
    }

    fn ping(&mut self, bearing: f64) -> Result<Ping, Self::Error> {
        self.answer(|s| &mut s.pings, |device| device.ping(bearing))
    }
}

impl<D: PanActuator, C: Clock> PanActuator for Faulty<D, C> {
    type Error = FaultyError<D::Error>;

    fn bearings(&self) -> Bearings {
        self.device.bearings()
    }

    fn turn_to(&mut self, bearing: f64) -> Result<f64, Self::Error> {
        let trouble = self.reach()?;
        match trouble {
            Some(Trouble::Stuck) => return Ok(self.stood_at),
            Some(Trouble::Freeze) => return Ok(bearing),
            Some(Trouble::Garbage { share }) if self.dice.chance(share) => {
                return Err(FaultyError::Injected(FaultKind::Garbled));
            }
            _ => {}
        }
        let reach = self.device.bearings();
        let to = match trouble {
            Some(Trouble::Wrong { by }) => (bearing + by).clamp(reach.from, reach.to),
            _ => bearing,
        };
        self.stood_at = self.call(trouble, |device| device.turn_to(to))?;
        if let Some(Trouble::Delayed { seconds }) = trouble {
            self.clock.sleep(seconds);
        }
        Ok(self.stood_at - (to - bearing))
    }
}

impl<D: Camera, C: Clock> Camera for Faulty<D, C> {
    type Error = FaultyError<D::Error>;

    fn frame(&mut self) -> Result<CameraFrame, Self::Error> {
        self.answer(|s| &mut s.frames, Camera::frame)
    }
}

impl<D: DifferentialDrive, C: Clock> Faulty<D, C> {
    /// Commands that have arrived by now.
    fn deliver(&mut self) -> Result<(), FaultyError<D::Error>> {
        let now = self.clock.now();
        while let Some((due, command)) = self.under_way.front().copied() {
            if due > now {
                break;
            }
            self.under_way.pop_front();
            self.device.drive(command).map_err(FaultyError::Device)?;
        }
        Ok(())
    }

    /// Lets the left wheel count too much; what it has once counted it keeps.
    fn miscount(&mut self, trouble: Option<Trouble>, mut status: BaseStatus) -> BaseStatus {
        let rolled = status.travel.left;
        if let (Some(Trouble::Wrong { by }), Some(before)) = (trouble, self.rolled) {
            self.miscounted += by * (rolled - before);
        }
        self.rolled = Some(rolled);
        status.travel.left += self.miscounted;
        status
    }
}

impl<D: DifferentialDrive, C: Clock> DifferentialDrive for Faulty<D, C> {
    type Error = FaultyError<D::Error>;

    fn track(&self) -> f64 {
        self.device.track()
    }

    fn drive(&mut self, command: Twist2) -> Result<(), Self::Error> {
        self.deliver()?;
        match self.reach()? {
            Some(Trouble::Freeze) => Ok(()),
            Some(Trouble::Delayed { seconds }) => {
                let due = self.clock.now() + seconds;
                self.under_way.push_back((due, command));
                Ok(())
            }
            Some(Trouble::Garbage { share }) if self.dice.chance(share) => {
                Err(FaultyError::Injected(FaultKind::Garbled))
            }
            trouble => {
                self.under_way.clear();
                self.call(trouble, |device| device.drive(command))
            }
        }
    }

    fn stop(&mut self) -> Result<(), Self::Error> {
        if self.params.at(self.clock.now()).is_some() {
            return self.drive(Twist2::default());
        }
        self.under_way.clear();
        self.device.stop().map_err(FaultyError::Device)
    }

    fn status(&mut self) -> Result<BaseStatus, Self::Error> {
        self.deliver()?;
        let trouble = self.params.at(self.clock.now());
        let status = self.answer(|s| &mut s.states, DifferentialDrive::status)?;
        Ok(self.miscount(trouble, status))
    }
}

impl<D: Clock, C: Clock> Clock for Faulty<D, C> {
    fn now(&self) -> f64 {
        let now = self.device.now();
        now - self.params.lost_by(now)
    }

    fn sleep(&mut self, seconds: f64) {
        self.device.sleep(seconds);
    }
}
