//! The paper's own calibration, as a fixture.
//!
//! Source: W. Choi, C. Ryu, H. Kim, Navigation of a Mobile Robot using Mono-Vision and Mono-Audition,
//! IEEE Int. Conf. on Systems, Man, and Cybernetics 1999, section 3.1. The matrix is printed with four
//! decimals, which leaves up to 1.7 m of depth open in the picture's far corner: it shows the geometry and
//! is no target to regress to.

use crate::{FloorHomography, HomographyError};

/// Width and height of the paper's picture [px].
pub const IMAGE_SIZE: [u32; 2] = [480, 220];

/// The focal length that the paper's matrix implies, about [px].
pub const FOCAL_PX: f64 = 450.0;

/// The height of the camera above the floor that the paper's matrix implies, about [m].
pub const HEIGHT: f64 = 1.0;

/// The tilt below the horizontal that the paper's matrix implies, about [rad].
pub const TILT: f64 = 24.0 * std::f64::consts::PI / 180.0;

/// A^-1 as printed: pixels with y = -row, centimetres, X to the left and Y negative ahead.
pub const PRINTED: [[f64; 3]; 3] = [
    [-0.1403, -0.0021, 34.6207],
    [-0.0089, 0.0248, -68.5416],
    [-0.0000, -0.0013, 0.1131],
];

/// The printed matrix in this crate's axes: rows downwards, metres, x forward, y left.
///
/// # Errors
/// None in practice: the matrix can be inverted.
pub fn homography() -> Result<FloorHomography, HomographyError> {
    let [left, back, depth] = PRINTED.map(|[a, b, c]| [a, -b, c]);
    FloorHomography::new([
        back.map(|entry| -entry / 100.0),
        left.map(|entry| entry / 100.0),
        depth,
    ])
}
