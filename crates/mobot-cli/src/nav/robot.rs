//! A robot: its devices, and what is known of it.

use occgrid::SonarModel;

use super::{AvoidParams, FilterParams, LocalizerParams, SafetyParams};

/// What a robot is driven with. All times are on the one clock.
#[derive(Debug)]
pub struct Devices<B, S, C, K> {
    /// The wheels.
    pub base: B,
    /// The sonar.
    pub sonar: S,
    /// The camera, where there is one.
    pub camera: Option<C>,
    /// The clock that goes with them.
    pub clock: K,
}

/// How the loop runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunnerParams {
    /// What is safe.
    pub safety: SafetyParams,
    /// How well wheels are known.
    pub filter: FilterParams,
    /// How the pose is corrected.
    pub localizer: LocalizerParams,
    /// What is not on the map.
    pub avoid: AvoidParams,
    /// The sonar as the map sees it.
    pub sonar: SonarModel,
    /// Side of a cell of the map that is made on the way [m].
    pub resolution: f64,
    /// A frame is taken every so many steps, 1 or more. Raised: fewer corrections, less work.
    pub frame_every: u32,
    /// How far ahead the map is looked at [m].
    pub look_ahead: f64,
}

impl Default for RunnerParams {
    fn default() -> Self {
        Self {
            safety: SafetyParams::default(),
            filter: FilterParams::default(),
            localizer: LocalizerParams::default(),
            avoid: AvoidParams::default(),
            sonar: SonarModel {
                sigma: 0.05,
                blanking: 0.2,
                ..SonarModel::default()
            },
            resolution: 0.05,
            frame_every: 4,
            look_ahead: 3.0,
        }
    }
}

impl RunnerParams {
    /// For a round body of this radius [m] with this sonar.
    #[must_use]
    pub fn of(radius: f64, sonar: SonarModel) -> Self {
        let mut params = Self {
            sonar,
            ..Self::default()
        };
        params.safety.radius = radius;
        params.safety.sonar_ahead = sonar.mount.x;
        params.localizer.sonar = sonar;
        params.localizer.echo_reach = 0.9 * sonar.max_range;
        params.avoid.base_from_sonar = sonar.mount;
        params
    }
}
