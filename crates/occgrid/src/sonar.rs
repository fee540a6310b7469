//! The inverse sensor model of one sonar, after §2.1 of Choi, Ryu and Kim, "Navigation of an indoor
//! mobile robot with one ultrasonic sensor and one camera", IEEE SMC 1999, pp. IV-686 to IV-691.

use std::f64::consts::PI;

use thiserror::Error;

use crate::{Point2, Pose2, Reading, Shot};

/// The shape of the density behind the echo.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Profile {
    /// Falls from `p_max` at the echo to 0.5 behind it, never below.
    #[default]
    Smooth,
    /// The paper's words: one Gaussian on a floor of `p_min`, up to three sigma behind the echo. It dips
    /// below 0.5 behind a wall and so erodes thin walls from behind.
    Literal,
}

/// A sonar: its beam, its noise, its limits, and where it sits on the base.
///
/// Noise belongs to the sensor: no field depends on the size of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct SonarModel {
    /// Full opening angle of the cone [rad], above 0 and at most pi. Default 18 degrees: the paper's
    /// shots are 18 degrees apart. A wider beam smears walls along their arcs and closes doorways.
    pub beam_width: f64,
    /// Standard deviation of a measured range [m], 0.0001 to 10. Default 0.2, the paper's. A larger one
    /// thickens walls.
    pub sigma: f64,
    /// Occupancy in front of an echo, above 0 and below 0.5. Default 0.4, the paper's. A lower one
    /// clears faster, and lets fewer wrong readings erase a wall.
    pub p_min: f64,
    /// Occupancy at an echo, above 0.5 and below 1. Default 0.9, reconstructed from the paper: `p_min`
    /// plus the peak of the normal density times the cell of 0.25 m.
    pub p_max: f64,
    /// Echoes from farther away are no evidence, and silence is none beyond it [m]; above 0, up to 1000.
    /// Default 5, the reach of common indoor rangers.
    pub max_range: f64,
    /// Echoes from nearer than this are no evidence, nor do cells nearer than this ever get any [m];
    /// 0 or more, below `max_range`. Default 0.
    pub blanking: f64,
    /// Pose of the sonar in the base frame (`base_from_sonar`). Only the position enters the map: the
    /// bearing of a [`Shot`] is already given in the base frame.
    #[cfg_attr(feature = "serde", serde(with = "pose_as_array"))]
    pub mount: Pose2,
    /// The shape of the density behind the echo.
    pub profile: Profile,
}

impl Default for SonarModel {
    fn default() -> Self {
        Self {
            beam_width: 18.0 * PI / 180.0,
            sigma: 0.2,
            p_min: 0.4,
            p_max: 0.9,
            max_range: 5.0,
            blanking: 0.0,
            mount: Pose2::new(0.0, 0.0, 0.0),
            profile: Profile::Smooth,
        }
    }
}

/// Why a [`SonarModel`] was refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
#[error("sonar parameter {key}: expected {expected}, found {found}")]
pub struct SonarModelError {
    /// Name of the field.
    pub key: &'static str,
    /// What the field may be.
    pub expected: &'static str,
    /// What it was.
    pub found: f64,
}

impl SonarModel {
    /// Checks every field against its documented range.
    ///
    /// # Errors
    /// The first field that is out of range.
    pub fn validate(&self) -> Result<(), SonarModelError> {
        let check = |ok: bool, key, expected, found| {
            ok.then_some(()).ok_or(SonarModelError {
                key,
                expected,
                found,
            })
        };
        let Self {
            beam_width: beam,
            sigma,
            p_min,
            p_max,
            max_range,
            blanking,
            mount,
            ..
        } = *self;
        check(
            beam > 0.0 && beam <= PI,
            "beam_width",
            "an angle above 0 and at most pi rad",
            beam,
        )?;
        check(
            (1e-4..=10.0).contains(&sigma),
            "sigma",
            "0.0001 to 10 m",
            sigma,
        )?;
        check(
            (1e-6..0.5).contains(&p_min),
            "p_min",
            "0.000001 to below 0.5",
            p_min,
        )?;
        check(
            p_max > 0.5 && p_max <= 1.0 - 1e-6,
            "p_max",
            "above 0.5, up to 0.999999",
            p_max,
        )?;
        let range_ok = max_range > 0.0 && max_range <= 1000.0;
        check(range_ok, "max_range", "above 0 and up to 1000 m", max_range)?;
        let blanking_ok = (0.0..max_range).contains(&blanking);
        check(
            blanking_ok,
            "blanking",
            "0 m or more, below max_range",
            blanking,
        )?;
        for value in [mount.x, mount.y, mount.theta] {
            check(
                value.is_finite() && value.abs() <= 1e6,
                "mount",
                "three finite numbers",
                value,
            )?;
        }
        Ok(())
    }

    /// Where the sonar is and looks in one shot: position of the mount, heading along the beam's axis.
    #[must_use]
    pub fn map_from_beam(&self, shot: &Shot) -> Pose2 {
        let Point2 { x, y } = shot.map_from_base.transform_from(self.mount.position());
        Pose2::new(x, y, shot.map_from_base.theta + shot.bearing)
    }

    /// Occupancy of a place inside the beam at distance `r` from the sonar, after an echo from `d` [m]
    /// (§2.1; u = (r - d) / sigma, G = exp(-u^2 / 2)).
    ///
    /// `Smooth`: p_min + (p_max - p_min) G in front of the echo, 0.5 + (p_max - 0.5) G behind it.
    /// `Literal`: p_min + (p_max - p_min) G. Both: 0.5 where u > 3.
    #[must_use]
    pub fn occupancy(&self, r: f64, d: f64) -> f64 {
        let u = (r - d) / self.sigma;
        if u > 3.0 {
            return 0.5;
        }
        let floor = match self.profile {
            Profile::Smooth if u > 0.0 => 0.5,
            _ => self.p_min,
        };
        floor + (self.p_max - floor) * (-0.5 * u * u).exp()
    }

    /// Occupancy of a place inside the beam at distance `r` from the sonar, after silence up to
    /// `listened` [m]: 0.5 - (0.5 - p_min) (1 - r / listened), and 0.5 from there on.
    ///
    /// Silence is weak evidence: a smooth wall seen at a slant reflects the pulse away, and the more so
    /// the farther it is. Hence never below `p_min`, which holds at the sonar itself, and rising to 0.5.
    #[must_use]
    pub fn occupancy_no_echo(&self, r: f64, listened: f64) -> f64 {
        0.5 - (0.5 - self.p_min) * (1.0 - r / listened).clamp(0.0, 1.0)
    }

    /// Whether a reading is evidence under this model: an echo from `blanking..=max_range`, or silence up to
    /// a range above `blanking` (of which no more than `max_range` counts).
    #[must_use]
    pub fn is_evidence(&self, reading: Reading) -> bool {
        match reading {
            Reading::Echo { range } => range >= self.blanking && range <= self.max_range,
            Reading::NoEcho { listened } => listened > self.blanking,
            Reading::TooClose | Reading::Fault => false,
        }
    }
}

/// A pose in files: `[x, y, yaw]`.
#[cfg(feature = "serde")]
mod pose_as_array {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::Pose2;

    pub(super) fn serialize<S: Serializer>(pose: &Pose2, to: S) -> Result<S::Ok, S::Error> {
        [pose.x, pose.y, pose.theta].serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Pose2, D::Error> {
        let [x, y, theta] = <[f64; 3]>::deserialize(from)?;
        Ok(Pose2::new(x, y, theta))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn density_is_the_papers_table() {
        let smooth = SonarModel::default();
        let literal = SonarModel {
            profile: Profile::Literal,
            ..smooth
        };
        for (r, expect_smooth, expect_literal) in [
            (1.0, 0.400, 0.400),
            (1.4, 0.4056, 0.4056),
            (1.8, 0.7033, 0.7033),
            (2.0, 0.900, 0.900),
            (2.2, 0.7426, 0.7033),
            (2.4, 0.5541, 0.4677),
            (2.599_999, 0.5044, 0.4056),
            (2.600_001, 0.5, 0.5),
            (4.0, 0.5, 0.5),
        ] {
            assert!(
                (smooth.occupancy(r, 2.0) - expect_smooth).abs() < 5.1e-5,
                "smooth {r}"
            );
            assert!(
                (literal.occupancy(r, 2.0) - expect_literal).abs() < 5.1e-5,
                "literal {r}"
            );
        }
    }

    #[test]
    fn literal_dips_below_half_from_1_79_sigma() {
        let literal = SonarModel {
            profile: Profile::Literal,
            ..SonarModel::default()
        };
        assert!(literal.occupancy(2.0 + 1.79 * 0.2, 2.0) > 0.5);
        assert!(literal.occupancy(2.0 + 1.80 * 0.2, 2.0) < 0.5);
    }

    #[test]
    fn silence_is_bounded_and_fades() {
        let model = SonarModel::default();
        assert!((model.occupancy_no_echo(0.0, 4.0) - 0.4).abs() < 1e-12);
        assert!((model.occupancy_no_echo(2.0, 4.0) - 0.45).abs() < 1e-12);
        assert!((model.occupancy_no_echo(4.0, 4.0) - 0.5).abs() < 1e-12);
        assert!((model.occupancy_no_echo(9.0, 4.0) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn every_field_is_checked_by_name() {
        let good = SonarModel::default();
        good.validate().expect("the defaults are valid");
        let bad = [
            (
                "beam_width",
                SonarModel {
                    beam_width: 0.0,
                    ..good
                },
            ),
            (
                "beam_width",
                SonarModel {
                    beam_width: f64::NAN,
                    ..good
                },
            ),
            (
                "sigma",
                SonarModel {
                    sigma: -0.1,
                    ..good
                },
            ),
            ("p_min", SonarModel { p_min: 0.5, ..good }),
            ("p_max", SonarModel { p_max: 1.0, ..good }),
            (
                "max_range",
                SonarModel {
                    max_range: f64::INFINITY,
                    ..good
                },
            ),
            (
                "blanking",
                SonarModel {
                    blanking: 5.0,
                    ..good
                },
            ),
            (
                "mount",
                SonarModel {
                    mount: Pose2::new(0.0, f64::NAN, 0.0),
                    ..good
                },
            ),
        ];
        for (key, model) in bad {
            assert_eq!(model.validate().expect_err(key).key, key);
        }
    }

    #[test]
    fn the_beam_starts_at_the_mount_and_follows_the_bearing() {
        let model = SonarModel {
            mount: Pose2::new(0.2, 0.1, 1.0),
            ..SonarModel::default()
        };
        let shot = Shot {
            stamp: 0.0,
            map_from_base: Pose2::new(1.0, 2.0, PI / 2.0),
            bearing: 0.25,
            reading: Reading::Fault,
        };
        let beam = model.map_from_beam(&shot);
        assert!((beam.x - 0.9).abs() < 1e-12 && (beam.y - 2.2).abs() < 1e-12);
        assert!((beam.theta - (PI / 2.0 + 0.25)).abs() < 1e-12);
    }

    #[cfg(feature = "map-files")]
    #[test]
    fn files_may_leave_out_keys_but_not_invent_any() {
        let text = "beam_width: 0.35\nmax_range: 4\nmount: [0.1, 0, 1.5]\n";
        let model: SonarModel = serde_saphyr::from_str(text).expect("good parameters");
        let expected = SonarModel {
            beam_width: 0.35,
            max_range: 4.0,
            mount: Pose2::new(0.1, 0.0, 1.5),
            ..SonarModel::default()
        };
        assert_eq!(model, expected);
        let unknown: Result<SonarModel, _> = serde_saphyr::from_str("beam_wdth: 0.35\n");
        let message = unknown.expect_err("a misspelt key").to_string();
        assert!(message.contains("beam_wdth"), "{message}");
        assert!(serde_saphyr::from_str::<SonarModel>("mount: [0.1, 0]\n").is_err());
    }
}
