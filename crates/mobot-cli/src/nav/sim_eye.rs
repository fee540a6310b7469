//! The simulated robot's camera, calibrated as a person would: with marks on the floor.

use mobot_hw::sim::{CameraModel, Distortion};
use monocal::{CalibrateParams, CameraMatrix, FloorCamera, Lens, Noise, Pair, calibrate};
use occgrid::{Point2, Pose2};

/// Calibrates a simulated camera with the marks of a grid that it sees, 2 to 6 m ahead, its lens given; `None`
/// where it sees too few.
#[must_use]
pub fn calibrated(model: &CameraModel) -> Option<FloorCamera> {
    let mut pairs = Vec::new();
    for row in 0..6 {
        for column in -2..=2 {
            let floor = [2.0 + 0.8 * f64::from(row), 0.5 * f64::from(column)];
            let mark = Point2::new(floor[0], floor[1]);
            let seen = model.pixel_of(Pose2::default(), mark, 0.0);
            let inside = |[u, v]: &[f64; 2]| {
                (0.0..f64::from(model.width)).contains(u)
                    && (0.0..f64::from(model.height)).contains(v)
            };
            if let Some(pixel) = seen.filter(inside) {
                pairs.push(Pair::new(pixel, floor));
            }
        }
    }
    let params = CalibrateParams {
        noise: Noise::Pixel,
        pixel_sigma_px: 0.3,
        estimate_sigma: false,
        image_size: Some([model.width, model.height]),
        lens: lens(model),
        ..CalibrateParams::default()
    };
    Some(calibrate(&pairs, &params).ok()?.camera)
}

fn lens(model: &CameraModel) -> Option<Lens> {
    let distortion = match model.distortion {
        Distortion::None => return None,
        Distortion::PlumbBob { coefficients } => monocal::Distortion::PlumbBob(coefficients),
        Distortion::Fisheye { coefficients } => monocal::Distortion::Equidistant(coefficients),
    };
    let CameraModel { fx, fy, cx, cy, .. } = *model;
    Lens::new(CameraMatrix { fx, fy, cx, cy }, distortion).ok()
}
