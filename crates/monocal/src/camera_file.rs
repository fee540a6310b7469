//! A calibrated camera as a JSON file.

use std::path::Path;

use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

use crate::camera_file_error::{content, quoted, read_small};
use crate::camera_info::distortion;
use crate::{CameraFileError, CameraMatrix, FloorCamera, FloorHomography, Lens};

#[derive(Serialize, Deserialize)]
struct Document {
    pixel_to_floor: [[f64; 3]; 3],
    #[serde(default)]
    covariance: [[f64; 8]; 8],
    #[serde(default)]
    covariance_chart: String,
    #[serde(default = "half_a_pixel")]
    pixel_sigma_px: f64,
    #[serde(default)]
    image_size: Option<[u32; 2]>,
    #[serde(default)]
    lens: Option<LensDocument>,
}

#[derive(Serialize, Deserialize)]
struct LensDocument {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    distortion_model: String,
    distortion_coefficients: Vec<f64>,
}

/// What the file says of its covariance, for readers of the file alone.
const CHART: &str = "h = pixel_to_floor row-major at unit norm, det < 0; dh = B d, B = first 8 columns of \
                     I - 2 w w^T / (w^T w), w = h + s e9, s = 1 if h9 >= 0 else -1; covariance is that of d";

fn half_a_pixel() -> f64 {
    0.5
}

impl FloorCamera {
    /// The camera as the text of a JSON file: `pixel_to_floor` (3 x 3, row-major, homogeneous), `covariance`
    /// (8 x 8, in the chart that `covariance_chart` describes), `pixel_sigma_px`, `image_size`
    /// `[width, height]` and `lens` or null.
    #[must_use]
    pub fn to_json(&self) -> String {
        let lens = self.lens.map(|lens| {
            let CameraMatrix { fx, fy, cx, cy } = lens.matrix();
            LensDocument {
                fx,
                fy,
                cx,
                cy,
                distortion_model: lens.distortion().name().to_owned(),
                distortion_coefficients: lens.distortion().coefficients().to_vec(),
            }
        });
        let document = Document {
            pixel_to_floor: self.homography.pixel_to_floor(),
            covariance: self.covariance,
            covariance_chart: CHART.to_owned(),
            pixel_sigma_px: self.pixel_sigma_px,
            image_size: self.image_size,
            lens,
        };
        // numbers and strings only: nothing that JSON cannot hold
        serde_json::to_string_pretty(&document).unwrap_or_default()
    }

    /// Reads a camera's JSON file. Of the keys that [`to_json`](Self::to_json) writes, only
    /// `pixel_to_floor` must be there; without `covariance` the homography is taken as exact.
    ///
    /// # Errors
    /// [`CameraFileError`] for files that are not that, or hold numbers that no camera has.
    pub fn load(file: &Path) -> Result<Self, CameraFileError> {
        let text = read_small(file)?;
        let document: Document = serde_json::from_str(&text).map_err(|e| {
            let place = format!("line {}, column {}", e.line(), e.column());
            content(file, place, "a camera", quoted(&e.to_string()))
        })?;
        let homography = FloorHomography::new(document.pixel_to_floor)
            .map_err(|e| content(file, "pixel_to_floor", "a floor homography", e.to_string()))?;
        check_covariance(file, &document.covariance)?;
        let sigma = document.pixel_sigma_px;
        if !(sigma.is_finite() && sigma >= 0.0) {
            return Err(content(
                file,
                "pixel_sigma_px",
                "0 or more",
                sigma.to_string(),
            ));
        }
        if let Some([width, height]) = document.image_size
            && (width == 0 || height == 0)
        {
            let found = format!("{width} x {height}");
            return Err(content(file, "image_size", "1 x 1 or more", found));
        }
        let lens = document
            .lens
            .map(|lens| read_lens(file, &lens))
            .transpose()?;
        Ok(Self {
            homography,
            covariance: document.covariance,
            pixel_sigma_px: sigma,
            image_size: document.image_size,
            lens,
        })
    }
}

fn read_lens(file: &Path, lens: &LensDocument) -> Result<Lens, CameraFileError> {
    let LensDocument { fx, fy, cx, cy, .. } = *lens;
    let distortion = distortion(file, &lens.distortion_model, &lens.distortion_coefficients)?;
    Lens::new(CameraMatrix { fx, fy, cx, cy }, distortion)
        .map_err(|e| content(file, "lens", "a lens", e.to_string()))
}

/// Refuses what is no covariance.
fn check_covariance(file: &Path, covariance: &[[f64; 8]; 8]) -> Result<(), CameraFileError> {
    let wrong = |expected: &str, found: String| Err(content(file, "covariance", expected, found));
    let matrix = SMatrix::<f64, 8, 8>::from_fn(|r, c| covariance[r][c]);
    if let Some(found) = matrix.iter().find(|v| !v.is_finite()) {
        return wrong("finite numbers", found.to_string());
    }
    let skew = (matrix - matrix.transpose()).amax();
    if skew > 1e-9 * matrix.amax() {
        return wrong(
            "a symmetric matrix",
            format!("entries that differ by {skew:e}"),
        );
    }
    let least = matrix.symmetric_eigenvalues().min();
    if least < -1e-9 * matrix.amax() {
        return wrong(
            "a positive semidefinite matrix",
            format!("eigenvalue {least:e}"),
        );
    }
    Ok(())
}
