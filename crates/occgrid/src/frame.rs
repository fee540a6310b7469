//! The map frame: where cells are in the world, and the only place where y flips.
//!
//! World axes follow REP-103 (metres, radians, right-handed, yaw counter-clockwise). Grid memory is
//! image memory: row 0 is the top of the picture. The origin is the ROS `map_server` origin: the pose
//! of the lower-left corner of the lower-left cell, with yaw.

use thiserror::Error;

/// The largest width or height of a map [cells], as Nav2 checks it.
pub const MAX_SIDE_CELLS: u32 = 32_767;

/// A point in the map frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Point2 {
    /// [m]
    pub x: f64,
    /// [m]
    pub y: f64,
}

impl Point2 {
    /// A point from its coordinates [m].
    #[must_use]
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Euclidean distance [m].
    #[must_use]
    pub fn distance(self, other: Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }
}

/// A pose in the plane: position and heading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose2 {
    /// [m]
    pub x: f64,
    /// [m]
    pub y: f64,
    /// Heading, counter-clockwise from +x [rad], any finite value.
    pub theta: f64,
}

impl Pose2 {
    /// A pose from position [m] and heading [rad].
    #[must_use]
    pub const fn new(x: f64, y: f64, theta: f64) -> Self {
        Self { x, y, theta }
    }

    /// The position alone.
    #[must_use]
    pub const fn position(self) -> Point2 {
        Point2 {
            x: self.x,
            y: self.y,
        }
    }

    /// `a_from_c = a_from_b.compose(b_from_c)`.
    #[must_use]
    pub fn compose(self, other: Self) -> Self {
        let p = self.transform_from(other.position());
        Self {
            x: p.x,
            y: p.y,
            theta: self.theta + other.theta,
        }
    }

    /// `b_from_a` of `a_from_b`.
    #[must_use]
    pub fn inverse(self) -> Self {
        let (sin, cos) = self.theta.sin_cos();
        Self {
            x: -(cos * self.x + sin * self.y),
            y: sin * self.x - cos * self.y,
            theta: -self.theta,
        }
    }

    /// A point given in this pose's frame, in the frame in which this pose is given.
    #[must_use]
    pub fn transform_from(self, point: Point2) -> Point2 {
        let (sin, cos) = self.theta.sin_cos();
        Point2 {
            x: self.x + cos * point.x - sin * point.y,
            y: self.y + sin * point.x + cos * point.y,
        }
    }
}

/// A cell of the grid; row 0 is the top of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Cell {
    /// From the left, 0-based.
    pub col: u32,
    /// From the top, 0-based.
    pub row: u32,
}

impl Cell {
    /// A cell from its column and row.
    #[must_use]
    pub const fn new(col: u32, row: u32) -> Self {
        Self { col, row }
    }
}

/// A point in grid coordinates [cells]: cell `(c, r)` covers `[c, c+1) x [r, r+1)`, its centre is
/// `(c + 0.5, r + 0.5)`; `col` grows to the right, `row` grows down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridPoint {
    /// From the left edge of the grid [cells].
    pub col: f64,
    /// From the top edge of the grid [cells].
    pub row: f64,
}

/// Why a [`MapFrame`] was refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FrameError {
    /// A side is 0 or above [`MAX_SIDE_CELLS`].
    #[error("map size must be 1 to {MAX_SIDE_CELLS} cells a side, found {width} x {height}")]
    Size {
        /// [cells]
        width: u32,
        /// [cells]
        height: u32,
    },
    /// The resolution is not a length between 1e-6 m and 100 m.
    #[error("resolution must be 0.000001 to 100 m a cell, found {found}")]
    Resolution {
        /// [m]
        found: f64,
    },
    /// The origin is not finite.
    #[error("origin must be three finite numbers, found [{}, {}, {}]", found.x, found.y, found.theta)]
    Origin {
        /// As given.
        found: Pose2,
    },
}

/// Size, resolution and origin of a grid: everything that places cells in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct MapFrame {
    width: u32,
    height: u32,
    resolution: f64,
    origin: Pose2,
}

impl MapFrame {
    /// A frame of `width` x `height` cells of `resolution` [m], whose lower-left corner is at `origin`.
    ///
    /// # Errors
    /// [`FrameError`] where a side is 0 or above [`MAX_SIDE_CELLS`], the resolution is outside
    /// 1e-6..=100 m, or the origin is not finite.
    pub fn new(
        width: u32,
        height: u32,
        resolution: f64,
        origin: Pose2,
    ) -> Result<Self, FrameError> {
        let side = 1..=MAX_SIDE_CELLS;
        if !side.contains(&width) || !side.contains(&height) {
            return Err(FrameError::Size { width, height });
        }
        if !(1e-6..=100.0).contains(&resolution) {
            return Err(FrameError::Resolution { found: resolution });
        }
        if ![origin.x, origin.y, origin.theta]
            .iter()
            .all(|v| v.is_finite())
        {
            return Err(FrameError::Origin { found: origin });
        }
        Ok(Self {
            width,
            height,
            resolution,
            origin,
        })
    }

    /// Columns [cells].
    #[must_use]
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Rows [cells].
    #[must_use]
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// Side of a cell [m].
    #[must_use]
    pub const fn resolution(&self) -> f64 {
        self.resolution
    }

    /// Pose of the lower-left corner in the map frame.
    #[must_use]
    pub const fn origin(&self) -> Pose2 {
        self.origin
    }

    /// Cells in the grid.
    #[must_use]
    pub const fn cell_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Index of a cell in row-major image memory.
    #[must_use]
    pub const fn index(&self, cell: Cell) -> usize {
        cell.row as usize * self.width as usize + cell.col as usize
    }

    /// Grid coordinates of a point of the map frame, also outside the grid.
    #[must_use]
    pub fn grid_from_map(&self, point: Point2) -> GridPoint {
        let (sin, cos) = self.origin.theta.sin_cos();
        let (dx, dy) = (point.x - self.origin.x, point.y - self.origin.y);
        GridPoint {
            col: (cos * dx + sin * dy) / self.resolution,
            row: f64::from(self.height) - (cos * dy - sin * dx) / self.resolution,
        }
    }

    /// The point of the map frame at the given grid coordinates.
    #[must_use]
    pub fn map_from_grid(&self, point: GridPoint) -> Point2 {
        self.origin.transform_from(Point2 {
            x: point.col * self.resolution,
            y: (f64::from(self.height) - point.row) * self.resolution,
        })
    }

    /// The cell that holds a point of the map frame; `None` outside the grid or for NaN.
    #[must_use]
    pub fn cell_at(&self, point: Point2) -> Option<Cell> {
        let GridPoint { col, row } = self.grid_from_map(point);
        let inside =
            col >= 0.0 && row >= 0.0 && col < f64::from(self.width) && row < f64::from(self.height);
        inside.then_some(Cell {
            col: col as u32,
            row: row as u32,
        })
    }

    /// The centre of a cell in the map frame.
    #[must_use]
    pub fn center_of(&self, cell: Cell) -> Point2 {
        self.map_from_grid(GridPoint {
            col: f64::from(cell.col) + 0.5,
            row: f64::from(cell.row) + 0.5,
        })
    }
}
