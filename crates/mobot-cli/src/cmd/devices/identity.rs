//! What a device is by its URI.

use mobot_hw::serial::MaxBotixModel;

use super::probe::Named;
use crate::uri::{Base, Camera, SonarKind, Turret};

impl Named {
    /// Maker and model, as far as they were typed.
    pub(super) fn identity(&self) -> &'static str {
        match self {
            Self::Base(uri) => match uri.device {
                Base::Sim => "simulated base",
                Base::Create2 { .. } => "iRobot Create 2 or Roomba, Open Interface",
                Base::Kobuki { .. } => "Yujin Kobuki",
                Base::Arduino { .. } => "Arduino with ROSArduinoBridge",
                Base::Replay(_) => "recorded base",
            },
            Self::Sonar(uri) => match uri.device.kind {
                SonarKind::Sim => "simulated sonar",
                SonarKind::MaxBotix { model, .. } => match model {
                    MaxBotixModel::Lv => "MaxBotix LV-MaxSonar-EZ",
                    MaxBotixModel::Xl => "MaxBotix XL-MaxSonar",
                    MaxBotixModel::XlLong => "MaxBotix XL-MaxSonar, 10 m",
                    MaxBotixModel::Hrlv => "MaxBotix HRLV-MaxSonar or HRUSB-MaxSonar",
                    MaxBotixModel::HrxlLong => "MaxBotix HRXL-MaxSonar, 10 m",
                    _ => "MaxBotix HRXL-MaxSonar",
                },
                SonarKind::Ff { .. } => "sonar of the FF H L SUM family",
                SonarKind::Urm37 { .. } => "DFRobot URM37",
                SonarKind::Us100 { .. } => "US-100",
                SonarKind::Srf02 { .. } => "Devantech SRF02",
                SonarKind::Replay(_) => "recorded sonar",
            },
            Self::Turret(uri) => match uri.device {
                Turret::Maestro { .. } => "Pololu Maestro",
                Turret::Sim => "simulated pan",
                Turret::Urm37 { .. } => "servo of a URM37",
                Turret::Replay(_) => "recorded pan",
                Turret::None => "none",
            },
            Self::Camera(uri) => match uri.device {
                Camera::Sim => "simulated camera",
                #[cfg(target_os = "linux")]
                Camera::V4l2 { .. } => "V4L2 camera",
                Camera::Mjpeg { .. } => "MJPEG stream",
                Camera::Replay(_) => "recorded camera",
                Camera::None => "none",
            },
        }
    }
}
