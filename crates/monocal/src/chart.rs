//! Coordinates for the 8 degrees of freedom of a homography, without a privileged entry.
//!
//! Dividing by the last entry fails where it is zero (the pixel (0, 0) on the horizon). Here the nine entries
//! `h`, row-major, are a unit vector, and small changes of it are `B d` with `d` in R^8 and `B` the first
//! eight columns of the Householder reflection `I - 2 w w^T / (w^T w)`, `w = h + s e9`, `s` = 1 where the last
//! entry is 0 or more, else -1. Its columns are orthonormal and orthogonal to `h`, for every `h`.
//!
//! Source: R. Hartley, A. Zisserman, Multiple View Geometry in Computer Vision, 2nd ed., appendix A6.9.3.

use nalgebra::{SMatrix, SVector};

use crate::{FloorHomography, PixelPoint};

/// The nine entries of a homography, row-major.
pub(crate) type Entries = SVector<f64, 9>;

/// The matrix `B` at a homography: orthonormal columns, each orthogonal to its entries.
pub(crate) fn basis(homography: &FloorHomography) -> SMatrix<f64, 9, 8> {
    basis_of(&entries(homography))
}

/// The matrix `B` at a unit 9-vector.
pub(crate) fn basis_of(h: &Entries) -> SMatrix<f64, 9, 8> {
    let mut w = *h;
    w[8] += if h[8] >= 0.0 { 1.0 } else { -1.0 };
    let scale = 2.0 / w.norm_squared();
    SMatrix::from_fn(|r, c| f64::from(u8::from(r == c)) - scale * w[r] * w[c])
}

/// The nine entries at unit norm.
pub(crate) fn entries(homography: &FloorHomography) -> Entries {
    let m = homography.pixel_to_floor();
    Entries::from_fn(|k, _| m[k / 3][k % 3])
}

/// How the floor point (x, y) of a pixel and its depth `D` move with the entries: rows x, y, D; `None` on and
/// above the horizon.
pub(crate) fn by_entries(
    homography: &FloorHomography,
    pixel: PixelPoint,
) -> Option<SMatrix<f64, 3, 9>> {
    let point = homography.floor_point(pixel)?;
    let p = [pixel.u, pixel.v, 1.0];
    let depth = homography.depth(pixel);
    let mut rows = SMatrix::zeros();
    for (k, &coordinate) in p.iter().enumerate() {
        rows[(0, k)] = coordinate / depth;
        rows[(1, 3 + k)] = coordinate / depth;
        rows[(0, 6 + k)] = -point.x * coordinate / depth;
        rows[(1, 6 + k)] = -point.y * coordinate / depth;
        rows[(2, 6 + k)] = coordinate;
    }
    Some(rows)
}
