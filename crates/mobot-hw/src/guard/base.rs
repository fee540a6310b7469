//! Which base is guarded, and how a guard is told so on its command line.

use crate::serial::{
    ArduinoParams, Create2Params, KobukiParams, WheelLimits, arduino, create2, kobuki,
};

/// A base that can be guarded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BaseKind {
    /// iRobot Create 2, Roomba 500 to 800.
    Create2(Create2Params),
    /// Yujin Kobuki.
    Kobuki(KobukiParams),
    /// ROSArduinoBridge; its servo and sonar cannot be reached through a guard.
    Arduino(ArduinoParams),
}

impl BaseKind {
    /// Distance between the wheels [m].
    pub(crate) const fn track(&self) -> f64 {
        match self {
            Self::Create2(_) => create2::TRACK,
            Self::Kobuki(_) => kobuki::TRACK,
            Self::Arduino(params) => params.track,
        }
    }

    /// How long the program waits for a status [s].
    pub(crate) const fn timeout(&self) -> f64 {
        match self {
            Self::Create2(params) => params.timeout,
            Self::Kobuki(params) => params.timeout,
            Self::Arduino(params) => params.timeout,
        }
    }

    /// Whether it speaks by itself, so that hearing it can be broken off. One that is asked does not say what
    /// it answers.
    pub(crate) const fn interruptible(&self) -> bool {
        !matches!(self, Self::Arduino(_))
    }

    /// What stops it, whatever was on the way to it and was cut off.
    pub(crate) fn stop(&self) -> Vec<u8> {
        match self {
            Self::Create2(_) => create2::drive_direct(0, 0).repeat(2),
            Self::Kobuki(_) => kobuki::base_control(0, 0),
            Self::Arduino(_) => [&b"\r"[..], &arduino::Command::Motors(0, 0).bytes()].concat(),
        }
    }

    /// The arguments that [`BaseKind::from_words`] reads.
    pub(crate) fn words(&self) -> Vec<String> {
        let (name, numbers) = match *self {
            Self::Create2(Create2Params { limits, timeout }) => {
                ("create2", of_limits(limits, &[timeout]))
            }
            Self::Kobuki(KobukiParams { limits, timeout }) => {
                ("kobuki", of_limits(limits, &[timeout]))
            }
            Self::Arduino(p) => {
                let wheels = [p.track, p.counts_per_metre, p.frames_per_second];
                let rest = [&[p.timeout], &wheels[..]].concat();
                ("arduino", of_limits(p.limits, &rest))
            }
        };
        let numbers = numbers.into_iter().map(|n| n.to_string());
        std::iter::once(name.to_owned()).chain(numbers).collect()
    }

    /// What [`BaseKind::words`] gave.
    pub(crate) fn from_words(name: &str, words: &[String]) -> Option<Self> {
        let numbers: Vec<f64> = words.iter().flat_map(|w| w.parse()).collect();
        if numbers.len() != words.len() {
            return None;
        }
        let limits = |max_speed, max_acceleration| WheelLimits {
            max_speed,
            max_acceleration,
        };
        match (name, &numbers[..]) {
            ("create2", &[speed, gain, timeout]) => Some(Self::Create2(Create2Params {
                limits: limits(speed, gain),
                timeout,
            })),
            ("kobuki", &[speed, gain, timeout]) => Some(Self::Kobuki(KobukiParams {
                limits: limits(speed, gain),
                timeout,
            })),
            (
                "arduino",
                &[
                    speed,
                    gain,
                    timeout,
                    track,
                    counts_per_metre,
                    frames_per_second,
                ],
            ) => Some(Self::Arduino(ArduinoParams {
                limits: limits(speed, gain),
                timeout,
                track,
                counts_per_metre,
                frames_per_second,
                ..ArduinoParams::default()
            })),
            _ => None,
        }
    }
}

fn of_limits(limits: WheelLimits, rest: &[f64]) -> Vec<f64> {
    [&[limits.max_speed, limits.max_acceleration], rest].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_say_all_that_the_guard_needs() {
        let limits = WheelLimits {
            max_speed: 0.1 + 0.2,
            max_acceleration: 1e-9,
        };
        let kinds = [
            BaseKind::Create2(Create2Params {
                limits,
                timeout: 0.07,
            }),
            BaseKind::Kobuki(KobukiParams {
                limits,
                timeout: 0.07,
            }),
            BaseKind::Arduino(ArduinoParams {
                limits,
                timeout: 0.07,
                track: 1.0 / 3.0,
                counts_per_metre: 1234.5,
                frames_per_second: 25.0,
                ..ArduinoParams::default()
            }),
        ];
        for kind in kinds {
            let words = kind.words();
            assert_eq!(BaseKind::from_words(&words[0], &words[1..]), Some(kind));
            assert_eq!(BaseKind::from_words("p2os", &words[1..]), None);
            assert_eq!(BaseKind::from_words(&words[0], &words[2..]), None);
        }
        let words = ["0.5", "1", "soon"].map(str::to_owned);
        assert_eq!(BaseKind::from_words("create2", &words), None);
    }
}
