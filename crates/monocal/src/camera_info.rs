//! ROS's `camera_info` YAML: picture size, camera matrix and distortion.
//!
//! Rectification and projection matrices are for stereo pairs and are not looked at.

use std::path::Path;

use serde::Deserialize;

use crate::camera_file_error::{content, quoted, read_small};
use crate::{CameraFileError, CameraMatrix, Distortion, Lens};

/// What a `camera_info` file says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraInfo {
    /// Width and height of the picture [px].
    pub image_size: [u32; 2],
    /// Camera matrix and distortion.
    pub lens: Lens,
}

/// Bounds on the parser: a camera_info file nests three deep and has about 60 nodes.
const MOST_DEPTH: usize = 8;
const MOST_NODES: usize = 512;

#[derive(Deserialize)]
struct Document {
    image_width: Option<u32>,
    image_height: Option<u32>,
    camera_matrix: Option<Matrix>,
    distortion_model: Option<String>,
    distortion_coefficients: Option<Matrix>,
}

#[derive(Deserialize)]
struct Matrix {
    data: Vec<f64>,
}

impl CameraInfo {
    /// Reads a file as `camera_calibration` writes it.
    ///
    /// # Errors
    /// [`CameraFileError`] for files that are not that, or hold numbers that no camera has.
    pub fn load(file: &Path) -> Result<Self, CameraFileError> {
        let document = parse(file, &read_small(file)?)?;
        let missing = |key: &str| content(file, "keys", format!("a value for {key}"), "none");
        let width = document.image_width.ok_or_else(|| missing("image_width"))?;
        let height = document
            .image_height
            .ok_or_else(|| missing("image_height"))?;
        for (key, size) in [("image_width", width), ("image_height", height)] {
            if size == 0 {
                return Err(content(file, key, "1 or more", "0"));
            }
        }
        let matrix = document
            .camera_matrix
            .ok_or_else(|| missing("camera_matrix"))?
            .data;
        let matrix = camera_matrix(file, &matrix)?;
        let model = document.distortion_model.unwrap_or_default();
        let coefficients = document
            .distortion_coefficients
            .map(|m| m.data)
            .unwrap_or_default();
        let distortion = distortion(file, &model, &coefficients)?;
        let lens = Lens::new(matrix, distortion).map_err(|e| {
            content(
                file,
                "camera_matrix, distortion_coefficients",
                "a lens",
                e.to_string(),
            )
        })?;
        Ok(Self {
            image_size: [width, height],
            lens,
        })
    }
}

fn camera_matrix(file: &Path, data: &[f64]) -> Result<CameraMatrix, CameraFileError> {
    let place = "camera_matrix";
    let &[fx, skew, cx, _, fy, cy, ..] = data else {
        return Err(content(file, place, "9 numbers", format!("{}", data.len())));
    };
    if skew != 0.0 {
        return Err(content(file, place, "no skew", skew.to_string()));
    }
    Ok(CameraMatrix { fx, fy, cx, cy })
}

/// The distortion of a model's name and coefficients; missing ones at the end are zero.
pub(crate) fn distortion(
    file: &Path,
    model: &str,
    coefficients: &[f64],
) -> Result<Distortion, CameraFileError> {
    fn padded<const N: usize>(
        file: &Path,
        coefficients: &[f64],
    ) -> Result<[f64; N], CameraFileError> {
        // OpenCV writes more, zero where they are not used
        if coefficients.iter().skip(N).any(|k| *k != 0.0) {
            let found = format!("{}", coefficients.len());
            return Err(content(
                file,
                "distortion_coefficients",
                format!("{N} numbers"),
                found,
            ));
        }
        Ok(std::array::from_fn(|k| {
            coefficients.get(k).copied().unwrap_or(0.0)
        }))
    }
    match model {
        "plumb_bob" => padded(file, coefficients).map(Distortion::PlumbBob),
        "" if coefficients.iter().all(|k| *k == 0.0) => Ok(Distortion::PlumbBob([0.0; 5])),
        "rational_polynomial" => padded(file, coefficients).map(Distortion::RationalPolynomial),
        "equidistant" | "fisheye" => padded(file, coefficients).map(Distortion::Equidistant),
        other => {
            let expected = "plumb_bob, rational_polynomial or equidistant";
            Err(content(file, "distortion_model", expected, quoted(other)))
        }
    }
}

fn parse(file: &Path, text: &str) -> Result<Document, CameraFileError> {
    let parser = serde_saphyr::options! {
        budget: serde_saphyr::budget! {
            max_depth: MOST_DEPTH,
            flow_nesting_limit: MOST_DEPTH,
            max_nodes: MOST_NODES,
            max_events: 4 * MOST_NODES,
            max_aliases: 0,
            max_documents: 1,
        },
        duplicate_keys: serde_saphyr::options::DuplicateKeyPolicy::Error,
    };
    serde_saphyr::from_str_with_options(text, parser).map_err(|e| {
        let place = e.location().map_or_else(
            || "YAML".to_owned(),
            |at| format!("line {}, column {}", at.line(), at.column()),
        );
        let rendered = e.render_with_options(serde_saphyr::render_options! {
            snippets: serde_saphyr::SnippetMode::Off,
        });
        content(file, place, "a camera_info YAML", quoted(&rendered))
    })
}
