//! What the sonar hears while the robot looks round: one firing a direction, from one place.

use std::f64::consts::TAU;

use mobot_hw::Ping;
use occgrid::Reading;

use super::Sounding;

/// Directions that are told apart: the paper's 20 shots of a survey.
const DIRECTIONS: usize = 20;
/// A sweep is whole with so many of them: a turret may leave some out.
const ENOUGH: usize = 16;
/// The robot has driven on where it is this far from the sweep's first firing [m].
const MOVED: f64 = 0.03;

/// Firings of a robot that stands or turns on the spot, whoever asked for them.
#[derive(Debug, Clone, Default)]
pub(super) struct Sweep {
    /// By their direction by dead reckoning.
    shots: [Option<Sounding>; DIRECTIONS],
    /// In the order in which they came.
    order: Vec<usize>,
}

impl Sweep {
    /// Takes a firing; a new place begins a new sweep.
    pub(super) fn take(&mut self, sounding: &Sounding) {
        let Ping {
            settled,
            bearing,
            reading,
            ..
        } = sounding.ping;
        let here = sounding.odom_from_base.position();
        let first = self.order.first().and_then(|k| self.shots[*k]);
        if first.is_some_and(|f| f.odom_from_base.position().distance(here) > MOVED) {
            *self = Self::default();
        }
        if !settled || matches!(reading, Reading::Fault) {
            return;
        }
        let direction = (sounding.odom_from_base.theta + bearing).rem_euclid(TAU) / TAU;
        let index = (direction * DIRECTIONS as f64) as usize % DIRECTIONS;
        self.order.retain(|k| *k != index);
        self.order.push(index);
        self.shots[index] = Some(*sounding);
    }

    /// Whether it has been all round. The firings then, the last one last; the next sweep begins.
    pub(super) fn whole(&mut self) -> Option<Vec<Sounding>> {
        if self.order.len() < ENOUGH {
            return None;
        }
        let done = std::mem::take(self);
        Some(done.order.iter().filter_map(|k| done.shots[*k]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use occgrid::Pose2;

    fn heard(x: f64, bearing: f64, reading: Reading) -> Sounding {
        let at = Pose2::new(x, 0.0, 0.4);
        Sounding {
            ping: Ping {
                stamp: 0.0,
                bearing,
                settled: true,
                reading,
            },
            map_from_base: at,
            odom_from_base: at,
        }
    }

    #[test]
    fn a_sweep_is_of_one_place_and_has_a_firing_a_direction() {
        let echo = Reading::Echo { range: 1.0 };
        let mut sweep = Sweep::default();
        let shot = |k: u32| f64::from(k) * TAU / 20.0;
        for k in 0..15 {
            sweep.take(&heard(0.0, shot(k), echo));
            sweep.take(&heard(0.01, shot(k), echo));
            sweep.take(&heard(0.0, shot(19), Reading::Fault));
        }
        assert!(sweep.whole().is_none());
        // driven on: from the start
        sweep.take(&heard(0.1, 0.0, echo));
        for k in 1..15 {
            sweep.take(&heard(0.1, shot(k), echo));
        }
        assert!(sweep.whole().is_none());
        sweep.take(&heard(0.1, shot(15), echo));
        let shots = sweep.whole().expect("all round");
        assert_eq!(shots.len(), 16);
        assert!((shots[15].ping.bearing - shot(15)).abs() < 1e-12);
        assert!(sweep.whole().is_none());
    }
}
