//! The part of a picture to look at.

use std::ops::Range;

/// The part of a picture to look at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Region {
    /// All of it.
    #[default]
    Whole,
    /// The pixels (u, v) with `a u + b v + c > 0` for `[a, b, c]`: one side of a line, such as the floor's
    /// side of the horizon. `[0.0, 1.0, -99.5]` are the rows from 100 on. No pixel if one is no number.
    HalfPlane([f64; 3]),
}

impl Region {
    /// Whether pixel (u, v) is inside.
    #[must_use]
    pub fn contains(&self, u: u32, v: u32) -> bool {
        match *self {
            Self::Whole => true,
            Self::HalfPlane([a, b, c]) => a * f64::from(u) + (b * f64::from(v) + c) > 0.0,
        }
    }

    /// The columns of row `v` that are inside.
    pub(crate) fn columns(&self, v: u32, width: u32) -> Range<u32> {
        let rising = match *self {
            Self::Whole => return 0..width,
            Self::HalfPlane([a, ..]) => a > 0.0,
        };
        // the rounded form is still monotonic along a row: its border is found, not computed
        let (mut from, mut to) = (0, width);
        while from < to {
            let middle = from + (to - from) / 2;
            if self.contains(middle, v) == rising {
                to = middle;
            } else {
                from = middle + 1;
            }
        }
        if rising { from..width } else { 0..from }
    }
}
