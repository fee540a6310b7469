//! How far a round body can go straight ahead on a map.

use occgrid::{CellState, OccupancyGrid, OccupancyMap, Point2, Pose2};

/// A map that can be asked about a place.
pub trait SwathMap {
    /// What is known of the cell at a place; unknown outside.
    fn at(&self, place: Point2) -> CellState;
    /// Side of a cell [m].
    fn resolution(&self) -> f64;
}

impl SwathMap for OccupancyMap {
    fn at(&self, place: Point2) -> CellState {
        self.frame()
            .cell_at(place)
            .map_or(CellState::Unknown, |cell| self.state(cell))
    }

    fn resolution(&self) -> f64 {
        self.frame().resolution()
    }
}

/// Log-odds of probability 0.35 and 0.65: below the one a cell of a grid counts as free, above the other as
/// occupied, as in the maps that are saved.
const KNOWN: f32 = 0.619;

impl SwathMap for OccupancyGrid {
    fn at(&self, place: Point2) -> CellState {
        let Some(cell) = self.frame().cell_at(place) else {
            return CellState::Unknown;
        };
        let log_odds = self.log_odds()[self.frame().index(cell)];
        if log_odds >= KNOWN {
            CellState::Occupied
        } else if log_odds <= -KNOWN {
            CellState::Free
        } else {
            CellState::Unknown
        }
    }

    fn resolution(&self) -> f64 {
        self.frame().resolution()
    }
}

/// How far the body can go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swath {
    /// Over cells that are known to be free [m].
    pub free: f64,
    /// Before it touches a cell that is known to be occupied [m].
    pub clear: f64,
}

/// How far a disc of `radius` at `from` can go along its heading, up to `reach` [m]. Sampled at half a cell.
///
/// Linear in the area of the swath.
#[must_use]
pub fn swath(map: &impl SwathMap, from: Pose2, radius: f64, reach: f64) -> Swath {
    let step = map.resolution() / 2.0;
    let columns = (radius / step).floor() as i32;
    let mut found = Swath {
        free: reach,
        clear: reach,
    };
    for column in -columns..=columns {
        let y = f64::from(column) * step;
        let front = (radius * radius - y * y).max(0.0).sqrt();
        let mut gone = 0.0;
        while gone < found.clear {
            let place = from.transform_from(Point2::new(front + gone, y));
            match map.at(place) {
                CellState::Free => {}
                CellState::Unknown => found.free = found.free.min(gone),
                CellState::Occupied => {
                    found.free = found.free.min(gone);
                    found.clear = found.clear.min(gone);
                }
            }
            gone += step;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use occgrid::MapFrame;

    #[test]
    fn a_disc_stops_where_it_touches() {
        // free up to x = 3, occupied from there, and an unknown cell beside the axis at x = 1.5
        let frame = MapFrame::new(80, 40, 0.05, Pose2::new(0.0, -1.0, 0.0)).expect("a frame");
        let mut values = vec![0_i8; frame.cell_count()];
        for (index, value) in values.iter_mut().enumerate() {
            if index % 80 >= 60 {
                *value = 100;
            }
        }
        let unknown = frame.cell_at(Point2::new(1.51, 0.15)).expect("inside");
        values[frame.index(unknown)] = -1;
        let map = OccupancyMap::new(frame, values, 25, 65);
        let found = swath(&map, Pose2::new(0.5, 0.0, 0.0), 0.2, 5.0);
        assert!((found.clear - 2.3).abs() < 0.03, "{found:?}");
        let beside = 1.5 - 0.5 - (0.2_f64.powi(2) - 0.15_f64.powi(2)).sqrt();
        assert!((found.free - beside).abs() < 0.05, "{found:?}");
        let back = swath(&map, Pose2::new(0.5, 0.0, std::f64::consts::PI), 0.2, 5.0);
        assert!(
            (back.free - 0.3).abs() < 0.03 && back.clear > 4.9,
            "{back:?}"
        );
    }
}
