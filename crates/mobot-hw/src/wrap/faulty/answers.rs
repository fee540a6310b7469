//! What troubles make of a device's answers.

use std::collections::VecDeque;

use image::{GrayImage, Luma};
use occgrid::Reading;

use crate::dice::Dice;
use crate::{BaseStatus, CameraFrame, Ping};

/// Answers that can be kept, and spoilt.
pub(super) trait Suffers: Clone {
    /// As new as this, and what the other one says.
    fn stuck_at(self, last: &Self) -> Self;

    /// Well-formed and wrong.
    fn wrong(self, by: f64, dice: &mut Dice) -> Self;

    /// Noise, where a driver could not tell.
    fn garbage(self, _dice: &mut Dice) -> Option<Self> {
        None
    }
}

impl Suffers for Ping {
    fn stuck_at(self, last: &Self) -> Self {
        Self {
            reading: last.reading,
            ..self
        }
    }

    fn wrong(self, by: f64, dice: &mut Dice) -> Self {
        let reading = match self.reading {
            Reading::Echo { range } => Reading::Echo {
                range: range * (1.0 + by * dice.even()),
            },
            other => other,
        };
        Self { reading, ..self }
    }
}

impl Suffers for CameraFrame {
    fn stuck_at(self, last: &Self) -> Self {
        Self {
            image: last.image.clone(),
            ..self
        }
    }

    fn wrong(self, by: f64, _: &mut Dice) -> Self {
        let (width, height) = self.image.dimensions();
        let down = (by * f64::from(height)).round() as i64;
        let image = GrayImage::from_fn(width, height, |x, y| {
            let from = (i64::from(y) - down).clamp(0, i64::from(height) - 1);
            *self.image.get_pixel(x, from as u32)
        });
        Self { image, ..self }
    }

    fn garbage(self, dice: &mut Dice) -> Option<Self> {
        let (width, height) = self.image.dimensions();
        let image = GrayImage::from_fn(width, height, |_, _| Luma([dice.next() as u8]));
        Some(Self { image, ..self })
    }
}

impl Suffers for BaseStatus {
    fn stuck_at(self, last: &Self) -> Self {
        Self {
            stamp: self.stamp,
            ..*last
        }
    }

    /// The wheel is miscounted where the status leaves, so that its travel never jumps.
    fn wrong(self, _: f64, _: &mut Dice) -> Self {
        self
    }
}

/// The newest answer, and older ones as far as they can still be wanted, each with the time at which
/// it came.
#[derive(Debug, Clone)]
pub(super) struct Memory<T>(VecDeque<(f64, T)>);

impl<T> Default for Memory<T> {
    fn default() -> Self {
        Self(VecDeque::new())
    }
}

impl<T: Clone> Memory<T> {
    /// Takes an answer that came now; of those that are `delay` old or older the newest stays.
    pub(super) fn note(&mut self, now: f64, answer: T, delay: f64) {
        self.0.push_back((now, answer));
        while self.0.get(1).is_some_and(|(came, _)| *came <= now - delay) {
            self.0.pop_front();
        }
    }

    pub(super) fn last(&self) -> Option<T> {
        self.0.back().map(|(_, answer)| answer.clone())
    }

    /// The newest that came by a time.
    pub(super) fn as_old_as(&self, time: f64) -> Option<T> {
        let old = self.0.iter().rev().find(|(came, _)| *came <= time);
        old.map(|(_, answer)| answer.clone())
    }
}
