//! The grid as a picture, and as a finished map.

use crate::grid::probability;
use crate::{OccupancyGrid, OccupancyMap};

/// Highest percentage at which a cell counts as free in a finished map: two readings that saw past it, or
/// more, and none that hit it.
pub const FREE_AT_MOST: i8 = 35;

/// Lowest percentage at which a cell counts as occupied in a finished map.
pub const OCCUPIED_AT_LEAST: i8 = 65;

/// Gray level of a probability of occupancy: inverse linear, p = 0 -> 255, p = 1 -> 0, rounded to the nearest
/// level and from halfway to the darker one, so that p = 0.5 -> 127 (§2.1).
///
/// With the threshold at 0.5 a pixel is free where its level is 128 or more: unknown is never free.
#[must_use]
pub fn gray_level(p: f32) -> u8 {
    (255.0 * (1.0 - f64::from(p)) - 0.5)
        .ceil()
        .clamp(0.0, 255.0) as u8
}

impl OccupancyGrid {
    /// The 8-bit occupancy image in image order: darker = more likely occupied ([`gray_level`]).
    #[must_use]
    pub fn to_gray(&self) -> Vec<u8> {
        self.log_odds()
            .iter()
            .map(|&l| gray_level(probability(l)))
            .collect()
    }

    /// The 8-bit occupancy image ([`gray_level`]).
    ///
    /// # Panics
    /// Never: the frame and the cells are of one size.
    #[cfg(feature = "image")]
    #[must_use]
    pub fn to_gray_image(&self) -> image::GrayImage {
        let frame = self.frame();
        image::GrayImage::from_raw(frame.width(), frame.height(), self.to_gray())
            .expect("one pixel a cell")
    }

    /// The finished map, values in percent rounded to the nearest; -1 (unknown) where the evidence adds up
    /// to nothing. A cell is free up to `free_at_most`, occupied from `occupied_at_least`, unknown between.
    ///
    /// # Panics
    /// If `free_at_most >= occupied_at_least`.
    #[must_use]
    pub fn to_occupancy_map(&self, free_at_most: i8, occupied_at_least: i8) -> OccupancyMap {
        let percent = |&l: &f32| {
            if l == 0.0 {
                -1
            } else {
                (100.0 * probability(l)).round() as i8
            }
        };
        let values = self.log_odds().iter().map(percent).collect();
        OccupancyMap::new(*self.frame(), values, free_at_most, occupied_at_least)
    }
}
