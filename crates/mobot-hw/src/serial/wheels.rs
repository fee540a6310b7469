//! The last word before the wheels: limits, the latch, and counters that wrap.

use crate::Twist2;

/// A command that is not renewed for this long is no longer meant [s].
pub const LATCH: f64 = 0.2;
/// A base's frames that waited unread for longer than this tell its travel, but not its state [s].
pub(crate) const UNREAD: f64 = 0.05;
/// What comes this soon after a call began had waited [s].
pub(crate) const JUST_NOW: f64 = 0.002;
/// Time that one command can gain speed for [s]; commands come more often.
const LONGEST_STEP: f64 = 0.1;

/// What a base may be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelLimits {
    /// Largest speed of a wheel [m/s], above 0.
    pub max_speed: f64,
    /// Largest gain of a wheel's speed [m/s^2], above 0. Speed is gained in steps, one a command, so a
    /// faster loop starts more smoothly; slowing down is not limited.
    pub max_acceleration: f64,
}

impl Default for WheelLimits {
    fn default() -> Self {
        Self {
            max_speed: 0.5,
            max_acceleration: 1.0,
        }
    }
}

/// Keeps the command in force.
#[derive(Debug, Clone)]
pub(crate) struct Governor {
    limits: WheelLimits,
    track: f64,
    wheels: [f64; 2],
    renewed: Option<f64>,
}

impl Governor {
    pub(crate) const fn new(limits: WheelLimits, track: f64) -> Self {
        Self {
            limits,
            track,
            wheels: [0.0; 2],
            renewed: None,
        }
    }

    /// The wheel speeds that a command becomes now [m/s]: of its direction, as fast as allowed; zero for
    /// one that is not finite.
    pub(crate) fn allow(&mut self, command: Twist2, now: f64) -> [f64; 2] {
        let wanted = command.wheels(self.track);
        if !wanted.iter().all(|w| w.is_finite()) {
            return self.halt(now);
        }
        let gained = self.limits.max_acceleration
            * self
                .renewed
                .map_or(LONGEST_STEP, |then| (now - then).clamp(0.0, LONGEST_STEP));
        let mut share = 1.0_f64;
        for (wanted, before) in wanted.iter().zip(self.wheels) {
            let kept = if wanted * before > 0.0 {
                before.abs()
            } else {
                0.0
            };
            let allowed = (kept + gained).min(self.limits.max_speed);
            if wanted.abs() > allowed {
                share = share.min(allowed / wanted.abs());
            }
        }
        self.wheels = wanted.map(|w| w * share);
        self.renewed = Some(now);
        self.wheels
    }

    /// Zero, from now on. Said again it changes nothing: a stop that is repeated does not slow the next start.
    pub(crate) fn halt(&mut self, now: f64) -> [f64; 2] {
        if moves(self.wheels) || self.renewed.is_none() {
            self.renewed = Some(now);
        }
        self.wheels = [0.0; 2];
        self.wheels
    }

    /// Whether a command to move is in force that was not renewed in time.
    pub(crate) fn expired(&self, now: f64) -> bool {
        moves(self.wheels) && self.renewed.is_none_or(|then| now - then > LATCH)
    }
}

/// Whether any wheel turns.
pub(crate) fn moves(wheels: [f64; 2]) -> bool {
    wheels.iter().any(|w| *w != 0.0)
}

/// The whole count of a counter of 16 bits that wraps.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Unwrapped {
    last: Option<u16>,
    pub(crate) total: i64,
}

impl Unwrapped {
    /// Takes a reading; right as long as fewer than 32 768 counts passed since the last one.
    pub(crate) fn update(&mut self, count: u16) {
        let last = self.last.replace(count).unwrap_or(count);
        self.total += i64::from(count.wrapping_sub(last) as i16);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrapping_counter_loses_nothing() {
        for step in [1_i64, -1, 9999, -9999, 32767, -32767] {
            let mut counter = Unwrapped::default();
            let mut whole = 65_000_i64;
            counter.update(whole as u16);
            for _ in 0..1000 {
                whole += step;
                counter.update(whole as u16);
            }
            assert_eq!(counter.total, whole - 65_000);
        }
    }

    #[test]
    fn what_is_not_finite_stops() {
        let mut governor = Governor::new(WheelLimits::default(), 0.235);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for command in [Twist2::new(bad, 0.0), Twist2::new(0.1, bad)] {
                governor.allow(Twist2::new(0.1, 0.0), 0.0);
                assert!(!moves(governor.allow(command, 0.1)));
                assert!(!governor.expired(9.0));
            }
        }
        assert!(!moves(governor.allow(Twist2::new(f64::MAX, f64::MAX), 0.2)));
    }

    #[test]
    fn repeated_stops_do_not_slow_the_next_start() {
        let mut governor = Governor::new(WheelLimits::default(), 0.235);
        governor.allow(Twist2::new(0.5, 0.0), 0.0);
        for ms in 200..300 {
            governor.halt(f64::from(ms) / 1000.0);
        }
        let wheels = governor.allow(Twist2::new(0.5, 0.0), 0.3);
        assert!(wheels.iter().all(|w| (w - 0.1).abs() < 1e-12), "{wheels:?}");
        // and a stop in mid-drive gives nothing away
        governor.halt(0.31);
        let wheels = governor.allow(Twist2::new(0.5, 0.0), 0.32);
        assert!(
            wheels.iter().all(|w| (w - 0.01).abs() < 1e-12),
            "{wheels:?}"
        );
    }

    #[test]
    fn limits_keep_the_curve_and_never_the_brake() {
        let mut governor = Governor::new(WheelLimits::default(), 0.2);
        let mut now = 0.0;
        let mut before = [0.0_f64; 2];
        for _ in 0..50 {
            let wheels = governor.allow(Twist2::new(2.0, 5.0), now);
            assert!((wheels[1] / wheels[0] - 2.5 / 1.5).abs() < 1e-9);
            assert!(wheels.iter().all(|w| w.abs() <= 0.5));
            let gained = (wheels[1] - before[1]).max(wheels[0] - before[0]);
            assert!(gained <= 0.1 + 1e-12);
            before = wheels;
            now += 0.05;
        }
        assert!((before[1] - 0.5).abs() < 1e-12);
        let slower = governor.allow(Twist2::new(0.1, 0.0), now);
        assert!(slower.iter().all(|w| (w - 0.1).abs() < 1e-12));
        assert!(!governor.expired(now + 0.19) && governor.expired(now + 0.21));
    }
}
