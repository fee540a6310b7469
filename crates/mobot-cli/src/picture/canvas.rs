//! Pixels that lines and small words are drawn into.

use super::scene::Color;

/// Red, green, blue, row after row.
pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: Vec<u8>,
}

impl Canvas {
    /// Every pixel whose centre is within `radius` of the segment, and at least the nearest one.
    pub(super) fn line(&mut self, a: (f64, f64), b: (f64, f64), radius: f64, color: Color) {
        let radius = radius.max(0.71);
        let clip = |v: f64, most: usize| v.clamp(0.0, most as f64) as usize;
        let columns =
            clip(a.0.min(b.0) - radius, self.width)..clip(a.0.max(b.0) + radius + 1.0, self.width);
        let rows = clip(a.1.min(b.1) - radius, self.height)
            ..clip(a.1.max(b.1) + radius + 1.0, self.height);
        for y in rows {
            for x in columns.clone() {
                let p = (x as f64 + 0.5, y as f64 + 0.5);
                if squared_distance(p, a, b) <= radius * radius {
                    let at = 3 * (y * self.width + x);
                    self.rgb[at..at + 3].copy_from_slice(&[color.0, color.1, color.2]);
                }
            }
        }
    }

    /// Words in small capitals: digits, letters of units and a few signs; others are left blank.
    pub(super) fn text(&mut self, at: (f64, f64), text: &str, color: Color) {
        let mut left = at.0;
        for c in text.chars() {
            let rows = glyph(c);
            for (row, bits) in rows.iter().enumerate() {
                for column in 0..3 {
                    if bits & (4 >> column) != 0 {
                        let (x, y) = (left + 2.0 * f64::from(column), at.1 + 2.0 * row as f64);
                        self.square(x, y, color);
                    }
                }
            }
            left += 8.0;
        }
    }

    /// A square of two by two pixels.
    fn square(&mut self, x: f64, y: f64, color: Color) {
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (column, row) = (x as i64 + dx, y as i64 + dy);
            let inside =
                (0..self.width as i64).contains(&column) && (0..self.height as i64).contains(&row);
            if inside {
                let at = 3 * (row as usize * self.width + column as usize);
                self.rgb[at..at + 3].copy_from_slice(&[color.0, color.1, color.2]);
            }
        }
    }
}

/// Five rows of three bits.
fn glyph(c: char) -> [u8; 5] {
    match c {
        '0' => [7, 5, 5, 5, 7],
        '1' => [2, 6, 2, 2, 7],
        '2' => [7, 1, 7, 4, 7],
        '3' => [7, 1, 7, 1, 7],
        '4' => [5, 5, 7, 1, 1],
        '5' => [7, 4, 7, 1, 7],
        '6' => [7, 4, 7, 5, 7],
        '7' => [7, 1, 1, 1, 1],
        '8' => [7, 5, 7, 5, 7],
        '9' => [7, 5, 7, 1, 7],
        '.' => [0, 0, 0, 0, 2],
        '-' => [0, 0, 7, 0, 0],
        '%' => [5, 1, 2, 4, 5],
        '>' => [4, 2, 1, 2, 4],
        'c' => [0, 7, 4, 4, 7],
        'm' => [0, 7, 7, 5, 5],
        'p' => [0, 7, 5, 7, 4],
        'x' => [0, 5, 2, 5, 5],
        _ => [0; 5],
    }
}

fn squared_distance(p: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (px, py) = (p.0 - a.0, p.1 - a.1);
    let t = ((px * dx + py * dy) / (dx * dx + dy * dy).max(1e-12)).clamp(0.0, 1.0);
    (px - t * dx).powi(2) + (py - t * dy).powi(2)
}
