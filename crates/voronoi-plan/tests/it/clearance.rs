//! The clearance field against its definition, square by square.

use morpho::BitImage;
use occgrid::{Cell, GridPoint, MapFrame, Pose2};
use voronoi_plan::{ClearanceField, FreeSpace};

use crate::random::Random;

/// Distance from a point to a segment.
fn to_segment(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (ux, uy) = (b[0] - a[0], b[1] - a[1]);
    let n = ux * ux + uy * uy;
    let t = if n > 0.0 {
        (((p[0] - a[0]) * ux + (p[1] - a[1]) * uy) / n).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p[0] - a[0] - t * ux).hypot(p[1] - a[1] - t * uy)
}

fn cross(o: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
}

/// Distance between two segments.
fn between_segments(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> f64 {
    if cross(a, b, c) * cross(a, b, d) < 0.0 && cross(c, d, a) * cross(c, d, b) < 0.0 {
        return 0.0;
    }
    to_segment(a, c, d)
        .min(to_segment(b, c, d))
        .min(to_segment(c, a, b))
        .min(to_segment(d, a, b))
}

/// Distance between a segment and the square of cell (col, row), by its four sides.
pub(crate) fn to_square(a: [f64; 2], b: [f64; 2], col: usize, row: usize) -> f64 {
    let (x, y) = (col as f64, row as f64);
    let inside = |p: [f64; 2]| p[0] >= x && p[0] <= x + 1.0 && p[1] >= y && p[1] <= y + 1.0;
    if inside(a) || inside(b) {
        return 0.0;
    }
    let corners = [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]];
    (0..4)
        .map(|i| between_segments(a, b, corners[i], corners[(i + 1) % 4]))
        .fold(f64::INFINITY, f64::min)
}

/// The clearance of a segment by looking at every square.
fn by_definition(cells: &BitImage, a: [f64; 2], b: [f64; 2]) -> f64 {
    let (w, h) = (cells.width() as f64, cells.height() as f64);
    let mut least = f64::INFINITY;
    for p in [a, b] {
        for d in [p[0], p[1], w - p[0], h - p[1]] {
            least = least.min(d.max(0.0));
        }
    }
    for row in 0..cells.height() {
        for col in 0..cells.width() {
            if !cells.get(col, row) {
                least = least.min(to_square(a, b, col, row));
            }
        }
    }
    least
}

fn field_of(cells: BitImage) -> ClearanceField {
    let frame = MapFrame::new(
        cells.width() as u32,
        cells.height() as u32,
        0.05,
        Pose2::new(0.0, 0.0, 0.0),
    )
    .expect("a frame");
    ClearanceField::new(&FreeSpace::new(frame, cells))
}

fn random_cells(random: &mut Random, width: usize, height: usize) -> BitImage {
    let blocked = [0.0, 0.002, 0.02, 0.1, 0.4, 1.0][random.below(6)];
    let mut cells = BitImage::from_fn(width, height, |_, _| random.unit() >= blocked);
    if random.below(2) == 0 {
        let (x, y) = (random.below(width), random.below(height));
        for i in 0..random.below(12) {
            if x + i < width {
                cells.set(x + i, y, false);
            }
        }
    }
    cells
}

/// A coordinate: any, on a grid line, or at a cell's centre; at times a little outside.
fn coordinate(random: &mut Random, side: usize) -> f64 {
    let value = random.unit() * (side as f64 + 1.0) - 0.5;
    match random.below(3) {
        0 => value,
        1 => value.round(),
        _ => value.floor() + 0.5,
    }
}

const SIDES: [usize; 12] = [1, 2, 3, 5, 12, 40, 63, 64, 65, 127, 128, 129];

#[test]
fn cell_centers_as_defined() {
    let mut random = Random::new(1);
    for _ in 0..60 {
        let (w, h) = (SIDES[random.below(9)], SIDES[random.below(9)]);
        let cells = random_cells(&mut random, w, h);
        let field = field_of(cells.clone());
        for _ in 0..40 {
            let (col, row) = (random.below(w), random.below(h));
            let center = [col as f64 + 0.5, row as f64 + 0.5];
            let expected = by_definition(&cells, center, center);
            let found = field.at(Cell::new(col as u32, row as u32));
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
            let squared = field.squared_doubled()[row * w + col];
            assert!((f64::from(squared) - 4.0 * expected * expected).abs() < 1e-9);
        }
        assert!(field.at(Cell::new(w as u32, 0)).abs() < 1e-12);
    }
}

#[test]
fn segments_as_defined() {
    let maps = if crate::long() { 20_000 } else { 400 };
    let mut random = Random::new(2);
    for _ in 0..maps {
        let w = SIDES[random.below(SIDES.len())];
        let h = SIDES[random.below(SIDES.len())].min(4000 / w).max(1);
        let cells = random_cells(&mut random, w, h);
        let field = field_of(cells.clone());
        for _ in 0..12 {
            let a = [coordinate(&mut random, w), coordinate(&mut random, h)];
            let b = match random.below(4) {
                0 => a,
                1 => [a[0] + random.unit() * 2.0 - 1.0, a[1]],
                _ => [coordinate(&mut random, w), coordinate(&mut random, h)],
            };
            let p = |[col, row]: [f64; 2]| GridPoint { col, row };
            let expected = by_definition(&cells, a, b);
            let found = field.of_segment(p(a), p(b));
            let context = format!("{a:?} {b:?}: {found:?}, expected {expected}\n{cells:?}");
            assert!((found.clearance - expected).abs() < 1e-9, "{context}");
            let gap = (found.at.col - found.obstacle.col).hypot(found.at.row - found.obstacle.row);
            assert!((gap - expected).abs() < 1e-9, "{context}");
            let at = [found.at.col, found.at.row];
            assert!(to_segment(at, a, b) < 1e-9, "{context}");
            for min in [0.0, 0.5, 1.0, random.unit() * 8.0, expected + 1e-6] {
                let clear = field.segment_is_clear(p(a), p(b), min);
                assert_eq!(clear, expected > 2e-9 && expected >= min, "{min} {context}");
            }
            if expected > 0.0 {
                assert!(field.segment_is_clear(p(a), p(b), expected), "{context}");
            }
        }
    }
}

#[test]
fn ends_that_are_not_finite_have_no_clearance() {
    let field = field_of(BitImage::from_fn(9, 9, |_, _| true));
    let inside = GridPoint { col: 4.5, row: 4.5 };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
        let end = GridPoint { col: bad, row: 4.5 };
        assert!(field.of_segment(inside, end).clearance <= 0.0);
        assert!(field.of_segment(end, inside).clearance <= 0.0);
        assert!(!field.segment_is_clear(inside, end, 0.0));
        assert!(field.of_point(end) <= 0.0);
    }
    assert!((field.of_point(inside) - 4.5).abs() < 1e-12);
}
