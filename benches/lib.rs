//! Inputs of the benchmarks: real building maps at three sizes, camera frames.

pub mod frames;
pub mod view;

use std::path::{Path, PathBuf};

use morpho::BitImage;
use occgrid::{CellState, LoadOptions, MapFrame, OccupancyMap, Pose2, load_map};

/// Gray value of a free cell in [`BuildingMap::gray`].
pub const FREE: u8 = 254;
/// Gray value of an unknown cell.
pub const UNKNOWN: u8 = 205;
/// Gray value of an occupied cell.
pub const OCCUPIED: u8 = 0;
/// From this gray value on a cell is free.
pub const FREE_FROM: u8 = 250;

/// Width of the corridors that join the tiles of the large map [cells].
const CORRIDOR_CELLS: usize = 40;

/// A map as 8-bit occupancy picture, row 0 at the top.
pub struct BuildingMap {
    /// What it is.
    pub name: &'static str,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// [`FREE`], [`UNKNOWN`] or [`OCCUPIED`], row after row.
    pub gray: Vec<u8>,
    /// Side of a cell [m].
    pub resolution: f64,
}

impl BuildingMap {
    /// The Intel Research Lab, Seattle: 579 x 581 cells of 0.1 m.
    #[must_use]
    pub fn small() -> Self {
        Self::load("intel", "utexas_gdc/intel.yaml")
    }

    /// The third floor of the Gates-Dell Complex, UT Austin: 1857 x 1255 cells of 0.05 m.
    #[must_use]
    pub fn medium() -> Self {
        Self::load("gdc3", "utexas_gdc/real-3/3.yaml")
    }

    /// 4096 x 4096 cells: that floor laid side by side until the square is full, with a corridor along
    /// the middle of each floor's width and height, so that the floors are joined.
    #[must_use]
    pub fn large() -> Self {
        const SIDE: usize = 4096;
        let tile = Self::medium();
        let in_corridor = |at: usize, side: usize| {
            let middle = side / 2;
            (middle - CORRIDOR_CELLS / 2..middle + CORRIDOR_CELLS / 2).contains(&(at % side))
        };
        let mut gray = Vec::with_capacity(SIDE * SIDE);
        for y in 0..SIDE {
            for x in 0..SIDE {
                let joined = in_corridor(x, tile.width) || in_corridor(y, tile.height);
                let there = tile.gray[y % tile.height * tile.width + x % tile.width];
                gray.push(if joined { FREE } else { there });
            }
        }
        Self {
            name: "gdc3 x 7",
            width: SIDE,
            height: SIDE,
            gray,
            resolution: tile.resolution,
        }
    }

    /// The free cells.
    #[must_use]
    pub fn bits(&self) -> BitImage {
        morpho::threshold(&self.gray, self.width, self.height, FREE_FROM)
    }

    /// The map as the planner takes it.
    ///
    /// # Panics
    /// Never: the sizes are those of real maps.
    #[must_use]
    pub fn occupancy(&self) -> OccupancyMap {
        let frame = MapFrame::new(
            self.width as u32,
            self.height as u32,
            self.resolution,
            Pose2::default(),
        )
        .expect("a valid frame");
        let values = self.gray.iter().map(|&g| match g {
            FREE => 0,
            OCCUPIED => 100,
            _ => -1,
        });
        OccupancyMap::new(frame, values.collect(), 0, 100)
    }

    fn load(name: &'static str, path: &str) -> Self {
        let map = load_map(maps().join(path), &LoadOptions::default())
            .expect("a map")
            .map;
        let gray = map.values().iter().map(|&v| match map.classify(v) {
            CellState::Free => FREE,
            CellState::Occupied => OCCUPIED,
            CellState::Unknown => UNKNOWN,
        });
        Self {
            name,
            width: map.frame().width() as usize,
            height: map.frame().height() as usize,
            gray: gray.collect(),
            resolution: map.frame().resolution(),
        }
    }
}

fn maps() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata/maps")
}
