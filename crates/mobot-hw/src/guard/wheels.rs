//! Whether the wheels stand, as the base's counters tell.

use crate::WheelTravel;

/// Counters that have not moved for this long say that the wheels stand [s].
const STILL: f64 = 0.1;

/// Watches the counters.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wheels {
    /// The last travel, and since when it is the same [s].
    since: Option<(WheelTravel, f64)>,
    stand: bool,
}

impl Wheels {
    /// Takes a reading and its time [s].
    pub(super) fn hear(&mut self, travel: WheelTravel, stamp: f64) {
        let (before, since) = *self.since.get_or_insert((travel, stamp));
        if before == travel {
            self.stand = stamp - since >= STILL;
        } else {
            self.since = Some((travel, stamp));
            self.stand = false;
        }
    }

    /// The base says that its motors are off.
    pub(super) const fn off(&mut self) {
        self.stand = true;
    }

    /// Nothing is known any more.
    pub(super) const fn forget(&mut self) {
        self.since = None;
        self.stand = false;
    }

    pub(super) const fn stand(&self) -> bool {
        self.stand
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheels_stand_after_a_tenth_of_a_second_without_a_count() {
        let mut wheels = Wheels::default();
        let travel = |left| WheelTravel { left, right: 1.0 };
        for k in 0..10 {
            wheels.hear(travel(f64::from(k)), 0.05 * f64::from(k));
            assert!(!wheels.stand());
        }
        wheels.hear(travel(9.0), 0.54);
        assert!(!wheels.stand());
        wheels.hear(travel(9.0), 0.56);
        assert!(wheels.stand());
        wheels.hear(travel(9.5), 0.57);
        assert!(!wheels.stand());
        wheels.off();
        assert!(wheels.stand());
        wheels.forget();
        wheels.hear(travel(9.5), 9.0);
        assert!(!wheels.stand());
    }
}
