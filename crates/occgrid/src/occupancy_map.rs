//! A finished map: occupancy values as Nav2 holds them, in a [`MapFrame`].

use crate::{Cell, MapFrame};

/// What a cell of a finished map is known to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellState {
    /// Known to be free.
    Free,
    /// Known to be occupied.
    Occupied,
    /// Not known. Never counted as free.
    Unknown,
}

/// Occupancy values -1 (unknown) or 0..=100, row 0 at the top, and the thresholds that class them.
#[derive(Debug, Clone, PartialEq)]
pub struct OccupancyMap {
    frame: MapFrame,
    values: Vec<i8>,
    free_at_most: i8,
    occupied_at_least: i8,
}

impl OccupancyMap {
    /// A map from values in image order (row 0 = top). A value v is free if `0 <= v <= free_at_most`,
    /// occupied if `v >= occupied_at_least`, else unknown.
    ///
    /// # Panics
    /// If the number of values is not the frame's cell count, or `free_at_most >= occupied_at_least`.
    #[must_use]
    pub fn new(frame: MapFrame, values: Vec<i8>, free_at_most: i8, occupied_at_least: i8) -> Self {
        assert_eq!(values.len(), frame.cell_count(), "one value a cell");
        assert!(free_at_most < occupied_at_least, "thresholds out of order");
        Self {
            frame,
            values,
            free_at_most,
            occupied_at_least,
        }
    }

    /// Where the map is.
    #[must_use]
    pub const fn frame(&self) -> &MapFrame {
        &self.frame
    }

    /// The values in image order, row 0 = top.
    #[must_use]
    pub fn values(&self) -> &[i8] {
        &self.values
    }

    /// The highest value that counts as free.
    #[must_use]
    pub const fn free_at_most(&self) -> i8 {
        self.free_at_most
    }

    /// The lowest value that counts as occupied.
    #[must_use]
    pub const fn occupied_at_least(&self) -> i8 {
        self.occupied_at_least
    }

    /// What a value means on this map.
    #[must_use]
    pub const fn classify(&self, value: i8) -> CellState {
        if value >= self.occupied_at_least {
            CellState::Occupied
        } else if value >= 0 && value <= self.free_at_most {
            CellState::Free
        } else {
            CellState::Unknown
        }
    }

    /// What a cell is known to be.
    ///
    /// # Panics
    /// If the cell is outside the map.
    #[must_use]
    pub fn state(&self, cell: Cell) -> CellState {
        self.classify(self.values[self.frame.index(cell)])
    }
}
