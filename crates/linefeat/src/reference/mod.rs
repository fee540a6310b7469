//! Plain code for what the fast versions do: what they are tested against.

pub mod canny;
pub mod gradient;
pub mod hough;
pub mod segment;
