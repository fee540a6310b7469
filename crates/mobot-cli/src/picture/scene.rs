//! What a picture shows, apart from how it is drawn.

use occgrid::{CellState, GridPoint, MapFrame, OccupancyMap, Point2};

/// Grey of free cells; occupied cells are [`OCCUPIED_GRAY`], unknown ones [`UNKNOWN_GRAY`].
const FREE_GRAY: u8 = 255;
/// Grey of occupied cells.
const OCCUPIED_GRAY: u8 = 48;
/// Grey of unknown cells.
const UNKNOWN_GRAY: u8 = 208;
/// Cells of unknown kept around what is known when a picture is cropped.
const MARGIN_CELLS: u32 = 12;

/// Red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

impl Color {
    /// Routes.
    pub const ROUTE: Self = Self(0, 158, 115);
    /// Faults.
    pub const FAULT: Self = Self(220, 0, 90);
    /// Nodes and text.
    pub const INK: Self = Self(30, 30, 30);
}

/// A line on the map.
#[derive(Debug, Clone)]
pub struct Stroke {
    /// In grid coordinates of the whole map.
    pub points: Vec<GridPoint>,
    /// Its colour.
    pub color: Color,
    /// Its width [screen pixels].
    pub width_px: f64,
    /// The name by which a page may hide it, or nothing.
    pub layer: &'static str,
}

/// A dot on the map.
#[derive(Debug, Clone, Copy)]
pub struct Mark {
    /// In grid coordinates of the whole map.
    pub at: GridPoint,
    /// Its colour.
    pub color: Color,
    /// Its radius [screen pixels].
    pub radius_px: f64,
}

/// A map in grey with lines and marks on it, cropped to what is known.
#[derive(Debug, Clone)]
pub struct Scene {
    frame: MapFrame,
    /// Left, top, width, height of the part shown [cells].
    pub(super) view: [u32; 4],
    /// Grey of each cell shown, row after row.
    pub(super) gray: Vec<u8>,
    /// Lines, drawn in order.
    pub(super) strokes: Vec<Stroke>,
    /// Of the lines to come.
    layer: &'static str,
    /// Dots, drawn over the lines.
    pub(super) marks: Vec<Mark>,
    /// Lines of text under the map (SVG only).
    pub(super) caption: Vec<(Color, String)>,
}

impl Scene {
    /// The map alone, cropped to its known cells.
    #[must_use]
    pub fn of_map(map: &OccupancyMap) -> Self {
        let frame = *map.frame();
        let width = frame.width() as usize;
        let view = known_part(map);
        let [left, top, shown, rows] = view.map(|v| v as usize);
        let mut gray = Vec::with_capacity(shown * rows);
        for row in map.values().chunks_exact(width).skip(top).take(rows) {
            gray.extend(
                row[left..left + shown]
                    .iter()
                    .map(|&v| match map.classify(v) {
                        CellState::Free => FREE_GRAY,
                        CellState::Occupied => OCCUPIED_GRAY,
                        CellState::Unknown => UNKNOWN_GRAY,
                    }),
            );
        }
        Self {
            frame,
            view,
            gray,
            strokes: vec![],
            layer: "",
            marks: vec![],
            caption: vec![],
        }
    }

    /// Side of a cell [m].
    pub(super) fn resolution(&self) -> f64 {
        self.frame.resolution()
    }

    /// Lines from now on belong to a layer of this name (SVG: their class).
    pub const fn layer(&mut self, name: &'static str) {
        self.layer = name;
    }

    /// Adds a line given in the map frame [m].
    pub fn line(&mut self, points: &[Point2], color: Color, width_px: f64) {
        let points = points
            .iter()
            .map(|&p| self.frame.grid_from_map(p))
            .collect();
        self.strokes.push(Stroke {
            points: without_collinear(points),
            color,
            width_px,
            layer: self.layer,
        });
    }

    /// Adds a dot given in the map frame [m].
    pub fn dot(&mut self, at: Point2, color: Color, radius_px: f64) {
        self.marks.push(Mark {
            at: self.frame.grid_from_map(at),
            color,
            radius_px,
        });
    }

    /// Adds a line of text under the map.
    pub fn note(&mut self, color: Color, text: impl Into<String>) {
        self.caption.push((color, text.into()));
    }
}

/// The colour of a clearance between the least (vermilion) and the greatest (blue) on the picture: two
/// hues that also colour-blind people tell apart.
#[must_use]
pub fn clearance_color(clearance: f64, least: f64, greatest: f64) -> Color {
    let span = (greatest - least).max(1e-9);
    let t = ((clearance - least) / span).clamp(0.0, 1.0).sqrt();
    let mix = |a: u8, b: u8| (f64::from(a) + t * (f64::from(b) - f64::from(a))).round() as u8;
    Color(mix(213, 0), mix(94, 90), mix(0, 200))
}

/// Left, top, width, height of the known cells with a margin; the whole map where nothing is known.
fn known_part(map: &OccupancyMap) -> [u32; 4] {
    let (width, height) = (map.frame().width(), map.frame().height());
    let (mut left, mut right, mut top, mut bottom) = (width, 0, height, 0);
    for (row, values) in (0..).zip(map.values().chunks_exact(width as usize)) {
        let known = |v: &i8| map.classify(*v) != CellState::Unknown;
        if let (Some(first), Some(last)) = (
            values.iter().position(known),
            values.iter().rposition(known),
        ) {
            left = left.min(first as u32);
            right = right.max(last as u32);
            top = top.min(row);
            bottom = row;
        }
    }
    if left > right {
        return [0, 0, width, height];
    }
    let (left, top) = (
        left.saturating_sub(MARGIN_CELLS),
        top.saturating_sub(MARGIN_CELLS),
    );
    let right = (right + MARGIN_CELLS).min(width - 1);
    let bottom = (bottom + MARGIN_CELLS).min(height - 1);
    [left, top, right - left + 1, bottom - top + 1]
}

/// The same line with fewer points: those inside straight runs are dropped.
fn without_collinear(points: Vec<GridPoint>) -> Vec<GridPoint> {
    let mut kept: Vec<GridPoint> = Vec::with_capacity(points.len());
    for p in points {
        if let [.., a, b] = kept[..] {
            let cross = (b.col - a.col) * (p.row - b.row) - (b.row - a.row) * (p.col - b.col);
            let ahead = (b.col - a.col) * (p.col - b.col) + (b.row - a.row) * (p.row - b.row);
            if cross.abs() < 1e-6 && ahead >= 0.0 {
                kept.pop();
            }
        }
        kept.push(p);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use occgrid::Pose2;

    #[test]
    fn a_picture_shows_what_is_known_with_a_margin() {
        let frame = MapFrame::new(100, 80, 0.1, Pose2::default()).unwrap();
        let mut values = vec![-1; 8000];
        values[40 * 100 + 50] = 0;
        values[41 * 100 + 52] = 100;
        let scene = Scene::of_map(&OccupancyMap::new(frame, values, 0, 100));
        assert_eq!(scene.view, [38, 28, 27, 26]);
        assert_eq!(scene.gray[12 * 27 + 12], FREE_GRAY);
        assert_eq!(scene.gray[13 * 27 + 14], OCCUPIED_GRAY);
    }

    #[test]
    fn straight_runs_keep_their_ends_only() {
        let at = |col, row| GridPoint { col, row };
        let line = vec![
            at(0.0, 0.0),
            at(1.0, 0.0),
            at(2.0, 0.0),
            at(3.0, 1.0),
            at(2.0, 0.0),
        ];
        let kept = without_collinear(line);
        assert_eq!(
            kept,
            [at(0.0, 0.0), at(2.0, 0.0), at(3.0, 1.0), at(2.0, 0.0)]
        );
    }
}
