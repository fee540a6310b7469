//! Why pairs determine no camera.

use thiserror::Error;

/// The picture or the floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Pixels.
    Picture,
    /// Floor points.
    Floor,
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Picture => "pixels",
            Self::Floor => "floor points",
        })
    }
}

/// Why pairs determine no camera over a floor. Pairs are numbered from 0.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// Fewer than four pairs.
    #[error("expected at least 4 pairs, found {found}")]
    TooFew {
        /// Number of pairs.
        found: usize,
    },
    /// More than [`MOST_PAIRS`](crate::MOST_PAIRS).
    #[error("expected at most {most} pairs, found {found}")]
    TooMany {
        /// [`MOST_PAIRS`](crate::MOST_PAIRS).
        most: usize,
        /// Number of pairs.
        found: usize,
    },
    /// A coordinate is NaN, infinite or beyond a million pixels or metres.
    #[error("pair {index}: expected {side} within a million, found ({a}, {b})")]
    OutOfRange {
        /// The pair.
        index: usize,
        /// Where.
        side: Side,
        /// First coordinate.
        a: f64,
        /// Second coordinate.
        b: f64,
    },
    /// Two pairs are the same.
    #[error("pair {second}: expected another pair than {first}, found the same")]
    Duplicate {
        /// The first of the two.
        first: usize,
        /// The second of the two.
        second: usize,
    },
    /// The lens model cannot have produced this pixel.
    #[error("pair {index}: expected a pixel within the lens model's range, found ({u}, {v})")]
    OutsideLens {
        /// The pair.
        index: usize,
        /// Column [px].
        u: f64,
        /// Row [px].
        v: f64,
    },
    /// An expected sigma is not a number above zero.
    #[error("{name}: expected a number above 0, found {found}")]
    Sigma {
        /// Of the parameter.
        name: &'static str,
        /// Its value.
        found: f64,
    },
    /// Marks were read several times each, but there are too few of them.
    #[error("{side}: expected at least 4 different places, found {found}")]
    FewPlaces {
        /// Where.
        side: Side,
        /// Number of different places.
        found: usize,
    },
    /// All points are on a line, to within the expected noise.
    #[error("{side}: expected points on more than one line, found all on one")]
    Collinear {
        /// Where.
        side: Side,
    },
    /// All points but one are on a line, to within the expected noise; of four, three.
    #[error(
        "{side}: expected two points and more off any line, found all but that of pair {off} on one"
    )]
    CollinearButOne {
        /// Where.
        side: Side,
        /// The pair that is off the line.
        off: usize,
    },
    /// The pairs only fit a camera behind which some of its own floor points lie.
    #[error(
        "pair {index}: expected a floor point before the camera, found one beyond the horizon of the others"
    )]
    BeyondHorizon {
        /// One of the pairs beyond.
        index: usize,
    },
    /// The pairs show the floor in a mirror: an axis points the wrong way.
    #[error(
        "expected x forward and y to the left, u to the right and v down, found a mirrored floor"
    )]
    Mirrored,
    /// The pairs do not agree on any homography.
    #[error(
        "expected pairs that agree, found {pairs} with errors of {rms_px:.1} px (RMS) at the best"
    )]
    Inconsistent {
        /// Number of pairs.
        pairs: usize,
        /// RMS distance of all pixels from where the best fit puts them [px].
        rms_px: f64,
    },
    /// The pairs hardly determine a homography, for no reason that has a name above.
    #[error(
        "expected pairs that determine all 8 degrees of freedom, found them all but degenerate"
    )]
    Undetermined,
}
